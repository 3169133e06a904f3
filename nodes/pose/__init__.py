"""Node `pose`: frames to camera poses in a world with z up, each with a judgement whether to trust it."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np
from pydantic import Field

from placegraph.nodes.pose import gravity
from placegraph.nodes.pose.given_poses import GivenPoses
from placegraph.nodes.pose.kiss_icp import KissIcpConfig, KissIcpOdometry
from placegraph.nodes.pose.odometry import DepthPointsConfig, Odometry, depth_points
from placegraph.nodes.pose.rgbd_odometry import RgbdOdometry, RgbdOdometryConfig
from placegraph.runtime.arrays import F32, F64
from placegraph.runtime.messages import End, Frame, Message, Pose
from placegraph.runtime.node import Context, Node

logger = logging.getLogger(__name__)


class PoseConfig(DepthPointsConfig):
    """How poses are estimated; each method has a table of settings of its own."""

    # rgbd: by colour and depth; kiss_icp: by shape alone, also in the dark; given: the poses of the data set
    method: Literal["rgbd", "kiss_icp", "given"] = "rgbd"
    rgbd: RgbdOdometryConfig = RgbdOdometryConfig()
    kiss_icp: KissIcpConfig = KissIcpConfig()
    mount_roll_deg: Literal[0, 90, 180, 270] = 0  # by how much the camera is turned about its axis, clockwise
    gravity_frames: int = Field(default=10, ge=1)  # frames that decide which way is up, when the source does not know


class PoseNode(Node):
    """Gives one Pose for each Frame, in a world with z up; the first `gravity_frames` wait until up is known."""

    config_type = PoseConfig
    inputs = (Frame, End)
    outputs = (Pose,)
    config: PoseConfig

    def __init__(self, config: PoseConfig, context: Context) -> None:
        super().__init__(config, context)
        self._odometry: Odometry
        match config.method:
            case "rgbd":
                self._odometry = RgbdOdometry(config.rgbd)
            case "kiss_icp":
                self._odometry = KissIcpOdometry(config.kiss_icp, config, context.threads)
            case "given":
                self._odometry = GivenPoses()
        self._waiting: list[tuple[Pose, F64, F32]] = []  # until up is known: poses in the start frame, samples for up
        self._world_from_start: F64 | None = None

    def step(self, message: Message) -> Sequence[Message]:
        """Estimate the pose of a frame."""
        if isinstance(message, End):
            return self._release()
        assert isinstance(message, Frame)
        depth_m = message.depth_m
        pose = self._odometry.estimate(message, depth_m).as_message(message)
        if self._world_from_start is not None:
            return [_transformed(pose, self._world_from_start)]
        self._waiting.append((pose, message.up_camera, depth_points(depth_m, message.intrinsics, self.config)))
        return self._release() if len(self._waiting) >= self.config.gravity_frames else []

    def _release(self) -> list[Message]:
        """Estimate which way is up from the frames so far, and give their poses."""
        waiting, self._waiting = self._waiting, []
        samples = [(pose.world_from_camera, up, points) for pose, up, points in waiting if pose.trusted]
        if not samples:  # still dark: later frames decide which way is up
            return [pose for pose, _, _ in waiting]
        if self._world_from_start is None:
            up = gravity.estimate_up(samples, self.config.seed, np.deg2rad(self.config.mount_roll_deg))
            logger.info("up is %s in the start frame, from %s", np.round(up.up, 3).tolist(), up.source)
            if not up.reliable:
                logger.warning("no way to tell which way is up: the map may be tilted")
            self._world_from_start = gravity.world_from_start(up.up)
        return [_transformed(pose, self._world_from_start) for pose, _, _ in waiting]


def _transformed(pose: Pose, world_from_start: F64) -> Pose:
    return replace(pose, world_from_camera=world_from_start @ pose.world_from_camera)


NODE = PoseNode
