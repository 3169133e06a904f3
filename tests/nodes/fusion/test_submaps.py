import numpy as np

from placegraph.nodes.fusion.submaps import SubmapConfig, Submaps
from placegraph.runtime.messages import Correction


def at(x):
    pose = np.eye(4)
    pose[0, 3] = x
    return pose


def moving(**moved):
    ids = sorted(int(name[1:]) for name in moved)
    poses = np.array([moved[f"f{i}"] for i in ids], float).reshape(-1, 4, 4)
    return Correction(
        frame_id=99, stamp_ns=0, world_from_camera=np.eye(4),
        moved_frame_ids=np.array(ids, np.int64), moved_world_from_camera=poses,
    )  # fmt: skip


def three(count=3):
    submaps = Submaps(SubmapConfig(keyframes=3))
    assert [submaps.add_keyframe(10 * k, at(k)) for k in range(count)] == [k // 3 for k in range(count)]
    return submaps


def test_no_keyframes_and_no_moves():
    submaps = Submaps(SubmapConfig())
    assert (
        submaps.positions.shape == (0, 3)
        and submaps.apply_correction(moving()) == {}
        and submaps.apply_correction(moving(f7=at(1))) == {}
    )


def test_a_submap_follows_its_middle_keyframe():
    submaps = three(4)
    assert submaps.apply_correction(moving(f0=at(5.0))) == {}  # not the middle one
    (moves,) = [submaps.apply_correction(moving(f10=at(1.5)))]
    assert list(moves) == [0] and np.allclose(moves[0], at(0.5))
    assert submaps.positions[:, 0].tolist() == [5.0, 1.5, 2.0, 3.0]


def test_a_move_ends_the_submap_that_is_being_filled():
    submaps = three(2)
    assert list(submaps.apply_correction(moving(f10=at(2.0)))) == [0]
    assert submaps.add_keyframe(20, at(3)) == 1


def test_small_moves_add_up_until_they_are_made():
    submaps = three()
    assert submaps.apply_correction(moving(f10=at(1.006))) == {}
    assert list(submaps.apply_correction(moving(f10=at(1.012)))) == [0]
    assert submaps.apply_correction(moving(f10=at(1.018))) == {}
    assert np.allclose(submaps.world_from_fused[0], at(0.012))
