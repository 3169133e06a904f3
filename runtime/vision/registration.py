"""The pose of a view from matched points and a known surface: robust least squares.

Source: Gauss-Newton on SE(3) with the residuals of RGB-D SLAM (pixel and inverse depth, as the stereo points of
ORB-SLAM2; point to plane, as KinectFusion). Not as there: both terms at once, and a prior on the predicted pose for
the directions that neither term holds.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from pydantic import BaseModel

from placegraph.runtime.arrays import F32, F64, Bool
from placegraph.runtime.vision.geometry import inverse, nearest_rigid, transform
from placegraph.runtime.vision.point_to_plane import MIN_DEPTH_M, SurfaceMap

CONVERGED_STEP = 1e-5  # metres and rad: a smaller step ends the iteration


class RegistrationConfig(BaseModel, frozen=True, strict=True, extra="forbid"):
    """Noise of the measurements, and when a match is an inlier."""

    pixel_sigma: float = 1.0
    inverse_depth_sigma: float = 0.004  # 1/m: OAK-D stereo .0026, Kinect about .003
    inlier_sigmas: float = 3.0
    iterations: int = 10


@dataclass(frozen=True, eq=False)
class PointMatches:
    """Points of a reference, found in an image.

    xyz: (N, 3) metres, reference frame; uv: (N, 2) px in the image; inverse_depth: (N,) 1/m in the image, 0 = unknown.
    """

    xyz: F64
    uv: F32
    inverse_depth: F64

    def __len__(self) -> int:
        return len(self.uv)

    def joined_with(self, others: PointMatches) -> PointMatches:
        """These matches, followed by `others`."""
        return PointMatches(
            np.concatenate((self.xyz, others.xyz)),
            np.concatenate((self.uv, others.uv)),
            np.concatenate((self.inverse_depth, others.inverse_depth)),
        )

    def normal_equations(
        self, camera_from_reference: F64, intrinsics: F64, c: RegistrationConfig
    ) -> tuple[F64, F64, F64]:
        """Least squares of the reprojection errors; parameters as in SurfaceMap.normal_equations.

        Returns the matrix (6, 6), the gradient (6,) and the squared residuals (N,) in sigmas, infinite behind the
        camera.
        """
        fx, fy, cx, cy = intrinsics
        xyz = transform(camera_from_reference, self.xyz)
        is_ahead, has_depth = xyz[:, 2] > MIN_DEPTH_M, self.inverse_depth > 0
        x, y, z = np.where(is_ahead[:, None], xyz, 1.0).T
        du_dx, dv_dy = fx / z / c.pixel_sigma, fy / z / c.pixel_sigma
        dd_dz = has_depth / z**2 / c.inverse_depth_sigma
        residual = np.stack(
            (
                (fx * x / z + cx - self.uv[:, 0]) / c.pixel_sigma,
                (fy * y / z + cy - self.uv[:, 1]) / c.pixel_sigma,
                has_depth * (1 / z - self.inverse_depth) / c.inverse_depth_sigma,
            ),
            axis=1,
        )
        squares = np.where(is_ahead, (residual**2).sum(axis=1), np.inf)
        weight = np.where(is_ahead, 1 / (1 + squares / 4), 0.0)  # Cauchy
        jacobian = np.zeros((len(xyz), 3, 6))
        zero = np.zeros(len(xyz))
        jacobian[:, 0, :3] = np.stack((du_dx, zero, -du_dx * x / z), axis=1)
        jacobian[:, 1, :3] = np.stack((zero, dv_dy, -dv_dy * y / z), axis=1)
        jacobian[:, 2, 2] = -dd_dz
        # the camera's points shift by t and turn by w: d xyz = t + w x xyz
        jacobian[:, :, 3:] = np.cross(np.stack((x, y, z), axis=1)[:, None], jacobian[:, :, :3])
        rows = jacobian.reshape(-1, 6)
        weighted = rows * np.repeat(weight, 3)[:, None]
        return weighted.T @ rows, weighted.T @ residual.ravel(), squares


@dataclass(frozen=True, eq=False)
class SurfaceMatch:
    """Points (M, 3) in metres, camera frame, to fit to a surface that was seen from (4, 4) reference_from_surface."""

    points: F64
    surface: SurfaceMap
    reference_from_surface: F64


@dataclass(frozen=True, eq=False)
class RegistrationResult:
    """A pose (4, 4), which point matches agree with it (N,), and the share of points that lie on the surface."""

    reference_from_camera: F64
    is_inlier: Bool
    overlap: float


def register(
    matches: PointMatches,
    surface_match: SurfaceMatch | None,
    intrinsics: F64,
    guess: F64,
    config: RegistrationConfig,
    prior_sigmas: tuple[float, float] | None = None,
) -> RegistrationResult:
    """The pose that explains matched points and surface best, iterated from `guess` (4, 4) reference_from_camera.

    prior_sigmas: metres and rad by which the pose differs from the guess; None: the guess is only a start.
    """
    camera_from_reference = predicted = inverse(guess)
    prior = np.zeros((6, 6)) if prior_sigmas is None else np.diag(np.repeat(np.array(prior_sigmas) ** -2.0, 3))
    overlap = 0.0
    for _ in range(config.iterations):
        matrix, gradient, squares = matches.normal_equations(camera_from_reference, intrinsics, config)
        if surface_match is not None:
            surface_from_camera = inverse(surface_match.reference_from_surface) @ inverse(camera_from_reference)
            surface_matrix, surface_gradient, overlap = surface_match.surface.normal_equations(
                surface_from_camera, surface_match.points
            )
            matrix, gradient = matrix + surface_matrix, gradient + surface_gradient
        deviation = logarithm(camera_from_reference @ inverse(predicted))
        step = np.asarray(-np.linalg.solve(matrix + prior + 1e-9 * np.eye(6), gradient + prior @ deviation))
        camera_from_reference = exponential(step) @ camera_from_reference
        if np.abs(step).max() < CONVERGED_STEP:
            break
    pose = nearest_rigid(inverse(camera_from_reference))
    return RegistrationResult(pose, squares < config.inlier_sigmas**2, overlap)


def project(xyz: F64, intrinsics: F64, reference_from_camera: F64) -> F64:
    """Pixels (N, 2) of points (N, 3) of the reference frame; NaN for points that are not in front of the camera."""
    xyz_camera = transform(inverse(reference_from_camera), xyz)
    fx, fy, cx, cy = intrinsics
    z = np.where(xyz_camera[:, 2] > MIN_DEPTH_M, xyz_camera[:, 2], np.nan)
    return np.stack((fx * xyz_camera[:, 0] / z + cx, fy * xyz_camera[:, 1] / z + cy), axis=1)


def unproject(uv: F32, z: F64, intrinsics: F64) -> F64:
    """Points (N, 3) in metres, camera frame, at pixels (N, 2) and depths (N,) in metres."""
    fx, fy, cx, cy = intrinsics
    rays = np.stack(((uv[:, 0] - cx) / fx, (uv[:, 1] - cy) / fy, np.ones(len(uv))), axis=1)
    return rays.astype(float) * z[:, None]


def inverse_depth_at(depth_m: F32, uv: F32) -> F64:
    """(N,) 1/m at pixels (N, 2); 0 without a reading and at depth edges, where the readings around a pixel differ."""
    height, width = depth_m.shape
    column = np.clip(np.rint(uv[:, 0]).astype(int), 1, width - 2)
    row = np.clip(np.rint(uv[:, 1]).astype(int), 1, height - 2)
    offsets = np.array([(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1)])
    patch = depth_m[row[:, None] + offsets[:, 0], column[:, None] + offsets[:, 1]].astype(float)
    valid = patch > 0
    low, high = np.where(valid, patch, np.inf).min(axis=1), patch.max(axis=1)
    is_flat = (valid.sum(axis=1) >= 6) & valid[:, 4] & (high - low < 0.05 * low)
    return np.where(is_flat, 1 / np.where(is_flat, patch[:, 4], 1.0), 0.0)


def exponential(step: F64) -> F64:
    """A motion (6,), shift in metres and turn in rad, as (4, 4); shift and turn are independent (R3 x SO3)."""
    motion = np.eye(4)
    motion[:3, :3] = cv2.Rodrigues(step[3:])[0]
    motion[:3, 3] = step[:3]
    return motion


def logarithm(motion: F64) -> F64:
    """Shift and turn (6,) of a motion (4, 4), the inverse of `exponential`."""
    return np.concatenate((motion[:3, 3], cv2.Rodrigues(motion[:3, :3])[0].ravel()))


def is_within(motion: F64, max_m: float, max_rad: float) -> bool:
    """Whether a motion (4, 4) shifts and turns by no more than the limits."""
    shift_and_turn = logarithm(motion)
    return bool(np.linalg.norm(shift_and_turn[:3]) <= max_m and np.linalg.norm(shift_and_turn[3:]) <= max_rad)
