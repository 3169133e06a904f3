"""The pose of a view from corners with known positions and a known surface: robust least squares.

Source: Gauss-Newton on SE(3) with the residuals of RGB-D SLAM (pixel and inverse depth, as ORB-SLAM2's stereo points;
point to plane, as KinectFusion). Departs: both at once, and a prediction that holds what neither does.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from pydantic import BaseModel

from placegraph.runtime.arrays import F32, F64, Bool
from placegraph.runtime.vision.geometry import inverse, nearest_rigid, transform
from placegraph.runtime.vision.point_to_plane import Surface

NEAREST_M = 0.05  # before the camera; what is nearer or behind it has no pixel
STILL = 1e-5  # metres, rad: a smaller step ends the iteration


class RegistrationConfig(BaseModel, frozen=True, strict=True, extra="forbid"):
    """How far to believe what."""

    pixel_sigma: float = 1.0
    inverse_depth_sigma: float = 0.004  # 1/m: OAK-D stereo .0026, Kinect about .003
    inlier_sigmas: float = 3.0
    iterations: int = 10


@dataclass(frozen=True, eq=False)
class Corners:
    """Points (N, 3) in a reference frame, where an image shows them (N, 2) px, and how deep (N,) 1/m (0: unknown)."""

    xyz: F64
    uv: F32
    inverse_depth: F64

    def __len__(self) -> int:
        return len(self.uv)

    def and_also(self, other: Corners) -> Corners:
        """Both, these first."""
        return Corners(
            np.concatenate((self.xyz, other.xyz)),
            np.concatenate((self.uv, other.uv)),
            np.concatenate((self.inverse_depth, other.inverse_depth)),
        )

    def linear(self, camera_from_reference: F64, intrinsics: F64, c: RegistrationConfig) -> tuple[F64, F64, F64]:
        """Matrix (6, 6), slope (6,) of the least squares by the camera's motion; squared residuals (N,) in sigmas."""
        fx, fy, cx, cy = intrinsics
        xyz = transform(camera_from_reference, self.xyz)
        ahead, known = xyz[:, 2] > NEAREST_M, self.inverse_depth > 0
        x, y, z = np.where(ahead[:, None], xyz, 1.0).T
        a, b, d = fx / z / c.pixel_sigma, fy / z / c.pixel_sigma, known / z**2 / c.inverse_depth_sigma
        residual = np.stack(
            (
                (fx * x / z + cx - self.uv[:, 0]) / c.pixel_sigma,
                (fy * y / z + cy - self.uv[:, 1]) / c.pixel_sigma,
                known * (1 / z - self.inverse_depth) / c.inverse_depth_sigma,
            ),
            axis=1,
        )
        squares = np.where(ahead, (residual**2).sum(axis=1), np.inf)
        weight = np.where(ahead, 1 / (1 + squares / 4), 0.0)  # Cauchy
        jacobian = np.zeros((len(xyz), 3, 6))
        zero = np.zeros(len(xyz))
        jacobian[:, 0, :3] = np.stack((a, zero, -a * x / z), axis=1)
        jacobian[:, 1, :3] = np.stack((zero, b, -b * y / z), axis=1)
        jacobian[:, 2, 2] = -d
        # the camera's points shift by t and turn by w: d xyz = t + w x xyz
        jacobian[:, :, 3:] = np.cross(np.stack((x, y, z), axis=1)[:, None], jacobian[:, :, :3])
        rows = jacobian.reshape(-1, 6)
        weighted = rows * np.repeat(weight, 3)[:, None]
        return weighted.T @ rows, weighted.T @ residual.ravel(), squares


@dataclass(frozen=True, eq=False)
class Laid:
    """Points (M, 3) in metres, camera frame, to be laid onto a surface; (4, 4) where that was seen from."""

    points: F64
    surface: Surface
    reference_from_surface: F64


@dataclass(frozen=True, eq=False)
class Registered:
    """A pose (4, 4), which corners agree with it (N,), and what share of the points met the surface."""

    reference_from_camera: F64
    inlier: Bool
    met: float


def register(
    corners: Corners, laid: Laid | None, intrinsics: F64, guess: F64, config: RegistrationConfig,
    prior_sigmas: tuple[float, float] | None = None,
) -> Registered:  # fmt: skip
    """The pose that explains corners and surface best, from `guess` (4, 4) reference_from_camera on.

    prior_sigmas: metres and rad by which the pose departs from the guess; None: the guess is only a start.
    """
    camera_from_reference = predicted = inverse(guess)
    prior = np.zeros((6, 6)) if prior_sigmas is None else np.diag(np.repeat(np.array(prior_sigmas) ** -2.0, 3))
    met = 0.0
    for _ in range(config.iterations):
        matrix, slope, squares = corners.linear(camera_from_reference, intrinsics, config)
        if laid is not None:
            surface_from_camera = inverse(laid.reference_from_surface) @ inverse(camera_from_reference)
            of_planes, slope_of_planes, met = laid.surface.linear(surface_from_camera, laid.points)
            matrix, slope = matrix + of_planes, slope + slope_of_planes
        off = logarithm(camera_from_reference @ inverse(predicted))
        step = np.asarray(-np.linalg.solve(matrix + prior + 1e-9 * np.eye(6), slope + prior @ off))
        camera_from_reference = exponential(step) @ camera_from_reference
        if np.abs(step).max() < STILL:
            break
    pose = nearest_rigid(inverse(camera_from_reference))
    return Registered(pose, squares < config.inlier_sigmas**2, met)


def project(xyz: F64, intrinsics: F64, reference_from_camera: F64) -> F64:
    """Pixels (N, 2) of points (N, 3) of the reference frame; NaN for what is not before the camera."""
    seen = transform(inverse(reference_from_camera), xyz)
    fx, fy, cx, cy = intrinsics
    z = np.where(seen[:, 2] > NEAREST_M, seen[:, 2], np.nan)
    return np.stack((fx * seen[:, 0] / z + cx, fy * seen[:, 1] / z + cy), axis=1)


def rays(uv: F32, intrinsics: F64) -> F64:
    """Points (N, 3) one metre deep at pixels (N, 2)."""
    fx, fy, cx, cy = intrinsics
    return np.stack(((uv[:, 0] - cx) / fx, (uv[:, 1] - cy) / fy, np.ones(len(uv))), axis=1).astype(float)


def inverse_depth_at(depth_m: F32, uv: F32) -> F64:
    """(N,) 1/m at pixels (N, 2), 0 where there is no reading or those around it differ: a depth edge."""
    height, width = depth_m.shape
    column = np.clip(np.rint(uv[:, 0]).astype(int), 1, width - 2)
    row = np.clip(np.rint(uv[:, 1]).astype(int), 1, height - 2)
    offsets = np.array([(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1)])
    patch = depth_m[row[:, None] + offsets[:, 0], column[:, None] + offsets[:, 1]].astype(float)
    valid = patch > 0
    low, high = np.where(valid, patch, np.inf).min(axis=1), patch.max(axis=1)
    good = (valid.sum(axis=1) >= 6) & valid[:, 4] & (high - low < 0.05 * low)
    return np.where(good, 1 / np.where(good, patch[:, 4], 1.0), 0.0)


def exponential(step: F64) -> F64:
    """A motion (6,), shift in metres and turn in rad, as (4, 4); shift and turn are not coupled."""
    made = np.eye(4)
    made[:3, :3] = cv2.Rodrigues(step[3:])[0]
    made[:3, 3] = step[:3]
    return made


def logarithm(motion: F64) -> F64:
    """Shift and turn (6,) of a motion (4, 4), the inverse of `exponential`."""
    return np.concatenate((motion[:3, 3], cv2.Rodrigues(motion[:3, :3])[0].ravel()))
