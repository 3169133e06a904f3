"""A view as a set of described keypoints with depth: to find out whether two views show one place, and from where.

Source: ORB (Rublee 2011), matching by Lowe's ratio, the pose by RANSAC over perspective-n-point; then registered on
the corners that agree and the views' surfaces together.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from pydantic import BaseModel, Field

from placegraph.runtime.arrays import F32, F64, I64, U8, U16
from placegraph.runtime.vision.geometry import inverse
from placegraph.runtime.vision.point_to_plane import Surface, SurfaceConfig, coarse_depth, scan_points
from placegraph.runtime.vision.registration import (
    Corners,
    Laid,
    Registered,
    RegistrationConfig,
    inverse_depth_at,
    rays,
    register,
)


class FeatureConfig(BaseModel, frozen=True, strict=True, extra="forbid"):
    """What it takes for two views to show one place."""

    keypoints: int = Field(default=600, ge=50)
    fast_threshold: int = 7  # of grey levels; OpenCV's 20 finds nothing on painted walls
    ratio: float = 0.8  # Lowe
    reprojection_px: float = 3.0  # of RANSAC, in an image 640 wide
    trials: int = 300
    min_inliers: int = Field(default=25, ge=6)
    min_met: float = 0.25  # share of the one view's points that must lie on the other's surface
    registration: RegistrationConfig = RegistrationConfig()
    surface: SurfaceConfig = SurfaceConfig()


@dataclass(frozen=True, eq=False)
class Features:
    """Keypoints of one view: pixels (N, 2), positions (N, 3) in its camera's frame or NaN, descriptors (N, 32).

    And its depth on the grid of surfaces, in mm: what is kept of a view to recognise it, 70 kB at 640x480.
    """

    uv: F32
    xyz: F32
    descriptors: U8
    coarse_mm: U16
    intrinsics: F64

    def surface(self, config: SurfaceConfig) -> Surface:
        """What it sees as planes."""
        return Surface(self.coarse_m, self.intrinsics, config)

    @property
    def coarse_m(self) -> F32:
        """Its depth on the grid of surfaces, in metres."""
        return self.coarse_mm * np.float32(0.001)


def describe(gray: U8, depth_m: F32, intrinsics: F64, config: FeatureConfig) -> Features:
    """Features of an image (H, W) with its depth (H, W) in metres, 0 = no reading; intrinsics fx fy cx cy px."""
    orb = cv2.ORB.create(nfeatures=config.keypoints, fastThreshold=config.fast_threshold)
    keypoints, descriptors = orb.detectAndCompute(gray, None)
    coarse_mm = np.clip(np.rint(coarse_depth(depth_m) * 1000), 0, 65535).astype(np.uint16)
    if descriptors is None:
        none = np.zeros((0, 2), np.float32), np.zeros((0, 3), np.float32), np.zeros((0, 32), np.uint8)
        return Features(*none, coarse_mm, intrinsics)
    uv = np.array([keypoint.pt for keypoint in keypoints], np.float32).reshape(-1, 2)
    inverse_depth = inverse_depth_at(depth_m, uv)
    z = np.where(inverse_depth > 0, 1 / np.where(inverse_depth > 0, inverse_depth, 1.0), np.nan)
    xyz = (rays(uv, intrinsics) * z[:, None]).astype(np.float32)
    return Features(uv, xyz, np.asarray(descriptors, np.uint8), coarse_mm, intrinsics)


def relate(reference: Features, view: Features, config: FeatureConfig) -> Registered | None:
    """Pose of a view in the camera frame of a reference; None when they do not show one place for certain."""
    c = config
    mine, theirs = _matches(reference, view, c.ratio)
    known = np.isfinite(reference.xyz[mine, 2])
    mine, theirs = mine[known], theirs[known]
    if len(mine) < c.min_inliers:
        return None
    fx, fy, cx, cy = view.intrinsics
    camera = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]])
    found, turn, shift, chosen = cv2.solvePnPRansac(  # its seed is fixed
        reference.xyz[mine].astype(float), view.uv[theirs].astype(float), camera, None, iterationsCount=c.trials,
        reprojectionError=c.reprojection_px * 2 * cx / 640, confidence=0.999, flags=cv2.SOLVEPNP_EPNP,
    )  # fmt: skip
    if not found or chosen is None or len(chosen) < c.min_inliers:
        return None
    view_from_reference = np.eye(4)
    view_from_reference[:3, :3], view_from_reference[:3, 3] = cv2.Rodrigues(turn)[0], shift.ravel()
    mine, theirs = mine[chosen.ravel()], theirs[chosen.ravel()]
    z = view.xyz[theirs, 2].astype(float)
    inverse_depth = np.where(np.isfinite(z), 1 / np.where(np.isfinite(z), z, 1.0), 0.0)
    corners = Corners(reference.xyz[mine].astype(float), view.uv[theirs], inverse_depth)
    laid = Laid(scan_points(view.coarse_m, view.intrinsics), reference.surface(c.surface), np.eye(4))
    pose = register(corners, laid, view.intrinsics, inverse(view_from_reference), c.registration)
    if int(pose.inlier.sum()) < c.min_inliers or pose.met < c.min_met:
        return None
    return pose


def _matches(a: Features, b: Features, ratio: float) -> tuple[I64, I64]:
    """Rows of a and b that are each other's nearest, and far nearer than the second."""
    none = np.zeros(0, np.int64)
    if len(a.uv) < 2 or len(b.uv) < 2:
        return none, none
    pairs = cv2.BFMatcher(cv2.NORM_HAMMING).knnMatch(b.descriptors, a.descriptors, k=2)
    best = {first.queryIdx: first for first, second in pairs if first.distance < ratio * second.distance}
    nearest: dict[int, cv2.DMatch] = {}
    for match in best.values():
        held = nearest.get(match.trainIdx)
        if held is None or match.distance < held.distance:
            nearest[match.trainIdx] = match
    chosen = [nearest[row] for row in sorted(nearest)]
    if not chosen:
        return none, none
    return np.array([m.trainIdx for m in chosen]), np.array([m.queryIdx for m in chosen])
