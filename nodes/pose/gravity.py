"""Which way is up: from the source (IMU, data set), else from the dominant level plane of the first frames."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from placegraph.runtime.arrays import F32, F64
from placegraph.runtime.vision.geometry import rotation_between, transform

Sample = tuple[F64, F64, F32]  # start_from_camera (4, 4), up_camera (3,), points (N, 3) camera frame

# chosen by hand
MAX_TILT_RAD = np.deg2rad(50)  # of a robot's camera in roll and pitch; planes tilted further are walls
MAX_PLANE_DISTANCE_M = 0.03  # of a point that belongs to a plane
MIN_PLANE_SHARE = 0.05  # of the points that the dominant plane must hold
RANSAC_TRIALS = 600
MAX_POINTS = 6000


@dataclass(frozen=True)
class UpDirection:
    """Unit vector against gravity in the start frame, where it comes from, and whether to rely on it."""

    up: F64
    source: str
    reliable: bool


def estimate_up(samples: Sequence[Sample], seed: int, mount_roll_rad: float = 0.0) -> UpDirection:
    """Up by the first frames; without evidence the first camera is taken as level and the result is not reliable.

    mount_roll_rad: by how much the camera is turned about its optical axis, clockwise as seen from behind it.
    """
    known = [pose[:3, :3] @ up for pose, up, _ in samples if np.isfinite(up).all()]
    if known:
        mean = np.mean(known, axis=0)
        return UpDirection(mean / np.linalg.norm(mean), "the source", True)
    # a camera turned clockwise sees the world turned the other way: up moves from the image's top to its left
    image_up = np.array([-np.sin(mount_roll_rad), -np.cos(mount_roll_rad), 0.0])
    if samples:
        camera_up = np.mean([pose[:3, :3] @ image_up for pose, _, _ in samples], axis=0)
        camera_up /= np.linalg.norm(camera_up)
        cloud = np.concatenate([transform(pose, points) for pose, _, points in samples])
        normal, share = find_level_plane(cloud, camera_up, seed)
        if share >= MIN_PLANE_SHARE:
            return UpDirection(normal, f"a level plane with {share:.0%} of the points of {len(samples)} frames", True)
        return UpDirection(camera_up, "the camera itself, taken as level", False)
    return UpDirection(image_up, "nothing: no trusted frame", False)


def find_level_plane(cloud: F64, near: F64, seed: int) -> tuple[F64, float]:
    """Normal (3,) of the level planes of a cloud (N, 3), at most MAX_TILT_RAD from `near`, and their share of points.

    RANSAC over triples of points; a direction counts the points of its best plane, so a table and a floor agree on it.
    """
    random = np.random.default_rng(seed)
    if len(cloud) < 3:
        return near, 0.0
    if len(cloud) > MAX_POINTS:
        cloud = cloud[random.choice(len(cloud), MAX_POINTS, replace=False)]
    triples = cloud[random.integers(0, len(cloud), (RANSAC_TRIALS, 3))]
    normals = np.cross(triples[:, 1] - triples[:, 0], triples[:, 2] - triples[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    has_length = lengths > 1e-6
    normals, points = normals[has_length] / lengths[has_length, None], triples[has_length, 0]
    normals *= np.where(normals @ near < 0, -1.0, 1.0)[:, None]
    is_level = normals @ near > np.cos(MAX_TILT_RAD)
    normals, points = normals[is_level], points[is_level]
    if len(normals) == 0:
        return near, 0.0
    offsets = np.einsum("ij,ij->i", normals, points)
    planes = zip(normals, offsets, strict=True)
    counts = [np.count_nonzero(np.abs(cloud @ n - d) < MAX_PLANE_DISTANCE_M) for n, d in planes]
    best = int(np.argmax(counts))
    inliers = cloud[np.abs(cloud @ normals[best] - offsets[best]) < MAX_PLANE_DISTANCE_M]
    _, _, axes = np.linalg.svd(inliers - inliers.mean(axis=0), full_matrices=False)
    refined = axes[2] * (1.0 if axes[2] @ normals[best] > 0 else -1.0)
    return refined, len(inliers) / len(cloud)


def world_from_start(up: F64) -> F64:
    """The (4, 4) transform that turns `up` (3,) of the start frame onto z; the first camera is at the origin."""
    transform_to_world = np.eye(4)
    transform_to_world[:3, :3] = rotation_between(up, np.array([0.0, 0.0, 1.0]))
    return transform_to_world
