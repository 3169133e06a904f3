import numpy as np

from placegraph.runtime.messages import Correction, Pose
from placegraph.tools.map_files.corrected_trajectory import CorrectedTrajectory


def at(x: float) -> np.ndarray:
    made = np.eye(4)
    made[0, 3] = x
    return made


def pose(frame_id: int, x: float) -> Pose:
    return Pose(
        frame_id=frame_id, stamp_ns=frame_id, world_from_camera=at(x), trusted=True, quality=1.0,
        residual_m=0.0, innovation_m=0.0, reason="",
    )  # fmt: skip


def correction(frame_id: int, x: float, moved: dict[int, float] | None = None) -> Correction:
    moved = moved or {}
    return Correction(
        frame_id=frame_id, stamp_ns=frame_id, world_from_camera=at(x),
        moved_frame_ids=np.array(list(moved), np.int64),
        moved_world_from_camera=np.array([at(x) for x in moved.values()]).reshape(-1, 4, 4),
    )  # fmt: skip


def xs(poses: list[Pose]) -> list[float]:
    return [round(float(one.world_from_camera[0, 3]), 6) for one in poses]


def test_without_corrections_poses_are_as_they_are() -> None:
    poses = [pose(0, 0.0), pose(1, 1.0)]
    assert CorrectedTrajectory().correct(poses) == poses and CorrectedTrajectory().correct([]) == []


def test_a_pose_moves_with_the_keyframe_before_it_and_the_first_ones_with_the_first() -> None:
    corrected = CorrectedTrajectory()
    corrected.add(correction(1, 1.5))
    corrected.add(correction(3, 3.0, {1: 1.1}))
    poses = [pose(i, float(i)) for i in range(5)]
    assert xs(corrected.correct(poses)) == [0.1, 1.1, 2.1, 3.0, 4.0]


def test_corrections_of_frames_without_a_pose_are_left_out() -> None:
    corrected = CorrectedTrajectory()
    corrected.add(correction(7, 9.0))
    assert xs(corrected.correct([pose(0, 2.0)])) == [2.0]
