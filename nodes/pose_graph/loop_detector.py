"""Which earlier keyframes show the place of a new one, and where they say it was taken from.

Candidates come from the poses (near, looking the same way, by what odometry may have drifted) and, for loops longer
than that, from the layout of colours. Each is verified by its keypoints and by laying the views' surfaces onto each
other (runtime/vision/features.py).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import cv2
import numpy as np
from pydantic import BaseModel, Field

from placegraph.runtime.arrays import F32, F64, U8
from placegraph.runtime.messages import Keyframe
from placegraph.runtime.vision.features import FeatureConfig, Features, describe, relate
from placegraph.runtime.vision.geometry import inverse
from placegraph.runtime.vision.registration import Registered, logarithm

LAYOUT = (8, 6)  # cells of the colour layout, columns and rows


class LoopConfig(BaseModel, frozen=True, strict=True, extra="forbid"):
    """Where to look for loops."""

    still_m: float = 0.03  # a keyframe that moved less than this and turned less than that since the last one that was
    still_rad: float = 0.03  # remembered is not: a robot that stands for a night fills no memory
    skip: int = Field(default=3, ge=1)  # the last so many keyframes are odometry's own
    reach_m: float = 1.5  # between positions of two views that can be matched
    drift_share: float = 0.01  # ... and so much more for every metre walked since
    turn_rad: float = 0.8  # between viewing directions
    tries: int = Field(default=4, ge=1)  # candidates that are verified for each keyframe, by their poses
    apart: int = 5  # keyframes between two candidates
    # a place that looks like another, a few steps away, is told by how far odometry can be wrong by then
    surprise_m: float = 0.1
    surprise_rad: float = 0.05
    surprise_share: float = 0.05  # more for each metre walked between the two views, in metres and in rad
    tries_by_look: int = 1  # ... and by the layout of colours, wherever they are
    min_likeness: float = 0.9  # of layouts: their correlation
    features: FeatureConfig = FeatureConfig()


@dataclass(frozen=True, eq=False)
class Loop:
    """A verified motion (4, 4) from keyframe number `second` to `first`."""

    first: int
    second: int
    first_from_second: F64


@dataclass(eq=False)
class Places:
    """All keyframes so far, by number, as what is needed to recognise them."""

    config: LoopConfig
    features: list[Features | None] = field(default_factory=list)  # None: not remembered
    layouts: list[F32] = field(default_factory=list)
    _last: F64 | None = None  # pose of the last one that was remembered

    def add(self, keyframe: Keyframe, world_from_camera: F64) -> Features | None:
        """Remember a keyframe at its pose (4, 4); None when it stands where the last one that was remembered did."""
        if self._last is not None:
            off = logarithm(inverse(self._last) @ world_from_camera)
            if np.linalg.norm(off[:3]) < self.config.still_m and np.linalg.norm(off[3:]) < self.config.still_rad:
                self.features.append(None)
                self.layouts.append(np.zeros_like(self.layouts[-1]))
                return None
        self._last = world_from_camera
        depth_m = keyframe.depth_m
        gray = np.asarray(cv2.cvtColor(keyframe.color, cv2.COLOR_RGB2GRAY), np.uint8)
        seen = describe(gray, depth_m, keyframe.intrinsics, self.config.features)
        self.features.append(seen)
        self.layouts.append(_layout(keyframe.color))
        return seen

    def loops(self, poses: F64, walked_m: F64) -> list[Loop]:
        """Loops of the newest keyframe with earlier ones.

        poses: (K, 4, 4) world_from_camera of all; walked_m: (K,) path length at each.
        """
        new, seen, found = len(poses) - 1, self.features[-1], []
        near = self._near(poses, walked_m)
        for old in [*near, *self._alike(near)]:
            known = self.features[old]
            pose = relate(known, seen, self.config.features) if known and seen else None
            if pose is None:
                continue
            if self._is_likely(inverse(poses[old]) @ poses[new], pose, walked_m[new] - walked_m[old]):
                found.append(Loop(old, new, pose.reference_from_camera))
        return found

    def _is_likely(self, expected: F64, found: Registered, walked_m: float) -> bool:
        c, off = self.config, logarithm(inverse(expected) @ found.reference_from_camera)
        more = c.surprise_share * walked_m
        return bool(np.linalg.norm(off[:3]) < c.surprise_m + more and np.linalg.norm(off[3:]) < c.surprise_rad + more)

    def _near(self, poses: F64, walked_m: F64) -> list[int]:
        c, new = self.config, len(poses) - 1
        old = poses[: max(0, new - c.skip + 1)]
        if not len(old):
            return []
        apart_m = np.linalg.norm(old[:, :3, 3] - poses[new, :3, 3], axis=1)
        angle = np.arccos(np.clip(old[:, :3, 2] @ poses[new, :3, 2], -1, 1))
        drift_m = c.drift_share * (walked_m[new] - walked_m[: len(old)])
        cost = np.maximum(apart_m - drift_m, 0) / c.reach_m + angle / c.turn_rad
        remembered = np.array([one is not None for one in self.features[: len(old)]])
        possible = remembered & (apart_m < c.reach_m + drift_m) & (angle < c.turn_rad)
        chosen: list[int] = []
        for i in np.argsort(cost, kind="stable").tolist():
            if len(chosen) == c.tries:
                break
            if possible[i] and all(abs(i - j) >= c.apart for j in chosen):
                chosen.append(i)
        return chosen

    def _alike(self, known: list[int]) -> list[int]:
        c, new = self.config, len(self.layouts) - 1
        old = max(0, new - c.skip + 1)
        if not old or not c.tries_by_look:
            return []
        likeness = np.array(self.layouts[:old]) @ self.layouts[new]
        best = [i for i in np.argsort(-likeness, kind="stable").tolist() if all(abs(i - j) >= c.apart for j in known)]
        return [i for i in best[: c.tries_by_look] if likeness[i] >= c.min_likeness]


def _layout(color: U8) -> F32:
    """Unit vector of an image's coarse colours, without their mean: brightness changes from view to view."""
    small = cv2.resize(cv2.cvtColor(color, cv2.COLOR_RGB2LAB), LAYOUT, interpolation=cv2.INTER_AREA).astype(np.float32)
    centred = (small - small.mean(axis=(0, 1))).ravel()
    return np.asarray(centred / max(float(np.linalg.norm(centred)), 1e-6), np.float32)
