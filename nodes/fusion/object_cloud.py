"""The voxels of one object, kept by submap as well where the map may have to move."""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from dataclasses import dataclass

import numpy as np

from placegraph.nodes.fusion.voxel_index import sum_by_key, voxel_keys
from placegraph.runtime.arrays import F64, I64, U8, Bool
from placegraph.runtime.vision.geometry import inverse, transform

MAX_SUBMAPS_PER_OBJECT = 8  # chosen by hand; beyond it the two oldest submaps of an object are merged


@dataclass(frozen=True, eq=False)
class VoxelContext:
    """What the clouds of all objects share: the voxel size and, where the map may move, how submaps have moved."""

    voxel_m: float
    world_from_fused: Mapping[int, F64] | None = None  # of the submaps that have moved; None: submaps are not kept


class ObjectCloud:
    """Voxels of an object: sorted keys (N,), values (N, 8) as in Observation, and counts of keyframes for each."""

    def __init__(self, keys: I64, values: F64, submap: int, context: VoxelContext) -> None:
        self.keys, self.values = keys, values
        self.seen_through: U8 = np.zeros(len(keys), np.uint8)  # keyframes that saw through it, less those that saw it
        self.visible_counts: F64 = np.zeros(len(keys))  # views of the object that saw the voxel, in its mask or not
        self._context = context
        self._integrated_poses: dict[int, F64] = {}  # of the submaps at the last `reintegrate`
        self._by_submap: dict[int, tuple[I64, F64]] = {}  # as they were when they were fused
        self._store(submap, keys, values)

    def add(self, keys: I64, values: F64, submap: int) -> None:
        """Add one view's voxels on behalf of a submap."""
        self._add_values(keys, values)
        self._store(submap, keys, values)

    def merge(self, merged: ObjectCloud) -> None:
        """Add all voxels of another cloud."""
        self._add_values(merged.keys, merged.values)
        self.visible_counts[np.searchsorted(self.keys, merged.keys)] += merged.visible_counts
        self._integrated_poses.update(merged._integrated_poses)
        for submap, (keys, values) in merged._by_submap.items():
            self._store(submap, keys, values)

    def copy(self) -> ObjectCloud:
        """A cloud of the same voxels that changes on its own; only counts are ever changed in place."""
        duplicate = copy(self)
        duplicate._by_submap, duplicate._integrated_poses = dict(self._by_submap), dict(self._integrated_poses)
        duplicate.visible_counts, duplicate.seen_through = self.visible_counts.copy(), self.seen_through.copy()
        return duplicate

    def is_from_any(self, submaps: Mapping[int, object]) -> bool:
        """Whether some of its voxels came with one of these submaps."""
        return any(submap in submaps for submap in self._by_submap)

    def count_visible(self, keys: I64) -> None:
        """Count a view of the object that saw these voxels."""
        if len(keys):
            at = np.minimum(np.searchsorted(self.keys, keys), len(self.keys) - 1)
            self.visible_counts[at[self.keys[at] == keys]] += 1

    def mask_shares(self) -> F64:
        """(N,) of the views that saw a voxel, the share whose masks held it."""
        views = self.values[:, 7]
        return np.asarray(views / np.maximum(views, self.visible_counts))

    def reintegrate(self) -> None:
        """Make the voxels anew from those of the submaps, after submaps have moved."""
        keys_before, mask_shares = self.keys, self.mask_shares()
        moved = []
        for submap in sorted(self._by_submap):
            before = np.minimum(
                np.searchsorted(keys_before, self._keys_at(submap, self._integrated_poses.get(submap))),
                len(keys_before) - 1,
            )
            keys, values = self._by_submap[submap]
            visible_counts = values[:, 7] / mask_shares[before]
            moved.append(self._transformed(keys, np.column_stack((values, visible_counts)), self._pose_of(submap)))
            self._integrated_poses[submap] = self._pose_of(submap)
        self.keys, values = sum_by_key(*(np.concatenate(column) for column in zip(*moved, strict=True)))
        self.values, self.visible_counts = values[:, :8], values[:, 8]
        self.seen_through = np.zeros(len(self.keys), np.uint8)

    def remove(self, removed: Bool) -> None:
        """Remove voxels by a mask (N,)."""
        keys = self.keys[removed]
        for name in ("keys", "values", "seen_through", "visible_counts"):
            setattr(self, name, getattr(self, name)[~removed])
        for submap, (fused_keys, values) in list(self._by_submap.items()):
            kept = ~np.isin(self._keys_at(submap, self._pose_of(submap)), keys)
            self._by_submap[submap] = fused_keys[kept], values[kept]
            if not kept.any():
                del self._by_submap[submap]

    def _add_values(self, keys: I64, values: F64) -> None:
        keys_before, seen_through, visible_counts = self.keys, self.seen_through, self.visible_counts
        self.keys, self.values = sum_by_key(np.r_[keys_before, keys], np.r_[self.values, values])
        self.seen_through, self.visible_counts = np.zeros(len(self.keys), np.uint8), np.zeros(len(self.keys))
        at = np.searchsorted(self.keys, keys_before)
        self.seen_through[at], self.visible_counts[at] = seen_through, visible_counts
        self.seen_through[np.searchsorted(self.keys, keys)] = 0

    def _store(self, submap: int, keys: I64, values: F64) -> None:
        if self._context.world_from_fused is None:
            return
        if submap in self._by_submap:
            stored_keys, stored_values = self._by_submap[submap]
            keys, values = sum_by_key(np.r_[stored_keys, keys], np.r_[stored_values, values])
        self._by_submap[submap] = keys, values
        if len(self._by_submap) > MAX_SUBMAPS_PER_OBJECT:
            self._merge_oldest_submaps()

    def _merge_oldest_submaps(self) -> None:
        """Merge the oldest submap into the next, with which it moves from now on."""
        oldest, second = sorted(self._by_submap)[:2]
        keys, values = self._in_world(oldest)
        del self._by_submap[oldest]
        keys, values = self._transformed(keys, values, inverse(self._pose_of(second)))
        self._store(second, keys, values)

    def _pose_of(self, submap: int) -> F64:
        assert self._context.world_from_fused is not None
        return self._context.world_from_fused.get(submap, np.eye(4))

    def _in_world(self, submap: int) -> tuple[I64, F64]:
        return self._transformed(*self._by_submap[submap], self._pose_of(submap))

    def _keys_at(self, submap: int, pose: F64 | None) -> I64:
        keys, values = self._by_submap[submap]
        if pose is None or np.array_equal(pose, np.eye(4)):
            return keys
        return voxel_keys(transform(pose, values[:, :3] / values[:, 6:7]), self._context.voxel_m)

    def _transformed(self, keys: I64, values: F64, pose: F64) -> tuple[I64, F64]:
        if np.array_equal(pose, np.eye(4)):
            return keys, values
        counts = values[:, 6:7]
        points = transform(pose, values[:, :3] / counts)
        moved_keys = voxel_keys(points, self._context.voxel_m)
        order = np.argsort(moved_keys, kind="stable")
        unique_keys, sums = sum_by_key(moved_keys, np.concatenate((points * counts, values[:, 3:]), axis=1))
        starts = np.searchsorted(moved_keys[order], unique_keys)
        sums[:, 7] = np.maximum.reduceat(values[order, 7], starts)  # one view may have shown both voxels
        return unique_keys, sums
