"""Voxel keys (one integer for each voxel of space) and an index from keys to rows whose cost follows the view."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from placegraph.runtime.arrays import F64, I32, I64, Bool, Points
from placegraph.runtime.errors import SchemaError

D = TypeVar("D", bound=np.generic)

_BITS = 21  # for the voxel index along each axis; three of them fit an int64
_AXIS_OFFSET = 1 << (_BITS - 1)
_AXIS_MASK = (1 << _BITS) - 1
_BLOCK = 32  # voxels along each side of a block: a camera's view of a room touches about fifty blocks
_IN_BLOCK = _BLOCK - 1
_BLOCK_MASK = ~((_IN_BLOCK << (2 * _BITS)) | (_IN_BLOCK << _BITS) | _IN_BLOCK)  # the part of a key that names the block


def voxel_keys(xyz: Points, cell_m: Points | float) -> I64:
    """Keys (N,) of the voxels that hold points (N, 3) in metres; `cell_m`: one size, or one for each axis.

    Raises SchemaError for points that are not finite or more than 2**20 voxels from the origin.
    """
    cells = np.floor(np.asarray(xyz, float) / cell_m)
    if not (np.abs(cells) < _AXIS_OFFSET).all():  # also false for NaN
        raise SchemaError(
            f"a point of the map is not finite or more than {_AXIS_OFFSET} cells of {cell_m} m from the origin"
        )
    return _pack(cells.astype(np.int64))


def _pack(cells: I64) -> I64:
    x, y, z = (cells + _AXIS_OFFSET).T
    return np.asarray((x << (2 * _BITS)) | (y << _BITS) | z)


def voxel_corners(keys: I64) -> I64:
    """Lowest corners (N, 3) of voxels, in whole voxels."""
    return np.stack((keys >> (2 * _BITS), (keys >> _BITS) & _AXIS_MASK, keys & _AXIS_MASK), axis=1) - _AXIS_OFFSET


def voxel_centers(keys: I64, cell_m: Points | float) -> F64:
    """Centres (N, 3) of voxels in metres."""
    return np.asarray((voxel_corners(keys) + 0.5) * cell_m)


def sum_by_key(keys: I64, values: NDArray[D]) -> tuple[I64, NDArray[D]]:
    """Sums of the rows of values (N, D) that share a key: sorted unique keys (M,) and sums (M, D)."""
    if not len(keys):
        return keys, values
    order = np.argsort(keys, kind="stable")
    ordered = keys[order]
    starts = np.flatnonzero(np.r_[True, ordered[1:] != ordered[:-1]])
    return ordered[starts], np.add.reduceat(values[order], starts, axis=0)


def block_keys(keys: I64) -> I64:
    """For each voxel key (N,) the key of its block of 32 x 32 x 32 voxels."""
    return keys & _BLOCK_MASK


class VoxelIndex:
    """Maps voxel keys to rows, numbered from 0 in the order in which voxels first came.

    Keys are sorted within blocks. A lookup costs what the touched blocks hold, however large the map is; memory is
    12 bytes a voxel.
    """

    def __init__(self, cell_m: F64) -> None:
        self._block_m = cell_m * _BLOCK
        self._blocks: dict[int, tuple[I64, I32]] = {}  # sorted keys and their rows
        self._count = 0

    def __len__(self) -> int:
        return self._count

    def rows(self, keys: I64) -> I32:
        """Rows (N,) of sorted unique keys (N,); unknown voxels get new rows."""
        rows = np.empty(len(keys), np.int32)
        if not len(keys):
            return rows
        blocks = block_keys(keys)
        order = np.argsort(blocks, kind="stable")  # keys stay sorted within a block
        ordered = blocks[order]
        starts = np.flatnonzero(np.r_[True, ordered[1:] != ordered[:-1]])
        for start, end in zip(starts.tolist(), [*starts[1:].tolist(), len(keys)], strict=True):
            in_block = order[start:end]
            rows[in_block] = self._rows_of_block(int(ordered[start]), keys[in_block])
        return rows

    def _rows_of_block(self, block: int, keys: I64) -> I32:
        known_keys, known_rows = self._blocks.get(block, (np.zeros(0, np.int64), np.zeros(0, np.int32)))
        at = np.searchsorted(known_keys, keys)
        new = at == len(known_keys)
        new[~new] = known_keys[at[~new]] != keys[~new]
        if new.any():
            new_rows = np.arange(self._count, self._count + int(new.sum()), dtype=np.int32)
            self._count += len(new_rows)
            known_keys = np.insert(known_keys, at[new], keys[new])
            known_rows = np.insert(known_rows, at[new], new_rows)
            self._blocks[block] = known_keys, known_rows
            at = np.searchsorted(known_keys, keys)
        return known_rows[at]

    def rows_near(self, box: Points, in_view: Callable[[F64, float], Bool]) -> I32:
        """Rows of the blocks that reach into a box (2, 3) and are in view, in a fixed order.

        in_view: centres (N, 3) and a radius to a mask (N,) of the spheres that are.
        """
        low, high = np.floor(box / self._block_m).astype(int)
        axes = (np.arange(first, last + 1) for first, last in zip(low, high, strict=True))
        blocks = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        seen = in_view((blocks + 0.5) * self._block_m, float(np.linalg.norm(self._block_m)) / 2)
        keys = _pack(blocks[seen] * _BLOCK).tolist()
        rows = [self._blocks[key][1] for key in keys if key in self._blocks]
        return np.concatenate(rows) if rows else np.zeros(0, np.int32)
