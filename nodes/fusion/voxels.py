"""The world's cloud as an incremental voxel map, and the space that rays have passed through.

Both are keyed by packed cell indices and cost O(new points) a frame.
Source: paper, "Method" (the cloud P accumulated from posed RGB-D). Departs: accumulated frame by frame, not at the end.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from placegraph.runtime.errors import SchemaError

Bool = NDArray[np.bool_]
F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
I64 = NDArray[np.int64]
U8 = NDArray[np.uint8]
Points = NDArray[np.floating]

_BITS = 21  # a cell index of each axis; three fit an int64
_HALF = 1 << (_BITS - 1)


def pack(xyz: Points, cell_m: Points | float) -> I64:
    """(N, 3) metres to one int64 per point that names its cell of size `cell_m` (a number, or one per axis).

    Raises SchemaError for points that are not finite or lie further out than 2**20 cells.
    """
    cells = np.floor(np.asarray(xyz, float) / cell_m)
    if not (np.abs(cells) < _HALF).all():  # also false for NaN
        raise SchemaError(f"a point of the map is not finite or more than {_HALF} cells of {cell_m} m from the origin")
    x, y, z = (cells.astype(np.int64) + _HALF).T
    return np.asarray((x << (2 * _BITS)) | (y << _BITS) | z)


def unpack(keys: I64, cell_m: Points | float) -> F64:
    """Centres (N, 3) in metres of packed cells."""
    mask = (1 << _BITS) - 1
    cells = np.stack((keys >> (2 * _BITS), (keys >> _BITS) & mask, keys & mask), axis=1) - _HALF
    return np.asarray((cells + 0.5) * cell_m)


def sum_by_key(keys: I64, values: F64) -> tuple[I64, F64]:
    """Add up the rows of values (N, D) that share a key: (sorted unique keys (M,), sums (M, D))."""
    if not len(keys):
        return keys, values
    order = np.argsort(keys, kind="stable")
    ordered = keys[order]
    starts = np.flatnonzero(np.r_[True, ordered[1:] != ordered[:-1]])
    return ordered[starts], np.add.reduceat(values[order], starts, axis=0)


def depth_edges(depth_m: F32, ratio: float = 0.05) -> Bool:
    """Pixels beside a depth jump, where sensors invent points between the two surfaces ("flying pixels").

    depth_m: (H, W) metres, 0 = no reading. A pixel is an edge when readings of its 3x3 neighbourhood differ by more
    than `ratio` of the nearest one (departs: .05 keeps floors seen at a grazing angle up to 5 m). Returns (H, W) bool.
    """
    kernel = np.ones((3, 3), np.uint8)
    nearest = cv2.erode(np.where(depth_m > 0, depth_m, np.float32(np.inf)), kernel)
    farthest = cv2.dilate(depth_m, kernel)
    return np.asarray((farthest - nearest > ratio * nearest) & (depth_m > 0))


class VoxelMap:
    """Voxels of the world's cloud: sums of positions (m, world), colours (sRGB) and counts."""

    def __init__(self, voxel_m: float) -> None:
        self.voxel_m = voxel_m
        self._rows: dict[int, int] = {}
        self._sums = np.zeros((1024, 7))

    def __len__(self) -> int:
        return len(self._rows)

    def add(self, xyz_world: Points, colors: U8) -> None:
        """Add points (N, 3) in metres with colours (N, 3). Raises SchemaError for points that are not finite."""
        values = np.concatenate((xyz_world, colors, np.ones((len(xyz_world), 1))), axis=1).astype(float)
        keys, sums = sum_by_key(pack(xyz_world, self.voxel_m), values)
        rows = np.array([self._rows.setdefault(key, len(self._rows)) for key in keys.tolist()], np.int64)
        if len(self._rows) > len(self._sums):
            grown = np.zeros((max(len(self._rows), 2 * len(self._sums)), 7))
            grown[: len(self._sums)] = self._sums
            self._sums = grown
        self._sums[rows] += sums

    def points(self) -> F32:
        """Centroids (P, 3), metres, world frame, oldest voxel first."""
        sums = self._sums[: len(self)]
        return np.asarray(sums[:, :3] / sums[:, 6:], np.float32)

    def colors(self) -> U8:
        """Mean colours (P, 3) in the order of `points`."""
        sums = self._sums[: len(self)]
        return np.asarray(np.rint(sums[:, 3:6] / sums[:, 6:]), np.uint8)


class FreeSpace:
    """Cells that a ray crossed on its way to a surface: fine in plan, coarse in height."""

    def __init__(self, cell_m: float, height_m: float, clearance_m: float) -> None:
        self.cell = np.array([cell_m, cell_m, height_m])
        self._clearance_m = clearance_m
        self._keys: set[int] = set()

    def __len__(self) -> int:
        return len(self._keys)

    def carve(self, origin_world: F64, ends_world: Points) -> None:
        """Mark the cells between a camera (3,) and surface points (N, 3), short of the surface by the clearance.

        Only one ray is followed to each cell of end points, so that a near wall costs no more than a far one.
        """
        if not len(ends_world):
            return
        _, first = np.unique(pack(ends_world, self.cell), return_index=True)
        rays = np.asarray(ends_world, float)[first] - origin_world
        lengths = np.linalg.norm(rays, axis=1)
        step = self.cell[0]
        counts = np.ceil(np.clip(lengths - self._clearance_m, 0, None) / step).astype(np.int64)
        if not counts.any():
            return
        ray = np.repeat(np.arange(len(rays)), counts)
        nth = np.arange(len(ray)) - np.repeat(np.cumsum(counts) - counts, counts)
        along = np.minimum((nth + 0.5) * step, lengths[ray] - self._clearance_m) / lengths[ray]
        self._keys.update(np.unique(pack(origin_world + rays[ray] * along[:, None], self.cell)).tolist())

    def points(self) -> F32:
        """Centres (F, 3) of the cells, metres, world frame, in a fixed order."""
        keys = np.sort(np.fromiter(self._keys, np.int64, len(self._keys)))
        return unpack(keys, self.cell).astype(np.float32)
