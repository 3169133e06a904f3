"""Which frames are worth perceiving: a motion and time gate over trusted poses, bounded in flight when live."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np
from pydantic import Field

from placegraph.runtime.arrays import F64
from placegraph.runtime.messages import End, Frame, Keyframe, LastKeyframe, Message, Pose, Segments
from placegraph.runtime.messages.synchronizer import FrameSynchronizer
from placegraph.runtime.node import Context, Node, NodeConfig
from placegraph.runtime.vision.geometry import rotation_angle_rad


class KeyframeConfig(NodeConfig):
    """A frame is chosen when the camera moved, turned or waited enough since the last one."""

    translation_m: float = Field(0.1, gt=0)  # DualMap's gate: 0.1 m ...
    rotation_rad: float = Field(0.1, gt=0)  # departs: its 3 deg chooses nearly every frame of a hand-held camera
    period_s: float = Field(1.0, gt=0)  # departs: its 0.5 s; a camera that stands still sees little that is new
    in_flight: int = Field(4, ge=1)  # live: keyframes that perception may be behind
    # live: a keyframe unfinished for so long died with its process; a frame without a pose for so long is forgotten,
    # or frames would fill the memory while `pose` stands still
    lost_after_s: float = Field(5.0, gt=0)


class KeyframeNode(Node):
    """Takes frames with their poses and gives the chosen ones.

    In replay the choice depends on the poses alone, and the windows of the bus make the camera wait for slow models.
    Live, a frame that comes while `in_flight` keyframes are unfinished is not chosen; Segments are the receipts.
    """

    config_type = KeyframeConfig
    inputs = (Frame, Pose, Segments, End)
    outputs = (Keyframe, LastKeyframe)
    feedback = (Segments,)
    restartable: ClassVar[bool] = True
    config: KeyframeConfig

    def __init__(self, config: Any, context: Context) -> None:
        super().__init__(config, context)
        self._synchronizer = FrameSynchronizer(Frame, Pose)
        self._last: tuple[int, F64] | None = None  # stamp and pose of the last keyframe
        self._in_flight: dict[int, int] = {}  # frame id to stamp
        self._chosen = 0
        self._last_keyframe_id = -1
        self._last_seen = -1
        self._end: End | None = None

    def step(self, message: Message) -> Sequence[Message]:
        """Join frames with poses; choose; say when the last one is out."""
        given: list[Message] = []
        if isinstance(message, Segments):
            # a receipt also stands for older keyframes: theirs were lost with a process that was started again
            self._in_flight = {i: stamp for i, stamp in self._in_flight.items() if i > message.frame_id}
        elif isinstance(message, End):
            self._end = message
        elif (joined := self._joined(message)) is not None:
            frame, pose = joined
            assert isinstance(frame, Frame) and isinstance(pose, Pose)
            self._last_seen = frame.frame_id
            if self._is_worth(frame, pose):
                given.append(self._choose(frame, pose))
        if self._end is not None and self._last_seen >= self._end.frame_id:
            given.append(self._last_message(self._end))
            self._end = None
        return given

    def _joined(self, message: Message) -> tuple[Message, ...] | None:
        if isinstance(message, Frame) and not self.context.lossless:
            self._synchronizer.forget_before(message.stamp_ns - round(self.config.lost_after_s * 1e9))
        return self._synchronizer.add(message)

    def _is_worth(self, frame: Frame, pose: Pose) -> bool:
        if not pose.trusted:
            return False
        if not self.context.lossless and self._perception_is_behind(frame.stamp_ns):
            return False
        if self._last is None:
            return True
        stamp_ns, world_from_last = self._last
        moved_m = float(np.linalg.norm(pose.world_from_camera[:3, 3] - world_from_last[:3, 3]))
        turned_rad = rotation_angle_rad(world_from_last[:3, :3].T @ pose.world_from_camera[:3, :3])
        waited_s = (frame.stamp_ns - stamp_ns) * 1e-9
        return bool(
            moved_m >= self.config.translation_m
            or turned_rad >= self.config.rotation_rad
            or waited_s >= self.config.period_s
        )

    def _perception_is_behind(self, now_ns: int) -> bool:
        oldest_ns = now_ns - self.config.lost_after_s * 1e9
        self._in_flight = {i: stamp for i, stamp in self._in_flight.items() if stamp > oldest_ns}
        return len(self._in_flight) >= self.config.in_flight

    def _choose(self, frame: Frame, pose: Pose) -> Keyframe:
        self._last = (frame.stamp_ns, pose.world_from_camera)
        self._chosen += 1
        self._last_keyframe_id = frame.frame_id
        self._in_flight[frame.frame_id] = frame.stamp_ns
        return Keyframe.of(frame, pose.world_from_camera)

    def _last_message(self, end: End) -> LastKeyframe:
        return LastKeyframe(frame_id=self._last_keyframe_id, stamp_ns=end.stamp_ns, keyframes=self._chosen)


NODE = KeyframeNode
