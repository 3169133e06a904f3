"""What every odometry has in common: it gives an estimate of the camera's pose for each frame."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from pydantic import Field

from placegraph.runtime.arrays import F32, F64
from placegraph.runtime.messages import Frame, Pose
from placegraph.runtime.node import NodeConfig
from placegraph.runtime.vision.geometry import backproject


@dataclass(frozen=True, eq=False)
class PoseEstimate:
    """A camera's pose in the start frame, (4, 4) metres, and how far to trust it; the fields are those of Pose."""

    start_from_camera: F64
    reason: str = ""  # why the pose is not trusted; "" when it is
    quality: float = 0.0
    residual_m: float = float("nan")
    innovation_m: float = 0.0

    @property
    def trusted(self) -> bool:
        """Whether the frame may be put into the map."""
        return not self.reason

    def as_message(self, frame: Frame) -> Pose:
        """The Pose of a frame, with the start frame as its world."""
        return Pose(
            frame_id=frame.frame_id,
            stamp_ns=frame.stamp_ns,
            world_from_camera=self.start_from_camera,
            trusted=self.trusted,
            reason=self.reason,
            quality=self.quality,
            residual_m=self.residual_m,
            innovation_m=self.innovation_m,
        )


class Odometry(Protocol):
    """Poses of successive frames; the start frame is that of the first camera unless the source gives poses."""

    def estimate(self, frame: Frame, depth_m: F32) -> PoseEstimate:
        """The pose of the next frame; depth_m: its depth (H, W) in metres, 0 = no reading."""
        ...


class DepthPointsConfig(NodeConfig):
    """Which pixels of a depth image become points, and the seed of random choices among them."""

    stride: int = Field(default=4, ge=1)  # every 4th pixel each way: 19 k points of 640x480
    min_range_m: float = 0.2
    max_range_m: float = 6.0
    seed: int = 0


def depth_points(depth_m: F32, intrinsics: F64, config: DepthPointsConfig) -> F32:
    """Points (N, 3) in metres, camera frame, of a depth image (H, W) in metres; intrinsics fx fy cx cy in px."""
    points = backproject(depth_m, intrinsics, config.stride)
    ranges = np.linalg.norm(points, axis=1)
    return np.asarray(points[(ranges > config.min_range_m) & (ranges < config.max_range_m)])
