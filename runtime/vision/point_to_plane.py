"""Point-to-plane registration: the surface that one view shows, and how well points of another view fit it.

Source: projective point-to-plane ICP (KinectFusion, Newcombe 2011). Not as there: it is one term of a pose's least
squares beside the point matches, because surfaces alone let a camera slide along a wall.
"""

from __future__ import annotations

import cv2
import numpy as np
from pydantic import BaseModel, Field

from placegraph.runtime.arrays import F32, F64
from placegraph.runtime.vision.geometry import backproject, transform

GRID = 4  # px of the image per cell of a surface, each way
MAX_DEPTH_STEP = 0.25  # share of the depth that two cells of one surface may differ by: grazing views of a floor
MIN_DEPTH_M = 0.05  # in front of the camera; nearer points are not projected
MAX_SMOOTHED_STEP = 0.05  # share of the depth by which a reading may differ from its neighbours' mean; else an edge


class SurfaceConfig(BaseModel, frozen=True, strict=True, extra="forbid"):
    """When a point counts as lying on a surface, and how exact its distance is."""

    max_distance_m: float = Field(default=0.1, gt=0)  # a point further from the surface belongs to something else
    # sigma of a distance = this times depth^2; three times that of stereo, because neighbouring errors are correlated
    noise_per_m: float = 0.01
    min_noise_m: float = 0.01
    max_depth_m: float = 6.0


class SurfaceMap:
    """Positions and normals (H / GRID, W / GRID, 3) of one view in metres, camera frame; NaN where unknown."""

    def __init__(self, coarse_m: F32, intrinsics: F64, config: SurfaceConfig) -> None:
        """coarse_m: (H / GRID, W / GRID), see `coarse_depth`; intrinsics: (4,) fx fy cx cy in px of the full image."""
        self._config = config
        self._intrinsics = intrinsics / GRID
        z = np.where((coarse_m > 0) & (coarse_m <= config.max_depth_m), coarse_m, np.nan).astype(float)
        v, u = np.mgrid[: z.shape[0], : z.shape[1]]
        fx, fy, cx, cy = self._intrinsics
        self.xyz: F64 = np.stack(((u - cx) / fx * z, (v - cy) / fy * z, z), axis=2)
        self.normals: F64 = _normals(self.xyz)

    def normal_equations(self, surface_from_camera: F64, points: F64) -> tuple[F64, F64, float]:
        """Least squares of the distances of points (M, 3), camera frame, from this surface.

        The parameters are the camera's motion in its own frame: shift and turn (6,). Returns the matrix (6, 6), the
        gradient (6,), and the overlap: the share of the points that lie on the surface.
        """
        c = self._config
        xyz = transform(surface_from_camera, points)
        fx, fy, cx, cy = self._intrinsics
        z = np.maximum(xyz[:, 2], MIN_DEPTH_M)
        column = np.rint(fx * xyz[:, 0] / z + cx).astype(np.int64)
        row = np.rint(fy * xyz[:, 1] / z + cy).astype(np.int64)
        height, width = self.normals.shape[:2]
        is_inside = (xyz[:, 2] > MIN_DEPTH_M) & (column >= 0) & (column < width) & (row >= 0) & (row < height)
        cells = row[is_inside], column[is_inside]
        distance = ((xyz[is_inside] - self.xyz[cells]) * self.normals[cells]).sum(axis=1)
        is_near = np.abs(distance) < c.max_distance_m  # false for NaN: no surface there
        points_on, distance = points[is_inside][is_near], distance[is_near]
        normals = self.normals[cells][is_near] @ surface_from_camera[:3, :3]
        sigma = np.maximum(c.noise_per_m * points_on[:, 2] ** 2, c.min_noise_m)
        residual = distance / sigma
        weight = 1 / (1 + residual**2 / 4)
        jacobian = -np.concatenate((normals, np.cross(points_on, normals)), axis=1) / sigma[:, None]
        overlap = float(is_near.sum()) / max(len(points), 1)
        return (jacobian * weight[:, None]).T @ jacobian, jacobian.T @ (weight * residual), overlap


def scan_points(coarse_m: F32, intrinsics: F64) -> F64:
    """Points (M, 3) in metres, camera frame, of every other cell of `coarse_depth` each way, to fit to a surface."""
    return backproject(coarse_m, intrinsics / GRID, 2).astype(float)


def coarse_depth(depth_m: F32) -> F32:
    """Depth (H / GRID, W / GRID) in metres, smoothed over valid readings but not across edges; 0 = no reading."""
    small = np.ascontiguousarray(depth_m[::GRID, ::GRID], np.float32)
    valid = (small > 0).astype(np.float32)
    mean = cv2.blur(small, (3, 3)) / np.maximum(cv2.blur(valid, (3, 3)), 1e-6)
    is_smooth = (valid > 0) & (np.abs(mean - small) < MAX_SMOOTHED_STEP * small)
    return np.where(is_smooth, mean, 0).astype(np.float32)


def _normals(xyz: F64) -> F64:
    normals = np.full(xyz.shape, np.nan)
    across, down = xyz[1:-1, 2:] - xyz[1:-1, :-2], xyz[2:, 1:-1] - xyz[:-2, 1:-1]
    cross = np.cross(down, across)  # towards the camera
    length = np.linalg.norm(cross, axis=2, keepdims=True)
    step = np.maximum(np.linalg.norm(across, axis=2), np.linalg.norm(down, axis=2))
    with np.errstate(invalid="ignore", divide="ignore"):
        is_flat = step < MAX_DEPTH_STEP * xyz[1:-1, 1:-1, 2]
        normals[1:-1, 1:-1] = np.where(is_flat[..., None], cross / length, np.nan)
    return normals
