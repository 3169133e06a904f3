"""ORB features of a view with depth: whether two views show the same place, and the pose of one in the other.

Source: ORB (Rublee 2011), matching by Lowe's ratio, the pose by RANSAC over perspective-n-point; then refined on the
matched keypoints and the surfaces of both views together.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from pydantic import BaseModel, Field

from placegraph.runtime.arrays import F32, F64, I64, U8, U16
from placegraph.runtime.vision.geometry import inverse
from placegraph.runtime.vision.point_to_plane import SurfaceConfig, SurfaceMap, coarse_depth, scan_points
from placegraph.runtime.vision.registration import (
    PointMatches,
    RegistrationConfig,
    RegistrationResult,
    SurfaceMatch,
    inverse_depth_at,
    register,
    unproject,
)


class FeatureConfig(BaseModel, frozen=True, strict=True, extra="forbid"):
    """When two views show the same place."""

    max_keypoints: int = Field(default=600, ge=50)
    fast_threshold: int = 7  # grey levels; OpenCV's 20 finds nothing on painted walls
    lowe_ratio: float = 0.8  # Lowe 2004: distance of the best match to that of the second best
    reprojection_px: float = 3.0  # of a RANSAC inlier, in an image 640 px wide
    ransac_trials: int = 300
    min_inliers: int = Field(default=25, ge=6)
    min_overlap: float = 0.25  # share of the one view's points that must lie on the other's surface
    registration: RegistrationConfig = RegistrationConfig()
    surface: SurfaceConfig = SurfaceConfig()


@dataclass(frozen=True, eq=False)
class ViewFeatures:
    """What is kept of a view to recognise it, 70 kB at 640x480.

    Keypoints: uv (N, 2) px, xyz (N, 3) metres in the camera's frame or NaN, ORB descriptors (N, 32). coarse_mm: depth
    (H / GRID, W / GRID) in mm.
    """

    uv: F32
    xyz: F32
    descriptors: U8
    coarse_mm: U16
    intrinsics: F64

    def surface(self, config: SurfaceConfig) -> SurfaceMap:
        """The surface that the view shows."""
        return SurfaceMap(self.coarse_m, self.intrinsics, config)

    @property
    def coarse_m(self) -> F32:
        """Depth (H / GRID, W / GRID) in metres."""
        return self.coarse_mm * np.float32(0.001)


def extract_features(gray: U8, depth_m: F32, intrinsics: F64, config: FeatureConfig) -> ViewFeatures:
    """Features of an image (H, W) with its depth (H, W) in metres, 0 = no reading; intrinsics fx fy cx cy in px."""
    orb = cv2.ORB.create(nfeatures=config.max_keypoints, fastThreshold=config.fast_threshold)
    keypoints, descriptors = orb.detectAndCompute(gray, None)
    coarse_mm = np.clip(np.rint(coarse_depth(depth_m) * 1000), 0, 65535).astype(np.uint16)
    if descriptors is None:
        empty = np.zeros((0, 2), np.float32), np.zeros((0, 3), np.float32), np.zeros((0, 32), np.uint8)
        return ViewFeatures(*empty, coarse_mm, intrinsics)
    uv = np.array([keypoint.pt for keypoint in keypoints], np.float32).reshape(-1, 2)
    inverse_depth = inverse_depth_at(depth_m, uv)
    z = np.where(inverse_depth > 0, 1 / np.where(inverse_depth > 0, inverse_depth, 1.0), np.nan)
    xyz = unproject(uv, z, intrinsics).astype(np.float32)
    return ViewFeatures(uv, xyz, np.asarray(descriptors, np.uint8), coarse_mm, intrinsics)


def match_views(reference: ViewFeatures, view: ViewFeatures, config: FeatureConfig) -> RegistrationResult | None:
    """Pose of a view in the camera frame of a reference; None unless they certainly show the same place."""
    reference_rows, view_rows = _match_descriptors(reference, view, config.lowe_ratio)
    has_depth = np.isfinite(reference.xyz[reference_rows, 2])
    reference_rows, view_rows = reference_rows[has_depth], view_rows[has_depth]
    if len(reference_rows) < config.min_inliers:
        return None
    fx, fy, cx, cy = view.intrinsics
    camera = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]])
    is_solved, turn, shift, inliers = cv2.solvePnPRansac(  # its seed is fixed
        reference.xyz[reference_rows].astype(float),
        view.uv[view_rows].astype(float),
        camera,
        None,
        iterationsCount=config.ransac_trials,
        reprojectionError=config.reprojection_px * 2 * cx / 640,
        confidence=0.999,
        flags=cv2.SOLVEPNP_EPNP,
    )
    if not is_solved or inliers is None or len(inliers) < config.min_inliers:
        return None
    view_from_reference = np.eye(4)
    view_from_reference[:3, :3], view_from_reference[:3, 3] = cv2.Rodrigues(turn)[0], shift.ravel()
    reference_rows, view_rows = reference_rows[inliers.ravel()], view_rows[inliers.ravel()]
    z = view.xyz[view_rows, 2].astype(float)
    inverse_depth = np.where(np.isfinite(z), 1 / np.where(np.isfinite(z), z, 1.0), 0.0)
    matches = PointMatches(reference.xyz[reference_rows].astype(float), view.uv[view_rows], inverse_depth)
    points = scan_points(view.coarse_m, view.intrinsics)
    surface_match = SurfaceMatch(points, reference.surface(config.surface), np.eye(4))
    result = register(matches, surface_match, view.intrinsics, inverse(view_from_reference), config.registration)
    if int(result.is_inlier.sum()) < config.min_inliers or result.overlap < config.min_overlap:
        return None
    return result


def _match_descriptors(a: ViewFeatures, b: ViewFeatures, max_ratio: float) -> tuple[I64, I64]:
    """Rows of a and b: each row of b with its nearest in a where that is far nearer than the second, each a once."""
    empty = np.zeros(0, np.int64)
    if len(a.uv) < 2 or len(b.uv) < 2:
        return empty, empty
    pairs = cv2.BFMatcher(cv2.NORM_HAMMING).knnMatch(b.descriptors, a.descriptors, k=2)
    nearest: dict[int, cv2.DMatch] = {}
    for first, second in pairs:
        if first.distance < max_ratio * second.distance:
            rival = nearest.get(first.trainIdx)
            if rival is None or first.distance < rival.distance:
                nearest[first.trainIdx] = first
    matches = [nearest[row] for row in sorted(nearest)]
    return np.array([m.trainIdx for m in matches], np.int64), np.array([m.queryIdx for m in matches], np.int64)
