"""Node `pose`: frames to camera poses in a world with z up, each with a judgement whether to trust it."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from typing import Any, Literal

import cv2
import numpy as np
from pydantic import Field

from placegraph.nodes.pose import gravity
from placegraph.nodes.pose.feature_tracker import RgbdView
from placegraph.nodes.pose.kiss_icp import KissIcpConfig, KissIcpOdometry
from placegraph.nodes.pose.rgbd_odometry import RgbdOdometry, RgbdOdometryConfig
from placegraph.runtime.arrays import F32, F64
from placegraph.runtime.messages import End, Frame, Message, Pose
from placegraph.runtime.node import Context, Node
from placegraph.runtime.vision.geometry import backproject, is_rigid

logger = logging.getLogger(__name__)


class PoseConfig(KissIcpConfig):
    """How poses are estimated, and the points that they are estimated from."""

    # rgbd: by colour and depth; kiss_icp: by shape alone, also in the dark; given: the poses of the data set
    method: Literal["rgbd", "kiss_icp", "given"] = "rgbd"
    rgbd: RgbdOdometryConfig = RgbdOdometryConfig()
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
        self._kiss_icp = KissIcpOdometry(config, context.threads)
        self._rgbd = RgbdOdometry(config.rgbd)
        self._poses_without_up: list[tuple[Pose, F64, F32]] = []
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
        self._poses_without_up.append((pose, message.up_camera, self._scan(message, depth_m)))
        return self._release() if len(self._poses_without_up) >= self.config.gravity_frames else []

    def _scan(self, frame: Frame, depth_m: F32) -> F32:
        points = backproject(depth_m, frame.intrinsics, self.config.stride)
        ranges = np.linalg.norm(points, axis=1)
        return np.asarray(points[(ranges > self.config.min_range_m) & (ranges < self.config.max_range_m)])

    def _estimate(self, frame: Frame, depth_m: F32) -> dict[str, Any]:
        if self.config.method == "given":
            return self._given(frame)
        if self.config.method == "kiss_icp":
            return self._kiss_icp.register(self._scan(frame, depth_m), frame.stamp_ns)
        gray = np.asarray(cv2.cvtColor(frame.color, cv2.COLOR_RGB2GRAY), np.uint8)
        return self._rgbd.register(RgbdView(gray, depth_m, frame.intrinsics), frame.stamp_ns)

    def _given(self, frame: Frame) -> dict[str, Any]:
        is_known = is_rigid(frame.given_world_from_camera)
        return {
            "world_from_camera": frame.given_world_from_camera if is_known else np.eye(4),
            "trusted": is_known,
            "quality": 1.0 if is_known else 0.0,
            "residual_m": float("nan"),
            "innovation_m": 0.0,
            "reason": "" if is_known else "the source has no pose for this frame",
        }

    def _release(self) -> list[Message]:
        """Estimate which way is up from the frames so far, and give their poses."""
        waiting, self._poses_without_up = self._poses_without_up, []
        trusted = [(pose.world_from_camera, up, points) for pose, up, points in waiting if pose.trusted]
        if not trusted:  # still dark: later frames decide which way is up
            return [pose for pose, _, _ in waiting]
        if self._world_from_start is None:
            up = gravity.estimate_up(trusted, self.config.seed, np.deg2rad(self.config.mount_roll_deg))
            logger.info("up is %s in the start frame, from %s", np.round(up.up, 3).tolist(), up.source)
            if not up.reliable:
                logger.warning("no way to tell which way is up: the map may be tilted")
            self._world_from_start = gravity.world_from_start(up.up)
        return [self._in_world(pose) for pose, _, _ in waiting]

    def _in_world(self, pose: Pose) -> Pose:
        assert self._world_from_start is not None
        fields = {name: getattr(pose, name) for name in (*Pose.array_specs(), *Pose.scalar_types())}
        fields["world_from_camera"] = self._world_from_start @ pose.world_from_camera
        return Pose(**fields)


NODE = PoseNode
