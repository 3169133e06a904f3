"""Which way is up: from the source (IMU, data set), else from the dominant level plane of the first frames."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from placegraph.runtime.arrays import F32, F64
from placegraph.runtime.vision.geometry import rotation_between, transform

Sample = tuple[F64, F64, F32]  # start_from_camera (4, 4), up_camera (3,), points (N, 3) camera frame

MAX_TILT_RAD = np.deg2rad(50)  # a robot's camera is not rolled or pitched further; planes beyond that are walls
PLANE_M = 0.03  # a point this near belongs to a plane
MIN_SHARE = 0.05  # of the points: less is no dominant plane
TRIALS = 600
MAX_POINTS = 6000


@dataclass(frozen=True)
class Up:
    """Unit vector against gravity in the start frame, where it comes from, and whether to rely on it."""

    up: F64
    source: str
    reliable: bool


def find_up(samples: Sequence[Sample], seed: int, mount_roll_rad: float = 0.0) -> Up:
    """Decide from the first frames; without any evidence the first camera is taken as level, and says so.

    mount_roll_rad: by how much the camera is turned about its optical axis, clockwise as seen from behind it.
    """
    known = [pose[:3, :3] @ up for pose, up, _ in samples if np.isfinite(up).all()]
    if known:
        mean = np.mean(known, axis=0)
        return Up(mean / np.linalg.norm(mean), "the source", True)
    # a camera turned clockwise sees the world turned the other way: up moves from the image's top to its left
    image_up = np.array([-np.sin(mount_roll_rad), -np.cos(mount_roll_rad), 0.0])
    if samples:
        camera_up = np.mean([pose[:3, :3] @ image_up for pose, _, _ in samples], axis=0)
        camera_up /= np.linalg.norm(camera_up)
        cloud = np.concatenate([transform(pose, points) for pose, _, points in samples])
        normal, share = level_plane(cloud, camera_up, seed)
        if share >= MIN_SHARE:
            return Up(normal, f"a level plane with {share:.0%} of the points of {len(samples)} frames", True)
        return Up(camera_up, "the camera itself, taken as level", False)
    return Up(image_up, "nothing: no trusted frame", False)


def level_plane(cloud: F64, near: F64, seed: int) -> tuple[F64, float]:
    """Direction shared by the level planes of a cloud (N, 3), within MAX_TILT_RAD of `near`, and its planes' share.

    RANSAC over point triples scores a direction by all points of its best plane; a table and a floor agree on it.
    """
    random = np.random.default_rng(seed)
    if len(cloud) < 3:
        return near, 0.0
    if len(cloud) > MAX_POINTS:
        cloud = cloud[random.choice(len(cloud), MAX_POINTS, replace=False)]
    triples = cloud[random.integers(0, len(cloud), (TRIALS, 3))]
    normals = np.cross(triples[:, 1] - triples[:, 0], triples[:, 2] - triples[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    good = lengths > 1e-6
    normals, points = normals[good] / lengths[good, None], triples[good, 0]
    normals *= np.where(normals @ near < 0, -1.0, 1.0)[:, None]
    level = normals @ near > np.cos(MAX_TILT_RAD)
    normals, points = normals[level], points[level]
    if len(normals) == 0:
        return near, 0.0
    offsets = np.einsum("ij,ij->i", normals, points)
    counts = np.array(
        [np.count_nonzero(np.abs(cloud @ n - d) < PLANE_M) for n, d in zip(normals, offsets, strict=True)]
    )
    best = int(np.argmax(counts))
    normal, inliers = normals[best], cloud[np.abs(cloud @ normals[best] - offsets[best]) < PLANE_M]
    _, _, axes = np.linalg.svd(inliers - inliers.mean(axis=0), full_matrices=False)
    refined = axes[2] * (1.0 if axes[2] @ normal > 0 else -1.0)
    return refined, len(inliers) / len(cloud)


def level(up: F64) -> F64:
    """world_from_start (4, 4): turns `up` onto z, first camera at the origin."""
    world_from_start = np.eye(4)
    world_from_start[:3, :3] = rotation_between(up, np.array([0.0, 0.0, 1.0]))
    return world_from_start
