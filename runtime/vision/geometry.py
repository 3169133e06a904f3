"""Rigid transforms, pinhole cameras, boxes and footprints, in metres.

Frames: world has z up; camera has x right, y down, z forward.
"""

from __future__ import annotations

import cv2
import numpy as np

from placegraph.runtime.arrays import F32, F64, Points


def backproject(depth_m: F32, intrinsics: F64, stride: int = 1) -> F32:
    """Depth image to points.

    depth_m: (H, W) metres, 0 or non-finite = no reading. intrinsics: (4,) fx fy cx cy in px of the full image.
    Returns (N, 3) float32, camera frame, row by row, one for each valid pixel of every `stride`-th row and column.
    """
    z = np.asarray(depth_m[::stride, ::stride], np.float32)
    valid = np.isfinite(z) & (z > 0)
    v, u = np.nonzero(valid)
    fx, fy, cx, cy = intrinsics
    z = z[valid]
    x = ((u * stride - cx) / fx).astype(np.float32) * z
    y = ((v * stride - cy) / fy).astype(np.float32) * z
    return np.stack((x, y, z), axis=1)


def transform(b_from_a: F64, xyz_a: Points) -> F64:
    """Apply a (4, 4) rigid transform to (N, 3) points; float64 in, float64 out."""
    return xyz_a @ b_from_a[:3, :3].T + b_from_a[:3, 3]


def inverse(b_from_a: F64) -> F64:
    """Invert a (4, 4) rigid transform."""
    a_from_b = np.eye(4)
    a_from_b[:3, :3] = b_from_a[:3, :3].T
    a_from_b[:3, 3] = -b_from_a[:3, :3].T @ b_from_a[:3, 3]
    return a_from_b


def nearest_rigid(matrix: F64) -> F64:
    """The rigid (4, 4) transform nearest to a product of many: `inverse` transposes, so rounding would grow."""
    u, _, vt = np.linalg.svd(matrix[:3, :3])
    made = np.eye(4)
    made[:3, :3] = u @ np.diag((1.0, 1.0, np.linalg.det(u @ vt))) @ vt
    made[:3, 3] = matrix[:3, 3]
    return made


def is_rigid(matrix: F64, tolerance: float = 1e-3) -> bool:
    """Whether a (4, 4) matrix is a finite rotation and translation."""
    if not np.isfinite(matrix).all() or not np.allclose(matrix[3], (0, 0, 0, 1), atol=tolerance):
        return False
    rotation = matrix[:3, :3]
    return bool(np.allclose(rotation @ rotation.T, np.eye(3), atol=tolerance) and np.linalg.det(rotation) > 0)


def rotation_between(a: F64, b: F64) -> F64:
    """The smallest (3, 3) rotation that turns unit vector a onto unit vector b (any one of them when opposite)."""
    cosine = float(a @ b)
    if cosine < -1 + 1e-9:
        axis = np.eye(3)[int(np.argmin(np.abs(a)))]
        axis = np.cross(a, axis)
        axis /= np.linalg.norm(axis)
        return 2 * np.outer(axis, axis) - np.eye(3)
    cross = np.cross(a, b)
    skew = np.array([[0, -cross[2], cross[1]], [cross[2], 0, -cross[0]], [-cross[1], cross[0], 0]])
    return np.asarray(np.eye(3) + skew + skew @ skew / (1 + cosine))


def rotation_angle_rad(rotation: F64) -> float:
    """Angle of a (3, 3) rotation, 0..pi."""
    return float(np.arccos(np.clip((np.trace(rotation) - 1) / 2, -1.0, 1.0)))


def quaternion_xyzw(rotation: F64) -> F64:
    """(3, 3) rotation to a unit quaternion x y z w with w >= 0."""
    from scipy.spatial.transform import Rotation  # scipy is slow to import and only writers need this

    return np.asarray(Rotation.from_matrix(rotation).as_quat(canonical=True))


def pose_from_quaternion(translation: Points, xyzw: Points) -> F64:
    """Translation (3,) in metres and quaternion x y z w (any length but zero) to a (4, 4) transform."""
    from scipy.spatial.transform import Rotation

    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_quat(np.asarray(xyzw, float)).as_matrix()
    matrix[:3, 3] = translation
    return matrix


def bounding_box(xyz: Points) -> F32:
    """Axis-aligned (2, 3) box (min, max) of (N, 3) points, N >= 1."""
    return np.stack((xyz.min(axis=0), xyz.max(axis=0))).astype(np.float32)


def box_iou(a: Points, b: Points) -> Points:
    """Intersection over union of boxes (..., 2, D), broadcast against each other: (...), 0 where both are empty.

    Boxes are (min, max) in any D axes; `a[:, None]` against `b[None]` gives all pairs.
    """
    shared = np.prod(np.maximum(np.minimum(a[..., 1, :], b[..., 1, :]) - np.maximum(a[..., 0, :], b[..., 0, :]), 0), -1)
    size_a, size_b = (np.prod(np.maximum(boxes[..., 1, :] - boxes[..., 0, :], 0), -1) for boxes in (a, b))
    union = np.asarray(size_a + size_b - shared)
    return np.asarray(np.divide(shared, union, out=np.zeros_like(union), where=union > 0))


def box_distance_m(a: Points, b: Points) -> float:
    """Shortest distance between the surfaces of two (2, 3) boxes; 0 when they touch or overlap."""
    gap = np.maximum(np.maximum(a[0] - b[1], b[0] - a[1]), 0)
    return float(np.linalg.norm(gap))


def yaw_box(xyz: Points) -> F32:
    """The smallest upright box around (N, 3) points, N >= 1.

    Returns (7,): centre x y z and size x y z in metres, yaw about z in rad in [-pi/4, pi/4).
    """
    xy = np.ascontiguousarray(xyz[:, :2], dtype=np.float32)
    (cx, cy), (sx, sy), degrees = cv2.minAreaRect(xy)
    yaw = np.deg2rad(degrees)
    while yaw >= np.pi / 4:
        yaw, (sx, sy) = yaw - np.pi / 2, (sy, sx)
    while yaw < -np.pi / 4:
        yaw, (sx, sy) = yaw + np.pi / 2, (sy, sx)
    z_min, z_max = float(xyz[:, 2].min()), float(xyz[:, 2].max())
    return np.array([cx, cy, (z_min + z_max) / 2, sx, sy, z_max - z_min, yaw], np.float32)


def convex_footprint(xyz: Points) -> F32:
    """Convex outline of (N, 3) points seen from above: (K, 2) metres, counter-clockwise."""
    xy = np.ascontiguousarray(xyz[:, :2], dtype=np.float32)
    return np.asarray(cv2.convexHull(xy, clockwise=False), np.float32).reshape(-1, 2)
