"""Which points of the map one depth image sees, which it sees through, and which it says nothing about."""

from __future__ import annotations

import cv2
import numpy as np
from pydantic import BaseModel, Field

from placegraph.nodes.fusion.voxel_index import VoxelIndex
from placegraph.runtime.arrays import F32, F64, I32, Bool, Points
from placegraph.runtime.vision.geometry import inverse, transform


class VisibilityConfig(BaseModel, frozen=True, strict=True, extra="forbid"):
    """When a camera sees through a place, and when an object that stood there is absent."""

    margin_m: float = Field(default=0.1, gt=0)  # two voxels of the cloud, for errors of poses
    # Three standard deviations of an OAK-D: .09 px of disparity, focal length 460 px and baseline 7.5 cm give .0026 m
    # at 1 m, growing with the square of the depth.
    margin_per_m2: float = Field(default=0.008, ge=0)
    around_px: int = Field(default=4, ge=0)  # no reading within this many pixels may be closer: keeps thin things
    reach_m: float = Field(default=4.0, gt=0)  # beyond, the margin is larger than a chair
    views: int = Field(default=4, ge=1, le=255)  # keyframes that must see through; two may be taken from one place
    visible_share: float = Field(
        default=0.25, ge=0, le=1
    )  # minimum share of an object's points that a view sees or sees through
    through_share: float = Field(default=0.7, ge=0.5, le=1)  # minimum share of these that it sees through


class DepthVisibility:
    """One keyframe's depth image, ready to classify points."""

    def __init__(
        self, depth_m: F32, edges: Bool, intrinsics: F64, world_from_camera: F64, config: VisibilityConfig
    ) -> None:
        """depth_m: (H, W) metres, 0 = no reading; edges: (H, W), not trusted; intrinsics: (4,) fx fy cx cy in px."""
        self.config = config
        self._depth_m = np.where(edges, np.float32(0), depth_m)
        kernel = np.ones((2 * config.around_px + 1,) * 2, np.uint8)
        self._nearest_m = cv2.erode(np.where(depth_m > 0, depth_m, np.float32(np.inf)), kernel)
        self._intrinsics = intrinsics
        self._camera_from_world = inverse(world_from_camera)
        height, width = depth_m.shape
        fx, fy, cx, cy = intrinsics.tolist()
        self._slopes = max(cx, width - 1 - cx) / fx, max(cy, height - 1 - cy) / fy

    @property
    def box(self) -> F32:
        """(2, 3) metres, world frame: contains everything within reach."""
        position = -self._camera_from_world[:3, :3].T @ self._camera_from_world[:3, 3]
        reach = self.config.reach_m * float(np.linalg.norm((1.0, *self._slopes)))
        return np.stack((position - reach, position + reach)).astype(np.float32)

    def rows_in_view(self, index: VoxelIndex) -> I32:
        """Rows of the voxels that may be in view and within reach."""
        return index.rows_near(self.box, self._spheres_in_view)

    def box_in_view(self, box_world: Points) -> bool:
        """Whether the sphere around a (2, 3) box may reach into the view, within reach."""
        radius = float(np.linalg.norm(box_world[1] - box_world[0])) / 2
        return bool(self._spheres_in_view(box_world.mean(axis=0)[None], radius)[0])

    def _spheres_in_view(self, centers_world: Points, radius: float) -> Bool:
        x, y, z = transform(self._camera_from_world, centers_world).T
        in_view = (z > -radius) & (z < self.config.reach_m + radius)
        for across, slope in zip((x, y), self._slopes, strict=True):
            in_view &= np.abs(across) - slope * np.maximum(z, 0) < radius * np.hypot(1, slope)
        return np.asarray(in_view)

    def classify(self, points_world: Points) -> tuple[Bool, Bool]:
        """Two masks (N,) of points (N, 3): seen through, and seen. Points in neither are hidden or out of view."""
        height, width = self._depth_m.shape
        fx, fy, cx, cy = self._intrinsics
        x, y, z = transform(self._camera_from_world, points_world).T
        ahead = (z > 0.05) & (z < self.config.reach_m)
        z_ahead = np.where(ahead, z, 1.0)
        u, v = np.rint(x / z_ahead * fx + cx), np.rint(y / z_ahead * fy + cy)
        in_image = np.flatnonzero(ahead & (u >= 0) & (u < width) & (v >= 0) & (v < height))
        rows, columns, z = v[in_image].astype(int), u[in_image].astype(int), z[in_image]
        measured, nearest = self._depth_m[rows, columns], self._nearest_m[rows, columns]
        margin = self.config.margin_m + self.config.margin_per_m2 * z * z
        seen_through, seen = np.zeros(len(points_world), bool), np.zeros(len(points_world), bool)
        seen_through[in_image] = (measured > 0) & (nearest > z + margin)
        seen[in_image] = (measured > 0) & (np.abs(measured - z) <= margin)
        return seen_through, seen
