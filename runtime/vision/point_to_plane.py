"""The surface that one view shows, as planes to lay other views onto.

Source: projective point-to-plane ICP (KinectFusion, Newcombe 2011). Departs: it is one term beside the corners' in a
pose's least squares, which a bare wall needs and which slides where only it speaks.
"""

from __future__ import annotations

import cv2
import numpy as np
from pydantic import BaseModel, Field

from placegraph.runtime.arrays import F32, F64
from placegraph.runtime.vision.geometry import backproject, transform

GRID = 4  # pixels of the image to a cell of the surface, each way
FLAT_SHARE = 0.25  # of the depth that two cells may be apart and still be one surface: grazing views of a floor


class SurfaceConfig(BaseModel, frozen=True, strict=True, extra="forbid"):
    """When a point is laid onto a plane."""

    reach_m: float = Field(default=0.1, gt=0)  # a point further from the surface is something else
    noise: float = (
        0.01  # a distance's sigma is this times the depth squared: three times stereo's, as errors go together
    )
    min_noise_m: float = 0.01
    max_depth_m: float = 6.0


class Surface:
    """Positions and normals (H / GRID, W / GRID, 3) of one view, metres, its camera's frame; NaN where unknown."""

    def __init__(self, coarse_m: F32, intrinsics: F64, config: SurfaceConfig) -> None:
        """coarse_m: (H / GRID, W / GRID), see `coarse_depth`; intrinsics: (4,) fx fy cx cy in px of the full image."""
        self._config = config
        self._intrinsics = intrinsics / GRID
        z = np.where((coarse_m > 0) & (coarse_m <= config.max_depth_m), coarse_m, np.nan).astype(float)
        v, u = np.mgrid[: z.shape[0], : z.shape[1]]
        fx, fy, cx, cy = self._intrinsics
        self.xyz: F64 = np.stack(((u - cx) / fx * z, (v - cy) / fy * z, z), axis=2)
        self.normals: F64 = _normals(self.xyz)

    def linear(self, surface_from_camera: F64, points: F64) -> tuple[F64, F64, float]:
        """What points (M, 3) of another camera say of its pose (4, 4): the least squares' matrix and slope.

        Both are by the other camera's motion (shift, turn) in its own frame: (6, 6), (6,). And the share that met.
        """
        c = self._config
        xyz = transform(surface_from_camera, points)
        fx, fy, cx, cy = self._intrinsics
        z = np.maximum(xyz[:, 2], 0.05)
        column = np.rint(fx * xyz[:, 0] / z + cx).astype(np.int64)
        row = np.rint(fy * xyz[:, 1] / z + cy).astype(np.int64)
        height, width = self.normals.shape[:2]
        inside = (xyz[:, 2] > 0.05) & (column >= 0) & (column < width) & (row >= 0) & (row < height)
        xyz, own, at = xyz[inside], points[inside], (row[inside], column[inside])
        distance = ((xyz - self.xyz[at]) * self.normals[at]).sum(axis=1)
        near = np.abs(distance) < c.reach_m  # false for NaN: no surface there
        own, distance = own[near], distance[near]
        normals = self.normals[at][near] @ surface_from_camera[:3, :3]
        sigma = np.maximum(c.noise * own[:, 2] ** 2, c.min_noise_m)
        residual = distance / sigma
        weight = 1 / (1 + residual**2 / 4)
        jacobian = -np.concatenate((normals, np.cross(own, normals)), axis=1) / sigma[:, None]
        met = float(near.sum()) / max(len(points), 1)
        return (jacobian * weight[:, None]).T @ jacobian, jacobian.T @ (weight * residual), met


def scan_points(coarse_m: F32, intrinsics: F64) -> F64:
    """Points (M, 3) in metres, camera frame, to lay onto a Surface: every other cell of `coarse_depth` each way."""
    return backproject(coarse_m, intrinsics / GRID, 2).astype(float)


def coarse_depth(depth_m: F32) -> F32:
    """Depth (H / GRID, W / GRID) in metres, smoothed over what is valid and not across edges; 0 without a reading."""
    small = np.ascontiguousarray(depth_m[::GRID, ::GRID], np.float32)
    valid = (small > 0).astype(np.float32)
    mean = cv2.blur(small, (3, 3)) / np.maximum(cv2.blur(valid, (3, 3)), 1e-6)
    smooth = (valid > 0) & (np.abs(mean - small) < 0.05 * small)
    return np.where(smooth, mean, 0).astype(np.float32)


def _normals(xyz: F64) -> F64:
    normals = np.full(xyz.shape, np.nan)
    across, down = xyz[1:-1, 2:] - xyz[1:-1, :-2], xyz[2:, 1:-1] - xyz[:-2, 1:-1]
    cross = np.cross(down, across)  # towards the camera
    length = np.linalg.norm(cross, axis=2, keepdims=True)
    step = np.maximum(np.linalg.norm(across, axis=2), np.linalg.norm(down, axis=2))
    with np.errstate(invalid="ignore", divide="ignore"):
        flat = step < FLAT_SHARE * xyz[1:-1, 1:-1, 2]
        normals[1:-1, 1:-1] = np.where(flat[..., None], cross / length, np.nan)
    return normals
