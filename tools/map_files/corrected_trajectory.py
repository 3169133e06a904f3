"""Poses as the pose graph corrected them."""

from __future__ import annotations

import dataclasses
from bisect import bisect_right
from collections.abc import Sequence

from placegraph.runtime.arrays import F64
from placegraph.runtime.messages import Correction, Pose
from placegraph.runtime.vision.geometry import inverse, nearest_rigid


class CorrectedKeyframes:
    """Where the pose graph has each keyframe, by frame id, as its Corrections come in."""

    def __init__(self) -> None:
        self._poses: dict[int, F64] = {}

    def add(self, correction: Correction) -> None:
        """Take the keyframe's own pose, and the new ones of those that moved."""
        self._poses[correction.frame_id] = correction.world_from_camera
        moved = zip(correction.moved_frame_ids.tolist(), correction.moved_world_from_camera, strict=True)
        self._poses.update(moved)

    def correct(self, poses: Sequence[Pose]) -> list[Pose]:
        """Odometry's poses, each moved with the last keyframe at or before it; as they are where there is none."""
        odometry = {pose.frame_id: pose.world_from_camera for pose in poses}
        known = sorted(frame_id for frame_id in self._poses if frame_id in odometry)
        if not known:
            return list(poses)
        found = []
        for pose in poses:
            key = known[max(0, bisect_right(known, pose.frame_id) - 1)]
            moved = self._poses[key] @ inverse(odometry[key]) @ pose.world_from_camera
            found.append(dataclasses.replace(pose, world_from_camera=nearest_rigid(moved)))
        return found
