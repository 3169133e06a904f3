import itertools

import numpy as np

from placegraph.nodes.keyframe import KeyframeConfig, KeyframeNode
from placegraph.runtime.messages import End, Frame, Keyframe, LastKeyframe, Message, Pose
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
    gate = node(lossless=False, pose_timeout_s=1.0)
    assert chosen(gate, [frame(i) for i in range(200)]) == []
    assert len(gate._synchronizer) <= 1 + 1000 / 33
    assert chosen(gate, [pose(i, 0.2 * i) for i in range(200)]) == list(range(169, 200))
    replay = node(pose_timeout_s=1.0)
    assert chosen(replay, [frame(i) for i in range(200)]) == []
    assert len(replay._synchronizer) == 200  # bounded by the credit of the bus


def test_live_poses_of_frames_that_were_dropped_are_forgotten_and_the_newest_frames_are_used() -> None:
    gate = node(lossless=False, pose_timeout_s=1.0)
    assert chosen(gate, [pose(i, 0.2 * i) for i in range(500)]) == []  # what comes while publishing a keyframe blocks
    assert chosen(gate, [frame(i) for i in range(492, 500)]) == list(range(492, 500))
    assert len(gate._synchronizer) == 0


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
