"""The world's cloud as an incremental voxel map, and the space that rays have passed through.

Both are layers of cells and cost O(new points) a frame.
Source: paper, "Method" (the cloud P accumulated from posed RGB-D). Departs: accumulated frame by frame, not at the end;
what is seen through again and again goes.
"""

from __future__ import annotations

import cv2
import numpy as np

from placegraph.nodes.fusion.visibility import Sight
from placegraph.nodes.fusion.voxel_index import corners, pack, sum_by_key, unpack
from placegraph.nodes.fusion.voxel_layer import Layer, grown
from placegraph.runtime.arrays import F32, F64, I32, I64, U8, Bool, Points
from placegraph.runtime.vision.geometry import transform

_STEPS = 1024  # of a voxel's edge to which a point is rounded before it is summed: .05 mm of 5 cm


def depth_edges(depth_m: F32, ratio: float = 0.05) -> Bool:
    """Pixels beside a depth jump, where sensors invent points between the two surfaces ("flying pixels").

    depth_m: (H, W) metres, 0 = no reading. A pixel is an edge when readings of its 3x3 neighbourhood differ by more
    than `ratio` of the nearest one (departs: .05 keeps floors seen at a grazing angle up to 5 m). Returns (H, W) bool.
    """
    kernel = np.ones((3, 3), np.uint8)
    nearest = cv2.erode(np.where(depth_m > 0, depth_m, np.float32(np.inf)), kernel)
    farthest = cv2.dilate(depth_m, kernel)
    return np.asarray((farthest - nearest > ratio * nearest) & (depth_m > 0))


class VoxelMap(Layer):
    """Voxels of the world's cloud: sums of positions within the voxel, of colours (sRGB), and counts of points."""

    def __init__(self, voxel_m: float, keep: bool = False) -> None:
        super().__init__(np.full(3, voxel_m), 7, keep)
        self.voxel_m = voxel_m
        self._xyz: F32 = np.zeros((1024, 3), np.float32)  # as `points` gives them
        self._rgb: U8 = np.zeros((1024, 3), np.uint8)
        self._seen_through = np.zeros(1024, np.uint8)  # keyframes, less those that saw it

    def fuse(self, xyz_world: Points, colors: U8, submap: int = 0) -> None:
        """Add points (N, 3) in metres with colours (N, 3). Raises SchemaError for points that are not finite."""
        keys = pack(xyz_world, self.voxel_m)
        within = np.asarray(xyz_world, float) / self.voxel_m - corners(keys)  # 0..1
        steps = np.rint(within * _STEPS).astype(np.int32)
        ones = np.ones((len(keys), 1), np.int32)
        self.add(*sum_by_key(keys, np.concatenate((steps, colors.astype(np.int32), ones), axis=1)), submap)

    def look(self, sight: Sight) -> None:
        """Remove what so many keyframes more have seen through than seen."""
        rows = np.asarray(sight.rows_in_view(self.index), np.int64)
        rows = rows[self.sums[rows, -1] > 0]
        through, there = sight.judge(self._xyz[rows])
        self._seen_through[rows[through]] += 1
        self._seen_through[rows[there & (self._seen_through[rows] > 0)]] -= 1
        self.remove(rows[self._seen_through[rows] >= sight.config.views])

    def remove(self, rows: I64) -> None:
        """Take voxels out of the map; seen again, they start anew."""
        super().remove(rows)
        self._seen_through[rows] = 0

    def points(self) -> F32:
        """Centroids (P, 3), metres, world frame, oldest voxel first."""
        return self._xyz[self.live()]

    def colors(self) -> U8:
        """Mean colours (P, 3) in the order of `points`."""
        return self._rgb[self.live()]

    def place(self, keys: I64, sums: I32, world_from_fused: F64) -> tuple[I64, I32]:
        """Each voxel's points go where its centroid goes."""
        counts = sums[:, 6:]
        moved = transform(world_from_fused, self._centroids(keys, sums)) / self.voxel_m
        cells = pack(moved, 1.0)
        steps = np.rint((moved - corners(cells)) * _STEPS).astype(np.int32)
        return cells, np.concatenate((steps * counts, sums[:, 3:]), axis=1)

    def changed(self, rows: I64) -> None:
        """Keep positions and colours ready, so that giving the map copies them and computes nothing."""
        rows = rows[self.sums[rows, 6] > 0]
        sums = self.sums[rows]
        self._xyz[rows] = self._centroids(self.keys[rows], sums)
        self._rgb[rows] = np.rint(sums[:, 3:6] / sums[:, 6:])

    def grow(self, size: int) -> None:
        """Make room for so many rows."""
        super().grow(size)
        self._xyz, self._rgb = grown(self._xyz, size), grown(self._rgb, size)
        self._seen_through = grown(self._seen_through, size)

    def _centroids(self, keys: I64, sums: I32) -> F64:
        return np.asarray((corners(keys) + sums[:, :3] / sums[:, 6:] / _STEPS) * self.voxel_m)


# a cell that has moved is there where two of these points of it lie, in shares of a cell: it neither grows nor shrinks
_SAMPLES = np.array([(x, y, 0.0) for x in (-0.25, 0.25) for y in (-0.25, 0.25)])


class FreeSpace(Layer):
    """Cells that a ray crossed on its way to a surface: fine in plan, coarse in height."""

    def __init__(self, cell_m: float, height_m: float, clearance_m: float, keep: bool = False) -> None:
        super().__init__(np.array([cell_m, cell_m, height_m]), 1, keep)
        self._clearance_m = clearance_m

    def carve(self, origin_world: F64, ends_world: Points, submap: int = 0) -> None:
        """Mark the cells between a camera (3,) and surface points (N, 3), short of the surface by the clearance.

        Only one ray is followed to each cell of end points, so that a near wall costs no more than a far one.
        """
        if not len(ends_world):
            return
        _, first = np.unique(pack(ends_world, self.cell_m), return_index=True)
        rays = np.asarray(ends_world, float)[first] - origin_world
        lengths = np.linalg.norm(rays, axis=1)
        step = self.cell_m[0]
        counts = np.ceil(np.clip(lengths - self._clearance_m, 0, None) / step).astype(np.int64)
        if not counts.any():
            return
        ray = np.repeat(np.arange(len(rays)), counts)
        nth = np.arange(len(ray)) - np.repeat(np.cumsum(counts) - counts, counts)
        along = np.minimum((nth + 0.5) * step, lengths[ray] - self._clearance_m) / lengths[ray]
        keys = np.unique(pack(origin_world + rays[ray] * along[:, None], self.cell_m))
        self.add(keys, np.ones((len(keys), 1), np.int32), submap)

    def points(self) -> F32:
        """Centres (F, 3) of the cells, metres, world frame, oldest cell first."""
        return unpack(self.keys[self.live()], self.cell_m).astype(np.float32)

    def place(self, keys: I64, sums: I32, world_from_fused: F64) -> tuple[I64, I32]:
        """A cell becomes those that hold two of its four quarters, its own or its neighbours'."""
        quarters = (unpack(keys, self.cell_m)[:, None] + _SAMPLES * self.cell_m).reshape(-1, 3)
        cells = pack(transform(world_from_fused, quarters), self.cell_m)
        found, hits = sum_by_key(cells, np.ones((len(cells), 1), np.int32))
        kept = hits[:, 0] >= 2
        return found[kept], np.ones((int(kept.sum()), 1), np.int32)
