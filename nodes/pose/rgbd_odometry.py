"""Odometry by colour and depth that judges each frame: its pose is trusted, coasting, or lost.

A frame is trusted when enough of what is tracked agrees on its pose. Through a few frames where too little agrees (a
bare wall, a fast turn) the predicted motion is continued, corrected by the surface alone: the camera coasts. After
coasting for too long, or when a frame shows a different place altogether (the camera was carried), the camera is lost
until one of the remembered views is recognised (relocalization.py).
"""

from __future__ import annotations

import cv2
import numpy as np
from pydantic import BaseModel, Field

from placegraph.nodes.pose.feature_tracker import FeatureTracker, FeatureTrackerConfig, RgbdView, TrackedView
from placegraph.nodes.pose.motion_model import extrapolate_motion
from placegraph.nodes.pose.odometry import PoseEstimate
from placegraph.nodes.pose.relocalization import RelocalizationConfig, Relocalizer
from placegraph.runtime.arrays import F32, F64
from placegraph.runtime.messages import Frame
from placegraph.runtime.vision.geometry import inverse, nearest_rigid

MIN_DEPTH_CELLS = 300  # cells of coarse depth; with fewer the camera is covered and the surface says nothing


class RgbdOdometryConfig(BaseModel, frozen=True, strict=True, extra="forbid"):
    """When a pose is trusted: chosen so that every wrong pose of the house walks at 10 and 3.3 Hz is reported."""

    min_inliers: int = Field(default=20, ge=6)  # corners and patches that agree
    min_inlier_share: float = Field(default=0.15, gt=0)  # of those tracked
    max_coasting_s: float = Field(default=1.0, ge=0)
    # With fewer inliers than above and less overlap with the reference's surface than this, the frame shows another
    # place. On bare walls and in fast turns of those walks the overlap was .43 at least.
    min_overlap: float = Field(default=0.35, ge=0, le=1)
    track: FeatureTrackerConfig = FeatureTrackerConfig()
    relocalization: RelocalizationConfig = RelocalizationConfig()


class RgbdOdometry:
    """Poses of successive views in the start frame, that of the first camera."""

    def __init__(self, config: RgbdOdometryConfig) -> None:
        self._config = config
        self._tracker = FeatureTracker(config.track)
        self._relocalizer = Relocalizer(config.relocalization)
        self._pose = np.eye(4)
        self._delta = np.eye(4)  # the last motion
        self._delta_span_ns = 0  # time between the two frames of `_delta`
        self._stamp_ns: int | None = None
        self._coasting_since_ns: int | None = None  # stamp of the last trusted frame; None while frames are trusted
        self._has_started = self._is_lost = False

    def estimate(self, frame: Frame, depth_m: F32) -> PoseEstimate:
        """The pose of the next frame."""
        gray = np.asarray(cv2.cvtColor(frame.color, cv2.COLOR_RGB2GRAY), np.uint8)
        return self.register(
            RgbdView(gray, depth_m, frame.intrinsics, self._config.relocalization.features), frame.stamp_ns
        )

    def register(self, view: RgbdView, stamp_ns: int) -> PoseEstimate:
        """The pose of the next view."""
        last_ns, self._stamp_ns = self._stamp_ns, stamp_ns
        if not self._has_started:
            return self._start(view)
        assert last_ns is not None
        if self._is_lost or self._has_coasted_too_long(stamp_ns):
            return self._relocalize(view)
        span_ns = stamp_ns - last_ns
        guess = nearest_rigid(self._pose @ extrapolate_motion(self._delta, span_ns, self._delta_span_ns))
        tracked = self._tracker.track(view, guess)
        if tracked.inliers >= self._config.min_inliers and tracked.inlier_share >= self._config.min_inlier_share:
            reason = ""
            self._follow(view, tracked, span_ns)
        else:
            reason = f"{tracked.inliers} of the tracked corners agree ({tracked.inlier_share:.0%})"
            is_covered = np.count_nonzero(view.coarse_m) < MIN_DEPTH_CELLS
            if tracked.overlap < self._config.min_overlap and not is_covered:
                return self._relocalize(view)
            self._coasting_since_ns = last_ns if self._coasting_since_ns is None else self._coasting_since_ns
            self._move_to(tracked.start_from_camera, span_ns)
            if not is_covered:
                self._tracker.add_view(view, self._pose, tracked)
        innovation_m = float(np.linalg.norm((inverse(guess) @ tracked.start_from_camera)[:3, 3]))
        return PoseEstimate(self._pose, reason, quality=tracked.inlier_share, innovation_m=innovation_m)

    def _start(self, view: RgbdView) -> PoseEstimate:
        self._tracker.add_view(view, self._pose)
        if len(self._tracker) < self._config.min_inliers:
            return PoseEstimate(self._pose, f"{len(self._tracker)} corners with depth to begin with")
        self._has_started = True
        self._relocalizer.remember(view, self._pose)
        return PoseEstimate(self._pose, quality=1.0)

    def _follow(self, view: RgbdView, tracked: TrackedView, span_ns: int) -> None:
        """Move to a trusted pose; after coasting, perhaps astray, to that of a view that is recognised."""
        recognized = None
        if self._coasting_since_ns is not None:
            self._coasting_since_ns = None
            recognized = self._relocalizer.match_newest(view)
        self._move_to(tracked.start_from_camera, span_ns)
        if recognized is not None:
            self._pose = recognized
            self._tracker.add_view(view, recognized)
        elif self._tracker.add_view(view, self._pose, tracked):
            self._relocalizer.remember(view, self._pose)

    def _has_coasted_too_long(self, stamp_ns: int) -> bool:
        since_ns = self._coasting_since_ns
        return since_ns is not None and (stamp_ns - since_ns) * 1e-9 > self._config.max_coasting_s

    def _relocalize(self, view: RgbdView) -> PoseEstimate:
        """Go on at the pose of a remembered view, if one is recognised; else the camera stays lost."""
        self._is_lost = True
        pose = self._relocalizer.relocalize(view)
        if pose is None:
            return PoseEstimate(self._pose, "lost: no place seen before is recognised")
        jump_m = float(np.linalg.norm(pose[:3, 3] - self._pose[:3, 3]))
        self._pose, self._delta, self._delta_span_ns = pose, np.eye(4), 0
        self._coasting_since_ns, self._is_lost = None, False
        self._tracker.add_view(view, pose)
        return PoseEstimate(pose, quality=1.0, innovation_m=jump_m)

    def _move_to(self, pose: F64, span_ns: int) -> None:
        self._delta, self._pose, self._delta_span_ns = inverse(self._pose) @ pose, pose, span_ns
