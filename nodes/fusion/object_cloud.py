"""The voxels of one object, kept by submap as well where the map may have to move."""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from dataclasses import dataclass

import numpy as np

from placegraph.nodes.fusion.voxel_index import pack, sum_by_key
from placegraph.runtime.arrays import F64, I64, U8, Bool
from placegraph.runtime.vision.geometry import inverse, transform

MAX_PARTS = 8  # departs: submaps that an object's points are kept by; beyond, the two oldest become one


@dataclass(frozen=True, eq=False)
class Ground:
    """What the clouds of all objects share: voxel size in metres and, where the map may move, how submaps lie now."""

    voxel_m: float
    world_from_fused: Mapping[int, F64] | None = None  # of the submaps that have moved; None: nothing ever moves


class Cloud:
    """Voxels of an object: keys (N,) sorted, values (N, 8) as in lift.Observation, and what has been seen through."""

    def __init__(self, keys: I64, values: F64, submap: int, ground: Ground) -> None:
        self.keys, self.values = keys, values
        self.seen_through: U8 = np.zeros(len(keys), np.uint8)  # keyframes, less those that saw it
        self.shown: F64 = np.zeros(len(keys))  # views of the object that saw the voxel, whatever their masks held
        self._ground = ground
        self._placed_by: dict[int, F64] = {}  # poses of the parts at the last `place_again`
        self._parts: dict[int, tuple[I64, F64]] = {}  # as they were when they were fused
        self._keep(submap, keys, values)

    def add(self, keys: I64, values: F64, submap: int) -> None:
        """Add one view's voxels on behalf of a submap."""
        self._sum(keys, values)
        self._keep(submap, keys, values)

    def absorb(self, other: Cloud) -> None:
        """Add all of another cloud."""
        self._sum(other.keys, other.values)
        self.shown[np.searchsorted(self.keys, other.keys)] += other.shown
        self._placed_by.update(other._placed_by)
        for submap, (keys, values) in other._parts.items():
            self._keep(submap, keys, values)

    def copy(self) -> Cloud:
        """A cloud of the same voxels that changes on its own; arrays are never changed in place but for counts."""
        other = copy(self)
        other._parts, other._placed_by = dict(self._parts), dict(self._placed_by)
        other.shown, other.seen_through = self.shown.copy(), self.seen_through.copy()
        return other

    def is_of(self, submaps: Mapping[int, object]) -> bool:
        """Whether some of its points came with one of these submaps."""
        return any(submap in submaps for submap in self._parts)

    def show(self, keys: I64) -> None:
        """A view of the object saw these voxels."""
        if len(keys):
            at = np.minimum(np.searchsorted(self.keys, keys), len(self.keys) - 1)
            self.shown[at[self.keys[at] == keys]] += 1

    def claimed(self) -> F64:
        """(N,) share of the views that saw a voxel whose masks held it."""
        views = self.values[:, 7]
        return np.asarray(views / np.maximum(views, self.shown))

    def place_again(self) -> None:
        """Make the voxels anew from the parts, after submaps have moved."""
        known, claimed = self.keys, self.claimed()
        placed = []
        for submap in sorted(self._parts):
            before = np.minimum(
                np.searchsorted(known, self._keys_at(submap, self._placed_by.get(submap))), len(known) - 1
            )
            keys, values = self._parts[submap]
            shown = values[:, 7] / claimed[before]
            placed.append(self._moved(keys, np.column_stack((values, shown)), self._pose(submap)))
            self._placed_by[submap] = self._pose(submap)
        self.keys, values = sum_by_key(*(np.concatenate(column) for column in zip(*placed, strict=True)))
        self.values, self.shown = values[:, :8], values[:, 8]
        self.seen_through = np.zeros(len(self.keys), np.uint8)

    def remove(self, gone: Bool) -> None:
        """Drop voxels (N,)."""
        keys = self.keys[gone]
        for name in ("keys", "values", "seen_through", "shown"):
            setattr(self, name, getattr(self, name)[~gone])
        for submap, (fused, values) in list(self._parts.items()):
            kept = ~np.isin(self._keys_at(submap, self._pose(submap)), keys)
            self._parts[submap] = fused[kept], values[kept]
            if not kept.any():
                del self._parts[submap]

    def _sum(self, keys: I64, values: F64) -> None:
        before, counts, shown = self.keys, self.seen_through, self.shown
        self.keys, self.values = sum_by_key(np.r_[before, keys], np.r_[self.values, values])
        self.seen_through, self.shown = np.zeros(len(self.keys), np.uint8), np.zeros(len(self.keys))
        at = np.searchsorted(self.keys, before)
        self.seen_through[at], self.shown[at] = counts, shown
        self.seen_through[np.searchsorted(self.keys, keys)] = 0

    def _keep(self, submap: int, keys: I64, values: F64) -> None:
        if self._ground.world_from_fused is None:
            return
        if submap in self._parts:
            known_keys, known_values = self._parts[submap]
            keys, values = sum_by_key(np.r_[known_keys, keys], np.r_[known_values, values])
        self._parts[submap] = keys, values
        if len(self._parts) > MAX_PARTS:
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

    def _keys_at(self, submap: int, pose: F64 | None) -> I64:
        keys, values = self._parts[submap]
        if pose is None or np.array_equal(pose, np.eye(4)):
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
