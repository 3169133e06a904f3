import json
import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from placegraph.nodes.camera import detect_source
from placegraph.runtime.messages import Pose
from placegraph.runtime.vision.geometry import inverse, transform
from placegraph.tools.evaluate.trajectory_error import (
    absolute_trajectory_error,
    against_given,
    at_times,
    level_alignment,
    relative_pose_error,
    trajectory_scores,
)
from placegraph.tools.map_files.trajectory_file import write_trajectory

MOTION = np.eye(4)
MOTION[:3, :3] = Rotation.from_euler("z", 0.7).as_matrix()
MOTION[:3, 3] = (4, -5, 0.6)
SQUARE = np.array([[0.0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]])


def poses(positions):
    found = {}
    for stamp, position in enumerate(positions):
        found[stamp] = np.eye(4)
        found[stamp][:3, 3] = position
    return found


def positions(values):
    return dict(enumerate(np.asarray(values, float)))


@pytest.mark.parametrize("count", [0, 1, 2])
def test_too_few_pairs(count) -> None:
    with pytest.raises(ValueError, match=f"at least 3 pairs are needed, got {count}"):
        absolute_trajectory_error(SQUARE[:count], SQUARE[:count])
    assert against_given(positions(SQUARE[:count]), poses(SQUARE)) is None


def test_a_rigidly_moved_copy_has_no_error() -> None:
    walk = np.random.default_rng(0).normal(size=(50, 3))
    turn = Rotation.from_euler("xyz", (0.3, -2.0, 1.1)).as_matrix()
    assert absolute_trajectory_error(walk @ turn.T + (5.0, -3.0, 1.0), walk) == pytest.approx((0, 0), abs=1e-12)


def test_a_known_error() -> None:
    # Two opposite corners up, two down by 0.1: no rigid motion can undo that, so every point is off by 0.1.
    bent = SQUARE + np.array([[0, 0, 0.1], [0, 0, -0.1], [0, 0, 0.1], [0, 0, -0.1]])
    assert absolute_trajectory_error(bent, SQUARE) == pytest.approx((0.1, 0.1))


def test_one_shifted_point_of_a_symmetric_line() -> None:
    # The middle of a line along x moved by 0.3 along y: the best fit shifts by the mean, 0.1, and does not turn.
    line = np.array([[-1.0, 0, 0], [0, 0, 0], [1, 0, 0]])
    rmse, worst = absolute_trajectory_error(line + np.array([[0, 0, 0], [0, 0.3, 0], [0, 0, 0]]), line)
    assert rmse == pytest.approx(math.sqrt((0.1**2 + 0.2**2 + 0.1**2) / 3))
    assert worst == pytest.approx(0.2)


def test_scale_is_not_forgiven_and_a_mirrored_track_is_no_copy() -> None:
    rmse, worst = absolute_trajectory_error(SQUARE * 1.5, SQUARE)
    assert rmse == pytest.approx(0.5 * math.sqrt(2)) and worst == pytest.approx(rmse)
    solid = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    assert absolute_trajectory_error(solid * [1, 1, -1], solid)[0] > 0.1


def test_pairs_are_those_with_equal_stamps_and_finite_poses() -> None:
    given = poses(SQUARE)
    given[1] = np.full((4, 4), np.nan)
    estimated = positions(SQUARE) | {77: np.array([9.0, 9, 9])}
    found = against_given(estimated, given)
    assert found == {"ate_rmse_m": 0.0, "ate_max_m": 0.0, "poses": 3, "path_m": round(2 * math.sqrt(2) + 2, 2)}
    assert against_given(estimated, None) is None and against_given(estimated, {}) is None


def line(count, step=0.25, drift=0.0, turn_rad=0.0):
    """(count, 4, 4) poses along x, `step` apart; each also goes `drift` along y and turns about z."""
    found = np.tile(np.eye(4), (count, 1, 1))
    for k in range(count):
        found[k, :3, :3] = Rotation.from_euler("z", turn_rad * k).as_matrix()
    found[:, 0, 3], found[:, 1, 3] = step * np.arange(count), drift * np.arange(count)
    return found


def test_the_relative_error_is_the_drift_for_each_metre() -> None:
    assert relative_pose_error(line(9), line(9)) == (0, 0)
    assert relative_pose_error(line(9, drift=0.01), line(9)) == (pytest.approx(0.04), pytest.approx(0))
    off_m, off_deg = relative_pose_error(line(9, turn_rad=np.radians(0.5)), line(9))
    assert off_deg == pytest.approx(2) and off_m > 0  # seen from a pose that is turned the same way leads elsewhere
    # steps of 2 m are longer than what a pair spans: the error is still given for one metre
    assert relative_pose_error(line(5, 2.0, drift=0.1), line(5, 2.0))[0] == pytest.approx(0.05)


def test_a_motion_of_the_whole_world_is_no_relative_error() -> None:
    moved = np.eye(4)
    moved[:3, :3] = Rotation.from_euler("xyz", (0.3, 0.1, 2)).as_matrix()
    moved[:3, 3] = (5, 6, 7)
    assert relative_pose_error(moved @ line(9), line(9)) == pytest.approx((0, 0), abs=1e-6)


@pytest.mark.parametrize("given", [line(4), line(9, 0.0), line(0)], ids=["short", "standing", "empty"])
def test_a_path_too_short_for_a_relative_error(given) -> None:
    assert np.isnan(relative_pose_error(given, given)).all()


def test_the_scores_of_a_trajectory_leave_out_poses_that_are_not_finite() -> None:
    given, estimated = dict(enumerate(line(9))), dict(enumerate(line(9, drift=0.01)))
    given[2], estimated[5] = np.full((4, 4), np.nan), np.full((4, 4), np.inf)
    found = trajectory_scores(estimated, given)
    assert found["poses"] == 7 and found["path_m"] == 2 and np.isfinite(list(found.values())).all()
    assert found["ate_share"] == pytest.approx(found["ate_rmse_m"] / 2)
    assert trajectory_scores({0: given[0], 1: given[1], 5: estimated[5]}, given) is None
    assert trajectory_scores(estimated, None) is None
    still = dict(enumerate(line(9, 0.0)))
    assert np.isnan(trajectory_scores(still, still)["ate_share"])


def test_times_of_another_clock_reading_are_matched_by_nearness() -> None:
    given = {30_000_000: line(1)[0], 1_000_000_000: line(2)[1]}
    found = at_times({0: None, 15_000_000: None, 999_000_000: None}, given)
    assert sorted(found) == [15_000_000, 999_000_000] and found[999_000_000] is given[1_000_000_000]
    assert at_times({}, given) == {} and at_times({0: None}, {}) == {}


def test_the_level_alignment_undoes_a_turn_about_z_and_nothing_else() -> None:
    walk = np.random.default_rng(0).normal(size=(30, 3))
    found = level_alignment(transform(MOTION, walk), walk)
    assert found == pytest.approx(inverse(MOTION), abs=1e-12)
    tilted = walk @ Rotation.from_euler("x", 0.2).as_matrix().T
    assert level_alignment(tilted, walk)[2, :3].tolist() == [0, 0, 1]
    assert np.isfinite(level_alignment(np.zeros((3, 3)), np.ones((3, 3)))).all()  # a camera that stands


def test_a_straight_walk_says_where_the_map_is() -> None:
    line = np.column_stack((np.arange(5.0), np.zeros(5), np.zeros(5)))
    assert level_alignment(transform(MOTION, line), line) == pytest.approx(inverse(MOTION), abs=1e-12)


@pytest.fixture
def track(tmp_path, seven):
    """A map folder whose trajectory is the given one of `seven`, moved and turned, with the last point 0.3 m off."""
    given = detect_source(str(seven))(seven, {}).given_poses()
    motion = np.eye(4)
    motion[:3, :3] = Rotation.from_euler("z", 0.7).as_matrix()
    motion[:3, 3] = (4, 5, 6)

    def write(error_m=0.0):
        found = []
        for frame_id, (stamp_ns, pose) in enumerate(sorted(given.items())):
            moved = motion @ pose
            moved[2, 3] += error_m if frame_id == 3 else 0.0
            found.append(
                Pose(
                    frame_id=frame_id,
                    stamp_ns=stamp_ns,
                    world_from_camera=moved,
                    trusted=True,
                    quality=1.0,
                    residual_m=0.0,
                    innovation_m=0.0,
                    reason="",
                )
            )
        folder = tmp_path / "map"
        folder.mkdir()
        write_trajectory(folder / "trajectory.txt", found)
        return folder

    return write


def test_the_command_on_a_moved_copy(cli, track, seven) -> None:
    done = cli("evaluate", "map", track(), "--source", seven, "--json")
    assert done.code == 0 and done.err == ""
    found = json.loads(done.out)
    assert set(found) == {"ate_rmse_m", "ate_max_m", "poses", "path_m", "ate_share", "rpe_m", "rpe_deg", "poses_given"}
    assert (found["ate_rmse_m"], found["ate_max_m"], found["poses"]) == (0.0, 0.0, 4) and found["path_m"] > 1


def test_the_command_in_words(cli, track, seven) -> None:
    done = cli("evaluate", "map", track(0.3), "--source", seven)
    assert done.out.startswith("ATE rmse 0.") and " m of path: " in done.out and "rmse 0.0 m" not in done.out


def test_errors_name_the_file(cli, track, seven, tmp_path) -> None:
    folder = track()
    absent = cli("evaluate", "map", tmp_path / "no", "--source", seven)
    assert (absent.code, absent.reason) == (
        1,
        f"{tmp_path / 'no' / 'trajectory.txt'}: cannot read: No such file or directory",
    )
    source = cli("evaluate", "map", folder, "--source", tmp_path / "no")
    assert (source.code, source.reason) == (1, f"{tmp_path / 'no'}: no such file or folder")
    (folder / "trajectory.txt").write_text("# nothing\n")
    assert "fewer than 3 given poses at the times of" in cli("evaluate", "map", folder, "--source", seven).reason
    (folder / "trajectory.txt").write_text("# two\n0.0 1 2 3\n")
    assert (
        cli("evaluate", "map", folder, "--source", seven).reason
        == f"{folder / 'trajectory.txt'}:2: expected 8 finite numbers"
    )
