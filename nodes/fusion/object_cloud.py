"""The voxels of one object, kept by submap as well where the map may have to move."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from placegraph.nodes.fusion.submap_voxels import SubmapVoxels
from placegraph.nodes.fusion.voxel_index import sum_by_key, voxel_keys
from placegraph.runtime.arrays import F64, I64, U8, Bool
from placegraph.runtime.vision.geometry import inverse, transform

MAX_SUBMAPS_PER_OBJECT = 8  # chosen by hand; beyond it the two oldest submaps of an object are merged


@dataclass(frozen=True)
class VoxelContext:
    """What the clouds of all objects share: the voxel size, and whether submaps are kept because they may move."""

    voxel_m: float
    keep_submaps: bool = False


class ObjectCloud:
    """Voxels of an object: sorted keys (N,), values (N, 8) as in Observation, and counts of keyframes for each."""

    def __init__(self, keys: I64, values: F64, submap: int, context: VoxelContext) -> None:
        self.keys, self.values = keys, values
        self.seen_through: U8 = np.zeros(len(keys), np.uint8)  # keyframes that saw through it, less those that saw it
        self.visible_counts: F64 = np.zeros(len(keys))  # views of the object that saw the voxel, in its mask or not
        self._context = context
        self._by_submap: dict[int, SubmapVoxels[np.float64]] = {}
        self._store(submap, keys, values)

    def add(self, keys: I64, values: F64, submap: int) -> None:
        """Add one view's voxels on behalf of a submap."""
        self._add_values(keys, values)
        self._store(submap, keys, values)

    def merge(self, merged: ObjectCloud) -> None:
        """Add all voxels of another cloud."""
        self._add_values(merged.keys, merged.values)
        self.visible_counts[np.searchsorted(self.keys, merged.keys)] += merged.visible_counts
        for submap, voxels in merged._by_submap.items():
            self._store(submap, *voxels.fused(), voxels.world_from_fused)

    def is_from_any(self, submaps: Iterable[int]) -> bool:
        """Whether some of its voxels came with one of these submaps."""
        return any(submap in self._by_submap for submap in submaps)

    def count_visible(self, keys: I64) -> None:
        """Count a view of the object that saw these voxels."""
        if len(keys):
            at = np.minimum(np.searchsorted(self.keys, keys), len(self.keys) - 1)
            self.visible_counts[at[self.keys[at] == keys]] += 1

    def mask_shares(self) -> F64:
        """(N,) of the views that saw a voxel, the share whose masks held it."""
        views = self.values[:, 7]
        return np.asarray(views / np.maximum(views, self.visible_counts))

    def move_submaps(self, moves: Mapping[int, F64]) -> None:
        """Make the voxels anew after submaps have moved; moves: their new world_from_fused (4, 4)."""
        keys_before, mask_shares = self.keys, self.mask_shares()
        placed = []
        for submap in sorted(self._by_submap):
            voxels = self._by_submap[submap]
            before = np.searchsorted(keys_before, voxels.placed(self._resample)[0])
            voxels.world_from_fused = moves.get(submap, voxels.world_from_fused)
            keys, values = voxels.placed(self._resample)
            visible_counts = values[:, 7] / mask_shares[np.minimum(before, len(keys_before) - 1)]
            placed.append(_sum_voxels(keys, np.column_stack((values, visible_counts))))
        self.keys, values = sum_by_key(*(np.concatenate(column) for column in zip(*placed, strict=True)))
        self.values, self.visible_counts = values[:, :8], values[:, 8]
        self.seen_through = np.zeros(len(self.keys), np.uint8)

    def remove(self, removed: Bool) -> None:
        """Remove voxels by a mask (N,)."""
        keys = self.keys[removed]
        for name in ("keys", "values", "seen_through", "visible_counts"):
            setattr(self, name, getattr(self, name)[~removed])
        for submap, voxels in list(self._by_submap.items()):
            if not voxels.discard(keys, self._resample):
                del self._by_submap[submap]

    def _add_values(self, keys: I64, values: F64) -> None:
        keys_before, seen_through, visible_counts = self.keys, self.seen_through, self.visible_counts
        self.keys, self.values = sum_by_key(np.r_[keys_before, keys], np.r_[self.values, values])
        self.seen_through, self.visible_counts = np.zeros(len(self.keys), np.uint8), np.zeros(len(self.keys))
        at = np.searchsorted(self.keys, keys_before)
        self.seen_through[at], self.visible_counts[at] = seen_through, visible_counts
        self.seen_through[np.searchsorted(self.keys, keys)] = 0

    def _store(self, submap: int, keys: I64, values: F64, world_from_fused: F64 | None = None) -> None:
        if not self._context.keep_submaps:
            return
        voxels = self._by_submap.setdefault(submap, SubmapVoxels(world_from_fused))
        voxels.add(keys, values)
        voxels.fused()
        if len(self._by_submap) > MAX_SUBMAPS_PER_OBJECT:
            self._merge_oldest_submaps()

    def _merge_oldest_submaps(self) -> None:
        """Merge the oldest submap into the next, with which it moves from now on."""
        oldest, second = sorted(self._by_submap)[:2]
        to_second: SubmapVoxels[np.float64] = SubmapVoxels(inverse(self._by_submap[second].world_from_fused))
        to_second.add(*_sum_voxels(*self._by_submap.pop(oldest).placed(self._resample)))
        self._store(second, *_sum_voxels(*to_second.placed(self._resample)))

    def _resample(self, keys: I64, values: F64, world_from_fused: F64) -> tuple[I64, F64]:
        """All pixels of a voxel move as their centroid does."""
        counts = values[:, 6:7]
        points = transform(world_from_fused, values[:, :3] / counts)
        moved_values = np.concatenate((points * counts, values[:, 3:]), axis=1)
        return voxel_keys(points, self._context.voxel_m), moved_values


def _sum_voxels(keys: I64, values: F64) -> tuple[I64, F64]:
    """Sorted unique voxels and sums of the values of one submap; views are not summed, as one may have shown both."""
    order = np.argsort(keys, kind="stable")
    unique_keys, sums = sum_by_key(keys, values)
    starts = np.searchsorted(keys[order], unique_keys)
    sums[:, 7] = np.maximum.reduceat(values[order, 7], starts)
    return unique_keys, sums
