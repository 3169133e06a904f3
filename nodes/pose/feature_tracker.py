"""Track corners from image to image, and register each image to their landmarks and to a reference view's surface.

A landmark is a corner with a position in the start frame: the mean over the views that showed it. Where few corners
agree, large image patches of the last view are matched, too. Source: ours, after visual odometry (Nister 2004),
Lucas-Kanade tracking and KinectFusion's surface. Not KISS-ICP alone, because a method that uses only shape slides along
walls and drifts on a stereo camera's depth (docs/results.md).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from pydantic import BaseModel, Field

from placegraph.runtime.arrays import F32, F64, I64, U8, Bool
from placegraph.runtime.vision.features import FeatureConfig, ViewFeatures, extract_features
from placegraph.runtime.vision.geometry import transform
from placegraph.runtime.vision.point_to_plane import SurfaceConfig, SurfaceMap, coarse_depth, scan_points
from placegraph.runtime.vision.registration import (
    PointMatches,
    RegistrationConfig,
    RegistrationResult,
    SurfaceMatch,
    inverse_depth_at,
    project,
    register,
    unproject,
)


class FeatureTrackerConfig(BaseModel, frozen=True, strict=True, extra="forbid"):
    """Corner distance and patch size hold for an image 640 px wide and scale with it; search windows do not."""

    max_corners: int = Field(default=400, ge=20)
    corner_distance_px: float = 14.0
    corner_quality: float = 0.005  # of the strongest corner
    window_px: int = 21  # Lucas-Kanade
    pyramid_levels: int = 3
    max_forward_backward_px: float = 1.0  # a corner tracked back must end this near to where it started
    min_corner_inliers: int = 80  # with fewer, patches are matched, too
    patch_px: int = 50
    motion_sigma_m: float = 0.03  # difference between the motions of two successive frames
    turn_sigma_rad: float = 0.02
    min_reference_overlap: float = 0.6  # with less overlap, a view becomes the next reference
    registration: RegistrationConfig = RegistrationConfig()
    surface: SurfaceConfig = SurfaceConfig()


@dataclass(frozen=True, eq=False)
class RgbdView:
    """One image: gray (H, W), depth (H, W) in metres with 0 = no reading, intrinsics fx fy cx cy in px."""

    gray: U8
    depth_m: F32
    intrinsics: F64
    feature_config: FeatureConfig

    @cached_property
    def coarse_m(self) -> F32:
        """Depth on the grid of surfaces, see `coarse_depth`."""
        return coarse_depth(self.depth_m)

    @cached_property
    def features(self) -> ViewFeatures:
        """ORB features, computed for the few views that are remembered or compared with remembered ones."""
        return extract_features(self.gray, self.depth_m, self.intrinsics, self.feature_config)


@dataclass(frozen=True, eq=False)
class TrackedView:
    """A view's pose (4, 4) start_from_camera and what agrees with it."""

    start_from_camera: F64
    inliers: int  # corners and patches
    inlier_share: float  # of those tracked
    overlap: float  # share of the view's points that lie on the reference's surface
    uv: F32  # (N, 2) px of the landmarks that agree
    landmarks: I64  # (N,) their indices


class FeatureTracker:
    """Landmarks and where the last view showed them. `track` finds a view's pose; `add_view` takes it as the last."""

    def __init__(self, config: FeatureTrackerConfig) -> None:
        self._config = config
        self._last: tuple[RgbdView, F64] | None = None  # with its pose
        self._reference: tuple[SurfaceMap, F64] | None = None
        self._uv = np.zeros((0, 2), np.float32)
        self._xyz = np.zeros((0, 3))  # metres, start frame
        self._information = np.zeros(0)  # of the position: sum of 1 / depth^4 over views

    def __len__(self) -> int:
        return len(self._uv)

    def track(self, view: RgbdView, guess: F64) -> TrackedView:
        """The pose of a view, near the predicted `guess` (4, 4) start_from_camera."""
        uv, is_tracked = self._track_corners(view, guess)
        corners = PointMatches(self._xyz[is_tracked], uv[is_tracked], inverse_depth_at(view.depth_m, uv[is_tracked]))
        surface_match = self._reference and SurfaceMatch(scan_points(view.coarse_m, view.intrinsics), *self._reference)
        result = self._register(corners, surface_match, view, guess)
        if result.is_inlier.sum() < self._config.min_corner_inliers:
            matches = corners.joined_with(self._match_patches(view, guess))
            result = self._register(matches, surface_match, view, guess)
        is_inlier = result.is_inlier[: len(corners)]
        return TrackedView(
            start_from_camera=result.reference_from_camera,
            inliers=int(result.is_inlier.sum()),
            inlier_share=float(result.is_inlier.mean()) if len(result.is_inlier) else 0.0,
            overlap=result.overlap,
            uv=uv[is_tracked][is_inlier],
            landmarks=np.flatnonzero(is_tracked)[is_inlier],
        )

    def add_view(self, view: RgbdView, start_from_camera: F64, tracked: TrackedView | None = None) -> bool:
        """Take a view at its pose as the last one; returns whether it has become the reference.

        Landmarks that are not in `tracked` are forgotten; without it, all are.
        """
        self._uv, kept = (tracked.uv, tracked.landmarks) if tracked else (self._uv[:0], np.zeros(0, np.int64))
        self._xyz, self._information = self._xyz[kept], self._information[kept]
        self._update_landmarks(view, start_from_camera)
        self._add_landmarks(view, start_from_camera)
        self._last = view, start_from_camera
        if tracked is not None and tracked.overlap >= self._config.min_reference_overlap:
            return False
        self._reference = SurfaceMap(view.coarse_m, view.intrinsics, self._config.surface), start_from_camera
        return True

    def _register(
        self, matches: PointMatches, surface_match: SurfaceMatch | None, view: RgbdView, guess: F64
    ) -> RegistrationResult:
        sigmas = self._config.motion_sigma_m, self._config.turn_sigma_rad
        return register(matches, surface_match, view.intrinsics, guess, self._config.registration, sigmas)

    def _track_corners(self, view: RgbdView, guess: F64) -> tuple[F32, Bool]:
        if self._last is None or self._last[0].gray.shape != view.gray.shape or not len(self._uv):
            return self._uv, np.zeros(len(self._uv), bool)
        expected = project(self._xyz, view.intrinsics, guess)
        start = np.where(np.isfinite(expected), expected, self._uv).astype(np.float32)
        return _track_points(self._last[0].gray, view.gray, self._uv, start, self._config.window_px, self._config)

    def _match_patches(self, view: RgbdView, guess: F64) -> PointMatches:
        """Patches of the last view, on a grid, found in this one: a bare wall has shading but no corners."""
        if self._last is None or self._last[0].gray.shape != view.gray.shape:
            return PointMatches(np.zeros((0, 3)), np.zeros((0, 2), np.float32), np.zeros(0))
        last, pose = self._last
        height, width = view.gray.shape
        side = max(8, round(self._config.patch_px * width / 640))  # half of it is the least window that OpenCV takes
        v, u = np.mgrid[side // 2 : height : side, side // 2 : width : side]
        uv, z, xyz = _with_depth(np.stack((u.ravel(), v.ravel()), axis=1).astype(np.float32), last, pose)
        if not len(uv):
            return PointMatches(xyz, uv, z)
        expected = project(xyz, view.intrinsics, guess)
        start = np.where(np.isfinite(expected), expected, uv).astype(np.float32) / np.float32(2)
        before, after = _normalized_shading(last.gray), _normalized_shading(view.gray)
        half_uv, is_tracked = _track_points(before, after, uv / np.float32(2), start, side // 2, self._config)
        view_uv = half_uv[is_tracked] * np.float32(2)
        return PointMatches(xyz[is_tracked], view_uv, inverse_depth_at(view.depth_m, view_uv))

    def _update_landmarks(self, view: RgbdView, start_from_camera: F64) -> None:
        inverse_depth = inverse_depth_at(view.depth_m, self._uv)
        seen = inverse_depth > 1 / self._config.surface.max_depth_m
        z = 1 / inverse_depth[seen]
        xyz = transform(start_from_camera, unproject(self._uv[seen], z, view.intrinsics))
        total = self._information[seen] + z**-4.0
        self._xyz[seen] += (xyz - self._xyz[seen]) * (z**-4.0 / total)[:, None]
        self._information[seen] = total

    def _add_landmarks(self, view: RgbdView, start_from_camera: F64) -> None:
        c = self._config
        missing = c.max_corners - len(self._uv)
        if missing <= 0:
            return
        free = ((view.depth_m > 0) & (view.depth_m < c.surface.max_depth_m)).astype(np.uint8) * np.uint8(255)
        distance = max(2.0, c.corner_distance_px * view.gray.shape[1] / 640)
        for u, v in self._uv.tolist():
            cv2.circle(free, (round(u), round(v)), round(distance), 0, -1)
        corners = cv2.goodFeaturesToTrack(view.gray, missing, c.corner_quality, distance, mask=free)
        if corners is None:
            return
        uv, z, xyz = _with_depth(corners.reshape(-1, 2).astype(np.float32), view, start_from_camera)
        self._uv, self._xyz = np.concatenate((self._uv, uv)), np.concatenate((self._xyz, xyz))
        self._information = np.concatenate((self._information, z**-4.0))


def _with_depth(uv: F32, view: RgbdView, start_from_camera: F64) -> tuple[F32, F64, F64]:
    """Those of pixels (N, 2) that have depth, their depths (M,) in metres and points (M, 3) in the start frame."""
    inverse_depth = inverse_depth_at(view.depth_m, uv)
    uv, z = uv[inverse_depth > 0], 1 / inverse_depth[inverse_depth > 0]
    return uv, z, transform(start_from_camera, unproject(uv, z, view.intrinsics))


def _track_points(
    before: U8, after: U8, uv: F32, start: F32, window_px: int, config: FeatureTrackerConfig
) -> tuple[F32, Bool]:
    """Where points (N, 2) of one image are in the next, searched from `start`, and which of them track back."""

    def optical_flow(a: U8, b: U8, from_uv: F32, to_uv: F32) -> tuple[F32, Bool]:
        uv, status, _ = cv2.calcOpticalFlowPyrLK(
            a,
            b,
            from_uv,
            to_uv.copy(),
            winSize=(window_px, window_px),
            maxLevel=config.pyramid_levels,
            flags=cv2.OPTFLOW_USE_INITIAL_FLOW,
        )
        return np.asarray(uv, np.float32), np.asarray(status).ravel() == 1

    forward, is_forward = optical_flow(before, after, uv, start)
    backward, is_backward = optical_flow(after, before, forward, uv)
    height, width = after.shape
    is_inside = (forward >= 0).all(axis=1) & (forward[:, 0] <= width - 1) & (forward[:, 1] <= height - 1)
    is_near = np.linalg.norm(backward - uv, axis=1) <= config.max_forward_backward_px
    return forward, is_forward & is_backward & is_inside & is_near


def _normalized_shading(gray: U8) -> U8:
    """The image at half size without grain and without slow changes, divided by the contrast around each pixel.

    Otherwise a lens's vignette, which does not move, would dominate a moving bare wall.
    """
    small = cv2.resize(gray, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA).astype(np.float32)
    high = cv2.GaussianBlur(small, (0, 0), 1.0) - cv2.GaussianBlur(small, (0, 0), 15.0)
    deviation = np.sqrt(cv2.GaussianBlur(high * high, (0, 0), 15.0)) + 0.5
    return np.asarray(np.clip(128 + 40 * high / deviation, 0, 255), np.uint8)
