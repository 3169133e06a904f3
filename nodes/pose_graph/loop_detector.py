"""Which earlier keyframes show the same place as a new one, and the motion between them.

Candidates come from the poses (near, looking the same way, as far as odometry may have drifted) and, for longer loops,
from the layout of colours. Each is verified by its keypoints and by registering the surfaces of both views
(runtime/vision/features.py).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import cv2
import numpy as np
from pydantic import BaseModel, Field

from placegraph.runtime.arrays import F32, F64, U8
from placegraph.runtime.messages import Keyframe
from placegraph.runtime.vision.features import FeatureConfig, ViewFeatures, extract_features, match_views
from placegraph.runtime.vision.geometry import inverse
from placegraph.runtime.vision.registration import is_within

LAYOUT_SIZE = (8, 6)  # cells of the colour layout, columns and rows


class LoopDetectorConfig(BaseModel, frozen=True, strict=True, extra="forbid"):
    """Where to look for loops, and which to believe."""

    # A keyframe that moved and turned less than this since the last remembered one is not remembered: a robot that
    # stands still for a night must not fill the memory.
    min_motion_m: float = 0.03
    min_turn_rad: float = 0.03
    skip_newest: int = Field(default=3, ge=1)  # keyframes, which odometry has registered to each other already
    max_distance_m: float = 1.5  # between the positions of two views that can be matched
    drift_share: float = 0.01  # of the distance travelled since; added to max_distance_m
    max_angle_rad: float = 0.8  # between viewing directions
    max_candidates: int = Field(default=4, ge=1)  # chosen by their poses, for each keyframe
    min_candidate_gap: int = 5  # keyframes between two candidates
    # A place a few steps away may look the same. So a loop is refused when it differs from the poses by more than the
    # possible error of odometry: these values, plus a share of the distance travelled, in metres and in rad.
    max_deviation_m: float = 0.1
    max_deviation_rad: float = 0.05
    deviation_share: float = 0.05
    max_layout_candidates: int = 1  # chosen by the layout of colours, whatever their poses
    min_layout_correlation: float = 0.9
    features: FeatureConfig = FeatureConfig()


@dataclass(frozen=True, eq=False)
class Loop:
    """A verified motion (4, 4) from keyframe number `second` to `first`."""

    first: int
    second: int
    first_from_second: F64


@dataclass(eq=False)
class LoopDetector:
    """What is remembered of all keyframes so far, by their number."""

    config: LoopDetectorConfig
    features: list[ViewFeatures | None] = field(default_factory=list)  # None: not remembered
    layouts: list[F32] = field(default_factory=list)
    _last_pose: F64 | None = None  # of the last remembered keyframe

    def add(self, keyframe: Keyframe, world_from_camera: F64) -> ViewFeatures | None:
        """Remember a keyframe at its pose (4, 4); None when it stands where the last remembered one did."""
        c = self.config
        if self._last_pose is not None and is_within(
            inverse(self._last_pose) @ world_from_camera, c.min_motion_m, c.min_turn_rad
        ):
            self.features.append(None)
            self.layouts.append(np.zeros_like(self.layouts[-1]))
            return None
        self._last_pose = world_from_camera
        depth_m = keyframe.depth_m
        gray = np.asarray(cv2.cvtColor(keyframe.color, cv2.COLOR_RGB2GRAY), np.uint8)
        features = extract_features(gray, depth_m, keyframe.intrinsics, c.features)
        self.features.append(features)
        self.layouts.append(_color_layout(keyframe.color))
        return features

    def find_loops(self, poses: F64, travelled_m: F64) -> list[Loop]:
        """Loops of the newest keyframe with earlier ones.

        poses: (K, 4, 4) world_from_camera of all keyframes; travelled_m: (K,) path length at each.
        """
        c, new, view, loops = self.config, len(poses) - 1, self.features[-1], []
        near = self._candidates_by_pose(poses, travelled_m)
        for old in [*near, *self._candidates_by_layout(near)]:
            reference = self.features[old]
            match = match_views(reference, view, c.features) if reference and view else None
            if match is None:
                continue
            deviation = inverse(poses[new]) @ poses[old] @ match.reference_from_camera
            drift = c.deviation_share * (travelled_m[new] - travelled_m[old])
            if is_within(deviation, c.max_deviation_m + drift, c.max_deviation_rad + drift):
                loops.append(Loop(old, new, match.reference_from_camera))
        return loops

    def _candidates_by_pose(self, poses: F64, travelled_m: F64) -> list[int]:
        c, new = self.config, len(poses) - 1
        old = poses[: max(0, new - c.skip_newest + 1)]
        if not len(old):
            return []
        distance_m = np.linalg.norm(old[:, :3, 3] - poses[new, :3, 3], axis=1)
        angle = np.arccos(np.clip(old[:, :3, 2] @ poses[new, :3, 2], -1, 1))
        drift_m = c.drift_share * (travelled_m[new] - travelled_m[: len(old)])
        cost = np.maximum(distance_m - drift_m, 0) / c.max_distance_m + angle / c.max_angle_rad
        is_remembered = np.array([features is not None for features in self.features[: len(old)]])
        is_possible = is_remembered & (distance_m < c.max_distance_m + drift_m) & (angle < c.max_angle_rad)
        candidates: list[int] = []
        for i in np.argsort(cost, kind="stable").tolist():
            if len(candidates) == c.max_candidates:
                break
            if is_possible[i] and self._is_apart(i, candidates):
                candidates.append(i)
        return candidates

    def _candidates_by_layout(self, candidates_by_pose: list[int]) -> list[int]:
        c, new = self.config, len(self.layouts) - 1
        old = max(0, new - c.skip_newest + 1)
        if not old or not c.max_layout_candidates:
            return []
        correlation = np.array(self.layouts[:old]) @ self.layouts[new]
        order = np.argsort(-correlation, kind="stable").tolist()
        best = [i for i in order if self._is_apart(i, candidates_by_pose)][: c.max_layout_candidates]
        return [i for i in best if correlation[i] >= c.min_layout_correlation]

    def _is_apart(self, number: int, candidates: list[int]) -> bool:
        return all(abs(number - candidate) >= self.config.min_candidate_gap for candidate in candidates)


def _color_layout(color: U8) -> F32:
    """Unit vector of an image's coarse colours; without their mean, because brightness changes from view to view."""
    lab = cv2.cvtColor(color, cv2.COLOR_RGB2LAB)
    small = cv2.resize(lab, LAYOUT_SIZE, interpolation=cv2.INTER_AREA).astype(np.float32)
    centered = (small - small.mean(axis=(0, 1))).ravel()
    return np.asarray(centered / max(float(np.linalg.norm(centered)), 1e-6), np.float32)
