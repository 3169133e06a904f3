"""Odometry in a world with z up, and a judgement whether to believe it."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from typing import Any, Literal

import cv2
import numpy as np
from pydantic import Field

from placegraph.nodes.pose import gravity
from placegraph.nodes.pose.feature_tracker import View
from placegraph.nodes.pose.kiss_icp import Odometry, OdometryConfig
from placegraph.nodes.pose.rgbd_odometry import RgbdConfig, RgbdOdometry
from placegraph.runtime.arrays import F32, F64
from placegraph.runtime.messages import End, Frame, Message, Pose
from placegraph.runtime.node import Context, Node
from placegraph.runtime.vision.geometry import backproject, is_rigid

logger = logging.getLogger(__name__)


class PoseConfig(OdometryConfig):
    """What gives the pose, and the cloud it is made from."""

    # rgbd: by colour and depth; kiss_icp: by shape alone, also in the dark; given: the poses that the source brings
    method: Literal["rgbd", "kiss_icp", "given"] = "rgbd"
    rgbd: RgbdConfig = RgbdConfig()
    stride: int = Field(default=4, ge=1)  # every 4th pixel each way: 19 k points of 640x480
    mount_roll_deg: Literal[0, 90, 180, 270] = 0  # by how much the camera is turned about its axis, clockwise
    gravity_frames: int = Field(default=10, ge=1)  # frames that decide which way is up, when the source does not know


class PoseNode(Node):
    """Gives one Pose for each Frame, in a world with z up; the first `gravity_frames` wait until up is known."""

    config_type = PoseConfig
    inputs = (Frame, End)
    outputs = (Pose,)

    def __init__(self, config: PoseConfig, context: Context) -> None:
        super().__init__(config, context)
        self._shape = Odometry(config, context.threads)
        self._rgbd = RgbdOdometry(config.rgbd)
        self._waiting: list[tuple[Pose, F64, F32]] = []
        self._world_from_start: F64 | None = None

    def step(self, message: Message) -> Sequence[Message]:
        """Estimate the pose of a frame."""
        if isinstance(message, End):
            return self._release()
        assert isinstance(message, Frame)
        depth_m = message.depth_m
        pose = Pose(frame_id=message.frame_id, stamp_ns=message.stamp_ns, **self._estimate(message, depth_m))
        if self._world_from_start is not None:
            return [self._in_world(pose)]
        self._waiting.append((pose, message.up_camera, self._scan(message, depth_m)))
        return self._release() if len(self._waiting) >= self.config.gravity_frames else []

    def _scan(self, frame: Frame, depth_m: F32) -> F32:
        points = backproject(depth_m, frame.intrinsics, self.config.stride)
        ranges = np.linalg.norm(points, axis=1)
        return np.asarray(points[(ranges > self.config.min_range_m) & (ranges < self.config.max_range_m)])

    def _estimate(self, frame: Frame, depth_m: F32) -> dict[str, Any]:
        if self.config.method == "given":
            return self._given(frame)
        if self.config.method == "kiss_icp":
            return self._shape.register(self._scan(frame, depth_m), frame.stamp_ns)
        gray = np.asarray(cv2.cvtColor(frame.color, cv2.COLOR_RGB2GRAY), np.uint8)
        return self._rgbd.register(View(gray, depth_m, frame.intrinsics), frame.stamp_ns)

    def _given(self, frame: Frame) -> dict[str, Any]:
        known = is_rigid(frame.given_world_from_camera)
        return {
            "world_from_camera": frame.given_world_from_camera if known else np.eye(4),
            "trusted": known,
            "quality": 1.0 if known else 0.0,
            "residual_m": float("nan"),
            "innovation_m": 0.0,
            "reason": "" if known else "the source has no pose for this frame",
        }

    def _release(self) -> list[Message]:
        """Decide which way is up from the frames so far and give their poses."""
        waiting, self._waiting = self._waiting, []
        trusted = [(pose.world_from_camera, up, points) for pose, up, points in waiting if pose.trusted]
        if not trusted:  # still dark: up is decided by frames to come
            return [pose for pose, _, _ in waiting]
        if self._world_from_start is None:
            found = gravity.find_up(trusted, self.config.seed, np.deg2rad(self.config.mount_roll_deg))
            logger.info("up is %s in the start frame, from %s", np.round(found.up, 3).tolist(), found.source)
            if not found.reliable:
                logger.warning("no way to tell which way is up: the map may be tilted")
            self._world_from_start = gravity.level(found.up)
        return [self._in_world(pose) for pose, _, _ in waiting]

    def _in_world(self, pose: Pose) -> Pose:
        assert self._world_from_start is not None
        fields = {name: getattr(pose, name) for name in (*Pose.array_specs(), *Pose.scalar_types())}
        fields["world_from_camera"] = self._world_from_start @ pose.world_from_camera
        return Pose(**fields)


NODE = PoseNode
