"""A layer of the map: whole numbers summed by cell, kept by submap as well where the map may have to move.

Sums of whole numbers are exact, so what a submap gave can be taken away and given again elsewhere without a trace, and
the order of additions does not matter.
Source: re-integration of submaps after loop closure as in Voxgraph and Cartographer. Departs: cells are moved as
points, not as distances, and a cell keeps the contributions of a few submaps only, which bounds the memory by the map's
size.
"""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from placegraph.nodes.fusion.voxel_index import CellIndex, block_of, sum_by_key
from placegraph.runtime.arrays import F64, I32, I64

D = TypeVar("D", bound=np.generic)

MAX_SUBMAPS = 4  # departs: that one cell takes from; more views of it say nothing new
MAX_COUNTED = 1 << 20  # where nothing is kept by submap: 32 bits hold the sums of so many points


class _Part:
    """What one submap gave: by keyframe while it is open, then summed; cells as they were when they were fused."""

    def __init__(self) -> None:
        self.pieces: list[tuple[I64, I32]] = []
        self.world_from_fused: F64 = np.eye(4)

    @property
    def is_moved(self) -> bool:
        """Whether it lies elsewhere than where it was fused."""
        return not np.array_equal(self.world_from_fused, np.eye(4))

    def sums(self) -> tuple[I64, I32]:
        """All pieces as one: sorted keys (N,) and sums (N, D)."""
        if len(self.pieces) > 1:
            keys, values = (np.concatenate(column) for column in zip(*self.pieces, strict=True))
            self.pieces = [sum_by_key(keys, values)]
        return self.pieces[0]


class Layer:
    """Sums (D,) of whole numbers by cell; the last one counts, and a cell where it is 0 is not there.

    keep: also by submap, so that `move` is possible.
    """

    def __init__(self, cell_m: F64, columns: int, keep: bool) -> None:
        self.cell_m = cell_m
        self.keep = keep
        self.index = CellIndex(cell_m)
        self.keys: I64 = np.zeros(1024, np.int64)
        self.sums: I32 = np.zeros((1024, columns), np.int32)
        self._holders = np.zeros(1024, np.uint8)  # how many submaps a cell takes from
        self._newest = np.full(1024, -1, np.int32)  # the last submap that was added to it
        self._parts: dict[int, _Part] = {}
        self._submaps_of_block: dict[int, set[int]] = {}  # which closed ones may hold cells there
        self._gone: list[I64] = []  # cells removed, of which closed submaps do not know yet
        self._open = -1

    def __len__(self) -> int:
        return len(self.live())

    def live(self) -> I64:
        """Rows of the cells that are there, oldest first."""
        return np.flatnonzero(self.sums[: len(self.index), -1] > 0)

    def add(self, keys: I64, sums: I32, submap: int) -> None:
        """Add sums (N, D) to sorted unique cells (N,) on behalf of a submap; submaps come in order."""
        rows = self._rows(keys)
        if not self.keep:
            taken = self.sums[rows, -1] < MAX_COUNTED
            self._sum(rows[taken], sums[taken])
            return
        if submap != self._open:
            self.close()
            self._open = submap
        mine = self._newest[rows] == submap
        taken = mine | (self._holders[rows] < MAX_SUBMAPS)
        self._holders[rows[taken & ~mine]] += 1
        self._newest[rows[taken]] = submap
        if taken.any():
            self._parts.setdefault(submap, _Part()).pieces.append((keys[taken], sums[taken]))
        self._sum(rows[taken], sums[taken])

    def close(self) -> None:
        """Sum up what the open submap gave, and let the others know which cells have gone."""
        closed = self._open
        self._open = -1
        self._drop_gone(closed)
        if closed in self._parts:
            self._note_blocks(closed, self._parts[closed].sums()[0])

    def remove(self, rows: I64) -> None:
        """Take cells out of the map, whoever gave them."""
        keys = np.sort(self.keys[rows])
        self.sums[rows], self._holders[rows], self._newest[rows] = 0, 0, -1
        if not self.keep or not len(rows):
            return
        self._gone.append(keys)
        if self._open in self._parts:  # what it gives to these cells from now on is new
            part = self._parts[self._open]
            part.pieces = [(k[kept], v[kept]) for k, v in part.pieces for kept in [~np.isin(k, keys)]]

    def move(self, submap: int, world_from_fused: F64) -> None:
        """Take away what a submap gave and give it where it lies now, turned and shifted by a rigid (4, 4)."""
        self.close()
        if submap not in self._parts:
            return
        part = self._parts[submap]
        self._give(part, -1)
        part.world_from_fused = world_from_fused
        self._note_blocks(submap, self._give(part, 1))

    def place(self, keys: I64, sums: I32, world_from_fused: F64) -> tuple[I64, I32]:
        """Where fused cells (N,) lie now and what they hold there; several may lie in one. Defined by each layer."""
        raise NotImplementedError

    def changed(self, rows: I64) -> None:
        """Called after the sums of these rows have changed."""

    def grow(self, size: int) -> None:
        """Make room for so many rows."""
        for name, fill in (("keys", 0), ("sums", 0), ("_holders", 0), ("_newest", -1)):
            setattr(self, name, grown(getattr(self, name), size, fill))

    def _placed(self, part: _Part) -> tuple[I64, I32]:
        return self.place(*part.sums(), part.world_from_fused) if part.is_moved else part.sums()

    def _give(self, part: _Part, sign: int) -> I64:
        keys, sums = sum_by_key(*self._placed(part))
        rows = self._rows(keys)
        self._holders[rows] = np.clip(self._holders[rows].astype(int) + sign, 0, 255)
        self._newest[rows] = -1
        self._sum(rows, sign * sums)
        return keys

    def _drop_gone(self, but: int) -> None:
        if not self._gone:
            return
        gone = np.unique(np.concatenate(self._gone))
        self._gone = []
        blocks = np.unique(block_of(gone)).tolist()
        near = set[int]().union(*(self._submaps_of_block.get(block, set()) for block in blocks))
        for submap in sorted(near - {but}):
            part = self._parts[submap]
            keys, sums = part.sums()
            kept = ~np.isin(self._placed(part)[0], gone)
            part.pieces = [(keys[kept], sums[kept])]
            if not kept.any():
                self._forget(submap)

    def _forget(self, submap: int) -> None:
        del self._parts[submap]
        for submaps in self._submaps_of_block.values():
            submaps.discard(submap)

    def _note_blocks(self, submap: int, keys: I64) -> None:
        for block in np.unique(block_of(keys)).tolist():
            self._submaps_of_block.setdefault(block, set()).add(submap)

    def _sum(self, rows: I32, sums: I32) -> None:
        self.sums[rows] += sums
        self.changed(np.asarray(rows, np.int64))

    def _rows(self, keys: I64) -> I32:
        known = len(self.index)
        rows = self.index.rows(keys)
        if len(self.index) > len(self.keys):
            self.grow(max(len(self.index), 2 * len(self.keys)))
        new = rows >= known
        self.keys[rows[new]] = keys[new]
        return rows


def grown(array: NDArray[D], size: int, fill: int = 0) -> NDArray[D]:
    """The array with more rows, filled with `fill`."""
    larger = np.full((size, *array.shape[1:]), fill, array.dtype)
    larger[: len(array)] = array
    return larger
