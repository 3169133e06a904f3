"""Node `keyframe`: selects the frames to perceive by motion and time between trusted poses."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np
from pydantic import Field

from placegraph.runtime.messages import End, Frame, Keyframe, LastKeyframe, Message, Pose
from placegraph.runtime.messages.synchronizer import FrameSynchronizer
from placegraph.runtime.node import Context, Node, NodeConfig
from placegraph.runtime.vision.geometry import rotation_angle_rad


class KeyframeConfig(NodeConfig):
    """A frame becomes a keyframe when the camera moved or turned enough since the last keyframe, or time has passed."""

    translation_m: float = Field(0.1, gt=0)  # as DualMap
    rotation_rad: float = Field(0.1, gt=0)  # not DualMap's 3 deg, which selects nearly all frames of a hand-held camera
    period_s: float = Field(1.0, gt=0)  # not DualMap's 0.5 s: a camera that stands still sees little that is new
    # live: a frame without a pose for so long is forgotten, or frames would fill the memory while `pose` is stuck;
    # chosen by hand
    pose_timeout_s: float = Field(5.0, gt=0)


class KeyframeNode(Node):
    """Joins frames with their poses and selects keyframes.

    The selection depends on the frames and poses alone. How many keyframes wait for slow models is bounded by the
    credit of the bus: publishing a keyframe blocks, and live the frames that come meanwhile are dropped in the inbox.
    """

    config_type = KeyframeConfig
    inputs = (Frame, Pose, End)
    outputs = (Keyframe, LastKeyframe)
    restartable: ClassVar[bool] = True
    config: KeyframeConfig

    def __init__(self, config: Any, context: Context) -> None:
        super().__init__(config, context)
        self._synchronizer = FrameSynchronizer(Frame, Pose)
        self._last_keyframe: Keyframe | None = None
        self._keyframes = 0
        self._last_frame_id = -1
        self._end: End | None = None

    def step(self, message: Message) -> Sequence[Message]:
        """Join frames with poses and select; after the last frame also the LastKeyframe."""
        outputs: list[Message] = []
        if isinstance(message, End):
            self._end = message
        elif (pair := self._join(message)) is not None:
            frame, pose = pair
            assert isinstance(frame, Frame) and isinstance(pose, Pose)
            self._last_frame_id = frame.frame_id
            if self._is_keyframe(frame, pose):
                self._last_keyframe = Keyframe.of(frame, pose.world_from_camera)
                self._keyframes += 1
                outputs.append(self._last_keyframe)
        if self._end is not None and self._last_frame_id >= self._end.frame_id:
            outputs.append(self._last_message(self._end))
            self._end = None
        return outputs

    def _join(self, message: Message) -> tuple[Message, ...] | None:
        if isinstance(message, Frame) and not self.context.lossless:
            self._synchronizer.forget_before(message.stamp_ns - round(self.config.pose_timeout_s * 1e9))
        return self._synchronizer.add(message)

    def _is_keyframe(self, frame: Frame, pose: Pose) -> bool:
        last = self._last_keyframe
        if last is None or not pose.trusted:
            return pose.trusted
        moved_m = float(np.linalg.norm(pose.world_from_camera[:3, 3] - last.world_from_camera[:3, 3]))
        turned_rad = rotation_angle_rad(last.world_from_camera[:3, :3].T @ pose.world_from_camera[:3, :3])
        elapsed_s = (frame.stamp_ns - last.stamp_ns) * 1e-9
        return bool(
            moved_m >= self.config.translation_m
            or turned_rad >= self.config.rotation_rad
            or elapsed_s >= self.config.period_s
        )

    def _last_message(self, end: End) -> LastKeyframe:
        frame_id = -1 if self._last_keyframe is None else self._last_keyframe.frame_id
        return LastKeyframe(frame_id=frame_id, stamp_ns=end.stamp_ns, keyframes=self._keyframes)


NODE = KeyframeNode
