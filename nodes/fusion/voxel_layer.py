"""Integer sums by voxel, kept by submap as well where the map may have to move after a loop closure.

Sums of integers are exact: what a submap added can be subtracted and added elsewhere without a trace, and the order of
additions does not matter. A voxel keeps the contributions of a few submaps only, which bounds memory by the size of the
map.
"""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from placegraph.nodes.fusion.submap_voxels import SubmapVoxels
from placegraph.nodes.fusion.voxel_index import VoxelIndex, block_keys, sum_by_key
from placegraph.runtime.arrays import F64, I32, I64

D = TypeVar("D", bound=np.generic)

MAX_SUBMAPS_PER_VOXEL = 4  # chosen by hand: more views of a voxel hardly change its mean
MAX_POINTS_PER_VOXEL = 1 << 20  # where nothing is kept by submap: 32 bits hold the sums of so many points


class VoxelLayer:
    """Integer sums (D,) by voxel. The last one is a count; a voxel whose count is 0 is empty.

    keep_submaps: keep the sums by submap as well, which `move_submap` needs.
    """

    def __init__(self, cell_m: F64, columns: int, keep_submaps: bool) -> None:
        self.cell_m = cell_m
        self.keep_submaps = keep_submaps
        self.index = VoxelIndex(cell_m)
        self.keys: I64 = np.zeros(1024, np.int64)
        self.sums: I32 = np.zeros((1024, columns), np.int32)
        self._submap_counts = np.zeros(1024, np.uint8)  # how many submaps contribute to a voxel
        self._latest_submap = np.full(1024, -1, np.int32)  # the last one that contributed
        self._by_submap: dict[int, SubmapVoxels[np.int32]] = {}
        self._submaps_of_block: dict[int, set[int]] = {}  # closed submaps that may have voxels in a block
        self._removed_keys: list[I64] = []  # removed voxels that closed submaps still hold
        self._open_submap = -1

    def __len__(self) -> int:
        return len(self.occupied_rows())

    def occupied_rows(self) -> I64:
        """Rows of the voxels that are not empty, oldest first."""
        return np.flatnonzero(self.sums[: len(self.index), -1] > 0)

    def add(self, keys: I64, sums: I32, submap: int) -> None:
        """Add sums (N, D) to sorted unique voxels (N,) on behalf of a submap; submaps come in order."""
        rows = self._rows(keys)
        if not self.keep_submaps:
            accepted = self.sums[rows, -1] < MAX_POINTS_PER_VOXEL
            self._add_sums(rows[accepted], sums[accepted])
            return
        if submap != self._open_submap:
            self.close_submap()
            self._open_submap = submap
        contributed = self._latest_submap[rows] == submap
        accepted = contributed | (self._submap_counts[rows] < MAX_SUBMAPS_PER_VOXEL)
        self._submap_counts[rows[accepted & ~contributed]] += 1
        self._latest_submap[rows[accepted]] = submap
        if accepted.any():
            self._by_submap.setdefault(submap, SubmapVoxels()).add(keys[accepted], sums[accepted])
        self._add_sums(rows[accepted], sums[accepted])

    def close_submap(self) -> None:
        """Join what the open submap added, and drop removed voxels from the submaps before it."""
        closed = self._open_submap
        self._open_submap = -1
        self._drop_removed(closed)
        if closed in self._by_submap:
            self._index_blocks(closed, self._by_submap[closed].fused()[0])

    def remove(self, rows: I64) -> None:
        """Empty voxels, whichever submaps contributed to them."""
        keys = np.sort(self.keys[rows])
        self.sums[rows], self._submap_counts[rows], self._latest_submap[rows] = 0, 0, -1
        if not self.keep_submaps or not len(rows):
            return
        self._removed_keys.append(keys)
        if self._open_submap in self._by_submap:  # what it adds to these voxels from now on is new
            self._by_submap[self._open_submap].discard(keys, self.resample)

    def move_submap(self, submap: int, world_from_fused: F64) -> None:
        """Subtract what a submap added and add it where a rigid transform (4, 4) puts it now."""
        self.close_submap()
        if submap not in self._by_submap:
            return
        voxels = self._by_submap[submap]
        self._add_submap(voxels, -1)
        voxels.world_from_fused = world_from_fused
        self._index_blocks(submap, self._add_submap(voxels, 1))

    def resample(self, keys: I64, sums: I32, world_from_fused: F64) -> tuple[I64, I32]:
        """Voxels (N,) and their sums after a rigid transform; keys may repeat. Each kind of layer defines it."""
        raise NotImplementedError

    def update_rows(self, rows: I64) -> None:
        """Called after the sums of these rows have changed."""

    def reserve(self, size: int) -> None:
        """Make room for `size` rows."""
        for name, fill in (("keys", 0), ("sums", 0), ("_submap_counts", 0), ("_latest_submap", -1)):
            setattr(self, name, with_capacity(getattr(self, name), size, fill))

    def _add_submap(self, voxels: SubmapVoxels[np.int32], sign: int) -> I64:
        keys, sums = sum_by_key(*voxels.placed(self.resample))
        rows = self._rows(keys)
        self._submap_counts[rows] = np.clip(self._submap_counts[rows].astype(int) + sign, 0, 255)
        self._latest_submap[rows] = -1
        self._add_sums(rows, sign * sums)
        return keys

    def _drop_removed(self, except_submap: int) -> None:
        if not self._removed_keys:
            return
        removed = np.unique(np.concatenate(self._removed_keys))
        self._removed_keys = []
        blocks = np.unique(block_keys(removed)).tolist()
        affected = set[int]().union(*(self._submaps_of_block.get(block, set()) for block in blocks))
        for submap in sorted(affected - {except_submap}):
            if not self._by_submap[submap].discard(removed, self.resample):
                del self._by_submap[submap]
                for submaps in self._submaps_of_block.values():
                    submaps.discard(submap)

    def _index_blocks(self, submap: int, keys: I64) -> None:
        for block in np.unique(block_keys(keys)).tolist():
            self._submaps_of_block.setdefault(block, set()).add(submap)

    def _add_sums(self, rows: I32, sums: I32) -> None:
        self.sums[rows] += sums
        self.update_rows(np.asarray(rows, np.int64))

    def _rows(self, keys: I64) -> I32:
        known_count = len(self.index)
        rows = self.index.rows(keys)
        if len(self.index) > len(self.keys):
            self.reserve(max(len(self.index), 2 * len(self.keys)))
        new = rows >= known_count
        self.keys[rows[new]] = keys[new]
        return rows


def with_capacity(array: NDArray[D], size: int, fill: int = 0) -> NDArray[D]:
    """The array with more rows, the new ones filled with `fill`."""
    larger = np.full((size, *array.shape[1:]), fill, array.dtype)
    larger[: len(array)] = array
    return larger
