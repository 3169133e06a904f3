"""Cells of space named by packed indices, and an index that finds the row of each, however large the map is."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from placegraph.runtime.arrays import F64, I32, I64, Points
from placegraph.runtime.errors import SchemaError

D = TypeVar("D", bound=np.generic)

_BITS = 21  # a cell index of each axis; three fit an int64
_HALF = 1 << (_BITS - 1)
_ALL = (1 << _BITS) - 1
_BLOCK = 32  # cells of a block along each axis: some fifty blocks in a camera's view of a room
_INSIDE = _BLOCK - 1
_BLOCK_OF = ~((_INSIDE << (2 * _BITS)) | (_INSIDE << _BITS) | _INSIDE)  # what of a key names its block


def pack(xyz: Points, cell_m: Points | float) -> I64:
    """(N, 3) metres to one int64 per point that names its cell of size `cell_m` (a number, or one per axis).

    Raises SchemaError for points that are not finite or lie further out than 2**20 cells.
    """
    cells = np.floor(np.asarray(xyz, float) / cell_m)
    if not (np.abs(cells) < _HALF).all():  # also false for NaN
        raise SchemaError(f"a point of the map is not finite or more than {_HALF} cells of {cell_m} m from the origin")
    x, y, z = (cells.astype(np.int64) + _HALF).T
    return np.asarray((x << (2 * _BITS)) | (y << _BITS) | z)


def corners(keys: I64) -> I64:
    """Whole-numbered low corners (N, 3) of packed cells, in cells."""
    return np.stack((keys >> (2 * _BITS), (keys >> _BITS) & _ALL, keys & _ALL), axis=1) - _HALF


def unpack(keys: I64, cell_m: Points | float) -> F64:
    """Centres (N, 3) in metres of packed cells."""
    return np.asarray((corners(keys) + 0.5) * cell_m)


def sum_by_key(keys: I64, values: NDArray[D]) -> tuple[I64, NDArray[D]]:
    """Add up the rows of values (N, D) that share a key: (sorted unique keys (M,), sums (M, D))."""
    if not len(keys):
        return keys, values
    order = np.argsort(keys, kind="stable")
    ordered = keys[order]
    starts = np.flatnonzero(np.r_[True, ordered[1:] != ordered[:-1]])
    return ordered[starts], np.add.reduceat(values[order], starts, axis=0)


def block_of(keys: I64) -> I64:
    """The names (N,) of the blocks of 32 cells each way in which packed cells lie."""
    return keys & _BLOCK_OF


class CellIndex:
    """Which row belongs to a cell; rows are counted from 0 in the order in which cells first came.

    Cells are kept by blocks of 32 cells each way, sorted within: looking up costs what the blocks in view hold,
    whatever else there is, and 12 bytes a cell.
    """

    def __init__(self, cell_m: F64) -> None:
        self._block_m = cell_m * _BLOCK
        self._blocks: dict[int, tuple[I64, I32]] = {}
        self._count = 0

    def __len__(self) -> int:
        return self._count

    def rows(self, keys: I64) -> I32:
        """The row (N,) of each of the sorted unique keys (N,); unknown cells get new ones."""
        rows = np.empty(len(keys), np.int32)
        if not len(keys):
            return rows
        blocks = block_of(keys)
        order = np.argsort(blocks, kind="stable")  # keys stay sorted within a block
        ordered = blocks[order]
        starts = np.flatnonzero(np.r_[True, ordered[1:] != ordered[:-1]])
        for start, end in zip(starts.tolist(), [*starts[1:].tolist(), len(keys)], strict=True):
            here = order[start:end]
            rows[here] = self._rows_of_block(int(ordered[start]), keys[here])
        return rows

    def _rows_of_block(self, block: int, keys: I64) -> I32:
        known, rows = self._blocks.get(block, (np.zeros(0, np.int64), np.zeros(0, np.int32)))
        at = np.searchsorted(known, keys)
        new = at == len(known)
        new[~new] = known[at[~new]] != keys[~new]
        if new.any():
            fresh = np.arange(self._count, self._count + int(new.sum()), dtype=np.int32)
            self._count += len(fresh)
            known, rows = np.insert(known, at[new], keys[new]), np.insert(rows, at[new], fresh)
            self._blocks[block] = known, rows
            at = np.searchsorted(known, keys)
        return rows[at]

    def near(self, camera_from_world: F64, slopes: tuple[float, float], reach_m: float) -> I32:
        """Rows of the blocks that a camera may see, in a fixed order.

        slopes: of the picture's widest rays, |x| / z and |y| / z; reach_m: how far along z.
        """
        position = -camera_from_world[:3, :3].T @ camera_from_world[:3, 3]
        reach = reach_m * float(np.linalg.norm((1.0, *slopes)))
        low, high = (np.floor((position + sign * reach) / self._block_m).astype(int) for sign in (-1, 1))
        grid = np.stack(np.meshgrid(*(np.arange(a, b + 1) for a, b in zip(low, high, strict=True)), indexing="ij"), -1)
        cells = grid.reshape(-1, 3)
        x, y, z = camera_from_world[:3, :3] @ ((cells + 0.5) * self._block_m).T + camera_from_world[:3, 3:]
        radius = float(np.linalg.norm(self._block_m)) / 2
        seen = (z > -radius) & (z < reach_m + radius)
        for across, slope in ((x, slopes[0]), (y, slopes[1])):
            seen &= np.abs(across) - slope * np.maximum(z, 0) < radius * np.hypot(1, slope)
        x_, y_, z_ = (cells[seen] * _BLOCK + _HALF).T
        names = ((x_ << (2 * _BITS)) | (y_ << _BITS) | z_).tolist()
        found = [self._blocks[name][1] for name in names if name in self._blocks]
        return np.concatenate(found) if found else np.zeros(0, np.int32)
