"""Odometry of a data set that brings its own poses."""

from __future__ import annotations

import numpy as np

from placegraph.nodes.pose.odometry import PoseEstimate
from placegraph.runtime.arrays import F32
from placegraph.runtime.messages import Frame
from placegraph.runtime.vision.geometry import is_rigid


class GivenPoses:
    """The poses of the source; the start frame is the source's world."""

    def estimate(self, frame: Frame, depth_m: F32) -> PoseEstimate:
        """The frame's given pose; not trusted where the source has none."""
        if not is_rigid(frame.given_world_from_camera):
            return PoseEstimate(np.eye(4), "the source has no pose for this frame")
        return PoseEstimate(frame.given_world_from_camera, quality=1.0)
