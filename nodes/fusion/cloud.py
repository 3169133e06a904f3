"""The voxels of one object, kept by submap as well where the map may have to move."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from placegraph.nodes.fusion.cells import pack, sum_by_key
from placegraph.runtime.geometry import inverse, transform

Bool = NDArray[np.bool_]
F64 = NDArray[np.float64]
I64 = NDArray[np.int64]
U8 = NDArray[np.uint8]

MOST_PARTS = 8  # departs: submaps that an object's points are kept by; beyond, the two oldest become one


@dataclass(frozen=True, eq=False)
class Ground:
    """What the clouds of all objects share: voxel size in metres and, where the map may move, how submaps lie now."""

    voxel_m: float
    world_from_fused: Mapping[int, F64] | None = None  # of the submaps that have moved; None: nothing ever moves


class Cloud:
    """Voxels of an object: keys (N,) sorted, values (N, 8) as in lift.Observation, and what has been seen through."""

    def __init__(self, keys: I64, values: F64, submap: int, ground: Ground) -> None:
        self.keys, self.values = keys, values
        self.seen_through: U8 = np.zeros(len(keys), np.uint8)  # in how many keyframes since it was last confirmed
        self._ground = ground
        self._parts: dict[int, tuple[I64, F64]] = {}  # as they were when they were fused
        self._keep(submap, keys, values)

    def add(self, keys: I64, values: F64, submap: int) -> None:
        """Add one view's voxels on behalf of a submap."""
        self._sum(keys, values)
        self._keep(submap, keys, values)

    def absorb(self, other: Cloud) -> None:
        """Add all of another cloud."""
        self._sum(other.keys, other.values)
        for submap, (keys, values) in other._parts.items():
            self._keep(submap, keys, values)

    def is_of(self, submaps: Mapping[int, object]) -> bool:
        """Whether some of its points came with one of these submaps."""
        return any(submap in submaps for submap in self._parts)

    def place_again(self) -> None:
        """Make the voxels anew from the parts, after submaps have moved."""
        placed = [self._placed(submap) for submap in sorted(self._parts)]
        self.keys, self.values = sum_by_key(*(np.concatenate(column) for column in zip(*placed, strict=True)))
        self.seen_through = np.zeros(len(self.keys), np.uint8)

    def remove(self, gone: Bool) -> None:
        """Drop voxels (N,)."""
        keys = self.keys[gone]
        self.keys, self.values, self.seen_through = self.keys[~gone], self.values[~gone], self.seen_through[~gone]
        for submap, (fused, values) in list(self._parts.items()):
            kept = ~np.isin(self._keys_now(submap), keys)
            self._parts[submap] = fused[kept], values[kept]
            if not kept.any():
                del self._parts[submap]

    def _sum(self, keys: I64, values: F64) -> None:
        before, counts = self.keys, self.seen_through
        self.keys, self.values = sum_by_key(np.r_[before, keys], np.r_[self.values, values])
        self.seen_through = np.zeros(len(self.keys), np.uint8)
        self.seen_through[np.searchsorted(self.keys, before)] = counts
        self.seen_through[np.searchsorted(self.keys, keys)] = 0

    def _keep(self, submap: int, keys: I64, values: F64) -> None:
        if self._ground.world_from_fused is None:
            return
        if submap in self._parts:
            known_keys, known_values = self._parts[submap]
            keys, values = sum_by_key(np.r_[known_keys, keys], np.r_[known_values, values])
        self._parts[submap] = keys, values
        if len(self._parts) > MOST_PARTS:
            self._thin()

    def _thin(self) -> None:
        """The oldest part becomes one with the next, and moves with that from now on."""
        oldest, heir = sorted(self._parts)[:2]
        keys, values = self._placed(oldest)
        del self._parts[oldest]
        keys, values = self._moved(keys, values, inverse(self._pose(heir)))
        self._keep(heir, keys, values)

    def _pose(self, submap: int) -> F64:
        assert self._ground.world_from_fused is not None
        return self._ground.world_from_fused.get(submap, np.eye(4))

    def _placed(self, submap: int) -> tuple[I64, F64]:
        return self._moved(*self._parts[submap], self._pose(submap))

    def _keys_now(self, submap: int) -> I64:
        keys, values = self._parts[submap]
        pose = self._pose(submap)
        if np.array_equal(pose, np.eye(4)):
            return keys
        return pack(transform(pose, values[:, :3] / values[:, 6:7]), self._ground.voxel_m)

    def _moved(self, keys: I64, values: F64, pose: F64) -> tuple[I64, F64]:
        if np.array_equal(pose, np.eye(4)):
            return keys, values
        counts = values[:, 6:7]
        points = transform(pose, values[:, :3] / counts)
        cells = pack(points, self._ground.voxel_m)
        order = np.argsort(cells, kind="stable")
        found, sums = sum_by_key(cells, np.concatenate((points * counts, values[:, 3:]), axis=1))
        starts = np.searchsorted(cells[order], found)
        sums[:, 7] = np.maximum.reduceat(values[order, 7], starts)  # one view may have shown both voxels
        return found, sums
