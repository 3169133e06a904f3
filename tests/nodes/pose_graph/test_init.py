import itertools

import numpy as np
import pytest

from placegraph.nodes.pose_graph import PoseGraphConfig, PoseGraphNode
from placegraph.runtime.messages import Correction, Keyframe
from placegraph.runtime.node import Context
from placegraph.runtime.vision.geometry import inverse, rotation_angle_rad
from placegraph.runtime.vision.registration import exponential


@pytest.fixture
def keyframe(room_view):
    def make(number: int, true: np.ndarray, given: np.ndarray) -> Keyframe:
        gray, depth, intrinsics = room_view(true)
        return Keyframe(
            frame_id=10 * number,
            stamp_ns=number,
            color=np.repeat(gray[..., None], 3, axis=2),
            depth=np.rint(depth * 1000).astype(np.uint16),
            depth_unit_m=0.001,
            intrinsics=intrinsics,
            world_from_camera=given,
        )

    return make


def turn_about(standing, count: int) -> list[np.ndarray]:
    """Once around in a small circle and on over the beginning."""
    angles = np.linspace(0, 2.3 * np.pi, count)
    return [standing(0.4 * np.cos(a), 0.4 * np.sin(a), a) for a in angles]


def drifted(true: list[np.ndarray], drift: np.ndarray) -> list[np.ndarray]:
    poses = [true[0]]
    for a, b in itertools.pairwise(true):
        poses.append(poses[-1] @ inverse(a) @ b @ exponential(drift))
    return poses


DRIFT = np.array([0.004, 0.002, 0.004, 0.001, 0.004, 0.001])


def test_a_closed_turn_takes_the_drift_away_and_tells_who_moved(keyframe, standing) -> None:
    true = turn_about(standing, 46)
    given = drifted(true, DRIFT)
    node = PoseGraphNode(PoseGraphConfig(), Context())
    where: dict[int, np.ndarray] = {}
    for i, (pose, odometry) in enumerate(zip(true, given, strict=True)):
        (correction,) = node.step(keyframe(i, pose, odometry))
        assert isinstance(correction, Correction)
        correction.check()
        assert correction.frame_id == 10 * i and 10 * i not in correction.moved_frame_ids
        where[correction.frame_id] = correction.world_from_camera
        where.update(zip(correction.moved_frame_ids.tolist(), correction.moved_world_from_camera, strict=True))
    found = np.array([where[10 * i] for i in range(len(true))])

    def error_m(poses: np.ndarray) -> float:
        return float(np.linalg.norm(np.array(poses)[:, :3, 3] - np.array(true)[:, :3, 3], axis=1).max())

    # a drift that never changes its direction is the worst case: what a loop does not tell it spreads evenly
    assert error_m(found) < 0.5 * error_m(np.array(given))
    assert np.linalg.norm(found[-1][:3, 3] - true[-1][:3, 3]) < 0.05
    assert rotation_angle_rad(found[-1][:3, :3].T @ true[-1][:3, :3]) < 0.03


def test_without_a_loop_odometry_is_what_it_gives(keyframe, standing) -> None:
    node = PoseGraphNode(PoseGraphConfig(), Context())
    for i in range(3):
        pose = standing(0.3 * i, 0, 0)
        (correction,) = node.step(keyframe(i, pose, pose))
        assert isinstance(correction, Correction)
        assert np.allclose(correction.world_from_camera, pose, atol=1e-9) and len(correction.moved_frame_ids) == 0


def test_blank_keyframes_pass_through(standing) -> None:
    node = PoseGraphNode(PoseGraphConfig(), Context())
    for i in range(6):
        blank = Keyframe(
            frame_id=i, stamp_ns=i, color=np.zeros((60, 80, 3), np.uint8), depth=np.zeros((60, 80), np.uint16),
            depth_unit_m=0.001, intrinsics=np.array([60.0, 60, 40, 30]), world_from_camera=standing(0.1 * i, 0, 0),
        )  # fmt: skip
        (correction,) = node.step(blank)
        assert isinstance(correction, Correction)
        assert np.allclose(correction.world_from_camera, blank.world_from_camera)


def test_same_keyframes_same_corrections_bit_for_bit(keyframe, standing) -> None:
    true = turn_about(standing, 46)[::2]

    def once() -> list[bytes]:
        node = PoseGraphNode(PoseGraphConfig(), Context())
        given = [node.step(keyframe(i, pose, pose))[0] for i, pose in enumerate(true)]
        return [one.world_from_camera.tobytes() for one in given]

    assert once() == once()


def test_a_camera_that_stands_still_is_remembered_once(keyframe, standing) -> None:
    node = PoseGraphNode(PoseGraphConfig(), Context())
    for i in range(5):
        node.step(keyframe(i, standing(0, 0, 0), standing(0, 0, 0)))
    assert [one is not None for one in node._loop_detector.features] == [True, False, False, False, False]
