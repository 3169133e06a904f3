import itertools

import numpy as np
import pytest

from placegraph.nodes.keyframe import KeyframeConfig, KeyframeNode
from placegraph.runtime.messages import End, Frame, Keyframe, LastKeyframe, Message, Pose, Segments
from placegraph.runtime.node import Context


def frame(i: int) -> Frame:
    return Frame(
        frame_id=i,
        stamp_ns=i * 33_000_000,
        color=np.zeros((2, 2, 3), np.uint8),
        depth=np.zeros((2, 2), np.uint16),
        depth_unit_m=0.001,
        intrinsics=np.ones(4),
        given_world_from_camera=np.full((4, 4), np.nan),
        up_camera=np.full(3, np.nan),
    )


def pose(i: int, x: float, trusted: bool = True, yaw: float = 0.0) -> Pose:
    world_from_camera = np.eye(4)
    world_from_camera[0, 3] = x
    world_from_camera[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
    measured = {"quality": 1.0, "residual_m": 0.0, "innovation_m": 0.0, "reason": ""}
    return Pose(frame_id=i, stamp_ns=i * 33_000_000, world_from_camera=world_from_camera, trusted=trusted, **measured)


def segments(i: int) -> Segments:
    none = np.zeros(0, np.float32)
    boxes, bits = np.zeros((0, 4), np.int32), np.zeros(0, np.uint8)
    offsets = np.zeros(1, np.int64)
    fields = {"names": (), "scores": none, "boxes_px": boxes, "mask_bits": bits, "mask_offsets": offsets}
    return Segments(frame_id=i, stamp_ns=0, **fields)


def end(i: int) -> End:
    return End(frame_id=i, stamp_ns=0, frames=i + 1)


def node(lossless: bool = True, **settings: float) -> KeyframeNode:
    return KeyframeNode(KeyframeConfig(**settings), Context(lossless=lossless))


def chosen(node: KeyframeNode, messages: list[Message]) -> list[int]:
    return [out.frame_id for message in messages for out in node.step(message) if isinstance(out, Keyframe)]


def test_no_frames_at_all() -> None:
    (last,) = node().step(end(-1))
    assert isinstance(last, LastKeyframe) and (last.frame_id, last.keyframes) == (-1, 0)


def test_live_frames_are_bounded_while_no_pose_comes() -> None:
    gate = node(lossless=False, lost_after_s=1.0)
    assert chosen(gate, [frame(i) for i in range(200)]) == []
    assert len(gate._synchronizer) <= 1 + 1000 / 33
    assert chosen(gate, [pose(i, 0.2 * i) for i in range(200)]) == [169, 170, 171, 172]  # then four are in flight
    replay = node(lost_after_s=1.0)
    assert chosen(replay, [frame(i) for i in range(200)]) == []
    assert len(replay._synchronizer) == 200  # bounded by the windows of the bus


def test_only_untrusted_poses() -> None:
    gate = node()
    assert chosen(gate, [frame(0), pose(0, 0.0, trusted=False)]) == []
    (last,) = gate.step(end(0))
    assert (last.frame_id, type(last)) == (-1, LastKeyframe)


def test_moved_turned_or_waited() -> None:
    gate = node(translation_m=0.1, rotation_rad=0.2, period_s=1.0)
    poses = [
        pose(0, 0.0),
        pose(1, 0.05),
        pose(2, 0.11),
        pose(3, 0.11, yaw=0.15),
        pose(4, 0.11, yaw=0.25),
        pose(33, 0.11, yaw=0.25),
        pose(36, 0.11, yaw=0.25),
    ]
    messages: list[Message] = [m for p in poses for m in (frame(p.frame_id), p)]
    assert chosen(gate, messages) == [0, 2, 4, 36]


def test_choice_does_not_depend_on_how_frames_poses_and_end_interleave() -> None:
    frames, poses = [frame(i) for i in range(3)], [pose(i, 0.2 * i) for i in range(3)]
    results = set()
    for places in itertools.combinations(range(6), 3):
        a, b = iter(frames), iter(poses)
        messages: list[Message] = [next(a) if i in places else next(b) for i in range(6)]
        gate = node()
        given = [type(out).__name__ for m in [*messages[:-1], end(2), messages[-1]] for out in gate.step(m)]
        results.add(tuple(given))
    assert results == {("Keyframe", "Keyframe", "Keyframe", "LastKeyframe")}


@pytest.mark.parametrize("lossless", [True, False])
def test_in_flight_bounds_live_only(lossless: bool) -> None:
    gate = node(lossless, in_flight=2)
    messages: list[Message] = [m for i in range(4) for m in (frame(i), pose(i, i))]
    assert chosen(gate, messages) == ([0, 1, 2, 3] if lossless else [0, 1])
    # a receipt of frame 1 stands for frame 0 too, whose own was lost
    assert chosen(gate, [segments(1), frame(4), pose(4, 9.0), frame(5), pose(5, 10.0)]) == [4, 5]
    assert chosen(gate, [frame(6), pose(6, 11.0)]) == ([6] if lossless else [])


def test_live_keyframes_that_died_with_their_process_are_given_up() -> None:
    gate = node(lossless=False, in_flight=1, lost_after_s=1.0)
    messages: list[Message] = [m for i in range(40) for m in (frame(i), pose(i, float(i)))]
    assert chosen(gate, messages) == [0, 31]  # 31 frames at 33 ms: the first later than a second
