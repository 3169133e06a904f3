"""The poses of odometry, corrected by the pose graph."""

from __future__ import annotations

import dataclasses
from bisect import bisect_right
from collections.abc import Sequence

from placegraph.runtime.arrays import F64
from placegraph.runtime.messages import Correction, Pose
from placegraph.runtime.vision.geometry import inverse, nearest_rigid


class CorrectedTrajectory:
    """Keeps the corrected pose of each keyframe, and moves the other frames with them."""

    def __init__(self) -> None:
        self._keyframes: dict[int, F64] = {}  # world_from_camera (4, 4) by frame id

    def add(self, correction: Correction) -> None:
        """Take the keyframe's pose, and the new poses of the keyframes that moved."""
        self._keyframes[correction.frame_id] = correction.world_from_camera
        moved = zip(correction.moved_frame_ids.tolist(), correction.moved_world_from_camera, strict=True)
        self._keyframes.update(moved)

    def correct(self, poses: Sequence[Pose]) -> list[Pose]:
        """Poses, each moved with the last keyframe at or before it; unchanged without any keyframe."""
        odometry = {pose.frame_id: pose.world_from_camera for pose in poses}
        keyframe_ids = sorted(frame_id for frame_id in self._keyframes if frame_id in odometry)
        if not keyframe_ids:
            return list(poses)
        corrected = []
        for pose in poses:
            key = keyframe_ids[max(0, bisect_right(keyframe_ids, pose.frame_id) - 1)]
            moved = self._keyframes[key] @ inverse(odometry[key]) @ pose.world_from_camera
            corrected.append(dataclasses.replace(pose, world_from_camera=nearest_rigid(moved)))
        return corrected
