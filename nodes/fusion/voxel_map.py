"""The world's point cloud as an incremental voxel map, and the free space that rays have passed through.

Both are voxel layers and cost O(new points) a keyframe.
Source: paper, "Method" (the cloud P accumulated from posed RGB-D). Not as in the paper: it grows keyframe by keyframe,
not at the end, and voxels that are seen through again and again are removed.
"""

from __future__ import annotations

import cv2
import numpy as np

from placegraph.nodes.fusion.visibility import DepthVisibility
from placegraph.nodes.fusion.voxel_index import sum_by_key, voxel_centers, voxel_corners, voxel_keys
from placegraph.nodes.fusion.voxel_layer import VoxelLayer, with_capacity
from placegraph.runtime.arrays import F32, F64, I32, I64, U8, Bool, Points
from placegraph.runtime.vision.geometry import transform

_STEPS = 1024  # a position within a voxel is rounded to this part of its edge before it is summed: .05 mm of 5 cm


def depth_edges(depth_m: F32, ratio: float = 0.05) -> Bool:
    """Pixels beside a depth jump, where sensors invent points between the two surfaces ("flying pixels").

    depth_m: (H, W) metres, 0 = no reading. A pixel is an edge when readings in its 3x3 neighbourhood differ by more
    than `ratio` of the nearest one; .05 keeps floors seen at a grazing angle up to 5 m. Returns (H, W) bool.
    """
    kernel = np.ones((3, 3), np.uint8)
    nearest = cv2.erode(np.where(depth_m > 0, depth_m, np.float32(np.inf)), kernel)
    farthest = cv2.dilate(depth_m, kernel)
    return np.asarray((farthest - nearest > ratio * nearest) & (depth_m > 0))


class VoxelMap(VoxelLayer):
    """Voxels of the world's cloud: sums of positions within the voxel and of colours (sRGB), and counts of points."""

    def __init__(self, voxel_m: float, keep_submaps: bool = False) -> None:
        super().__init__(np.full(3, voxel_m), 7, keep_submaps)
        self.voxel_m = voxel_m
        self._xyz: F32 = np.zeros((1024, 3), np.float32)  # what `points` returns
        self._rgb: U8 = np.zeros((1024, 3), np.uint8)
        self._seen_through = np.zeros(1024, np.uint8)  # keyframes that saw through a voxel, less those that saw it

    def integrate(self, xyz_world: Points, colors: U8, submap: int = 0) -> None:
        """Add points (N, 3) in metres with colours (N, 3). Raises SchemaError for points that are not finite."""
        keys = voxel_keys(xyz_world, self.voxel_m)
        within = np.asarray(xyz_world, float) / self.voxel_m - voxel_corners(keys)  # 0..1
        steps = np.rint(within * _STEPS).astype(np.int32)
        ones = np.ones((len(keys), 1), np.int32)
        self.add(*sum_by_key(keys, np.concatenate((steps, colors.astype(np.int32), ones), axis=1)), submap)

    def remove_seen_through(self, visibility: DepthVisibility) -> None:
        """Remove the voxels that `config.views` more keyframes have seen through than seen."""
        rows = np.asarray(visibility.rows_in_view(self.index), np.int64)
        rows = rows[self.sums[rows, -1] > 0]
        seen_through, seen = visibility.classify(self._xyz[rows])
        self._seen_through[rows[seen_through]] += 1
        self._seen_through[rows[seen & (self._seen_through[rows] > 0)]] -= 1
        self.remove(rows[self._seen_through[rows] >= visibility.config.views])

    def remove(self, rows: I64) -> None:
        """Empty voxels; seen again, they start anew."""
        super().remove(rows)
        self._seen_through[rows] = 0

    def points(self) -> F32:
        """Centroids (P, 3), metres, world frame, oldest voxel first."""
        return self._xyz[self.occupied_rows()]

    def colors(self) -> U8:
        """Mean colours (P, 3) in the order of `points`."""
        return self._rgb[self.occupied_rows()]

    def resample(self, keys: I64, sums: I32, world_from_fused: F64) -> tuple[I64, I32]:
        """All points of a voxel move as its centroid does."""
        counts = sums[:, 6:]
        moved = transform(world_from_fused, self._centroids(keys, sums)) / self.voxel_m
        moved_keys = voxel_keys(moved, 1.0)
        steps = np.rint((moved - voxel_corners(moved_keys)) * _STEPS).astype(np.int32)
        return moved_keys, np.concatenate((steps * counts, sums[:, 3:]), axis=1)

    def update_rows(self, rows: I64) -> None:
        """Keep positions and colours up to date, so that making a Map only copies them."""
        rows = rows[self.sums[rows, 6] > 0]
        sums = self.sums[rows]
        self._xyz[rows] = self._centroids(self.keys[rows], sums)
        self._rgb[rows] = np.rint(sums[:, 3:6] / sums[:, 6:])

    def reserve(self, size: int) -> None:
        """Make room for `size` rows."""
        super().reserve(size)
        self._xyz, self._rgb = with_capacity(self._xyz, size), with_capacity(self._rgb, size)
        self._seen_through = with_capacity(self._seen_through, size)

    def _centroids(self, keys: I64, sums: I32) -> F64:
        return np.asarray((voxel_corners(keys) + sums[:, :3] / sums[:, 6:] / _STEPS) * self.voxel_m)


# Four points of a cell, in shares of its size. A moved cell marks the cells that hold two of them, so that free space
# neither grows nor shrinks.
_SAMPLES = np.array([(x, y, 0.0) for x in (-0.25, 0.25) for y in (-0.25, 0.25)])


class FreeSpace(VoxelLayer):
    """Cells that a ray crossed on its way to a surface: fine in plan, coarse in height."""

    def __init__(self, cell_m: float, height_m: float, clearance_m: float, keep_submaps: bool = False) -> None:
        super().__init__(np.array([cell_m, cell_m, height_m]), 1, keep_submaps)
        self._clearance_m = clearance_m

    def carve(self, origin_world: F64, ends_world: Points, submap: int = 0) -> None:
        """Mark the cells between a camera (3,) and surface points (N, 3), short of the surface by the clearance.

        Only one ray is followed to each cell of end points, so that a near wall costs no more than a far one.
        """
        if not len(ends_world):
            return
        _, first = np.unique(voxel_keys(ends_world, self.cell_m), return_index=True)
        rays = np.asarray(ends_world, float)[first] - origin_world
        lengths = np.linalg.norm(rays, axis=1)
        step = self.cell_m[0]
        counts = np.ceil(np.clip(lengths - self._clearance_m, 0, None) / step).astype(np.int64)
        if not counts.any():
            return
        ray = np.repeat(np.arange(len(rays)), counts)
        nth = np.arange(len(ray)) - np.repeat(np.cumsum(counts) - counts, counts)
        along = np.minimum((nth + 0.5) * step, lengths[ray] - self._clearance_m) / lengths[ray]
        keys = np.unique(voxel_keys(origin_world + rays[ray] * along[:, None], self.cell_m))
        self.add(keys, np.ones((len(keys), 1), np.int32), submap)

    def points(self) -> F32:
        """Centres (F, 3) of the cells, metres, world frame, oldest cell first."""
        return voxel_centers(self.keys[self.occupied_rows()], self.cell_m).astype(np.float32)

    def resample(self, keys: I64, sums: I32, world_from_fused: F64) -> tuple[I64, I32]:
        """A moved cell marks those that hold at least two of its four samples."""
        samples = (voxel_centers(keys, self.cell_m)[:, None] + _SAMPLES * self.cell_m).reshape(-1, 3)
        sample_keys = voxel_keys(transform(world_from_fused, samples), self.cell_m)
        cells, hits = sum_by_key(sample_keys, np.ones((len(sample_keys), 1), np.int32))
        kept = hits[:, 0] >= 2
        return cells[kept], np.ones((int(kept.sum()), 1), np.int32)
