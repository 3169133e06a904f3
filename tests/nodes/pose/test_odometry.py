import numpy as np
import pytest

from placegraph.nodes.pose.odometry import LONGEST_STRETCH, Odometry, OdometryConfig, _stretched
from placegraph.runtime.geometry import pose_from_quaternion, rotation_angle_rad

TURN = pose_from_quaternion(np.array([0.1, 0.0, 0.0]), np.array([0.0, 0.0, np.sin(0.05), np.cos(0.05)]))


@pytest.mark.parametrize(("span", "old"), [(0, 5), (5, 0), (100, 100), (104, 100), (-3, 5)])
def test_even_or_unknown_spans_leave_the_motion_as_it_is(span: int, old: int) -> None:
    assert _stretched(TURN, span, old) is TURN


@pytest.mark.parametrize(("span", "ratio"), [(200, 2.0), (50, 0.5), (10_000, LONGEST_STRETCH)])
def test_motion_goes_on_for_as_long_as_the_frames_are_apart(span: int, ratio: float) -> None:
    longer = _stretched(TURN, span, 100)
    assert longer[0, 3] == pytest.approx(0.1 * ratio)
    assert rotation_angle_rad(longer[:3, :3]) == pytest.approx(0.1 * ratio)


def corner(count: int, seed: int) -> np.ndarray:
    """Points on three walls that meet in a corner: they hold a pose in every direction."""
    random = np.random.default_rng(seed)
    flat = random.uniform(0, 2, (3, count, 2))
    walls = [np.insert(flat[axis], axis, 2.0, axis=1) for axis in range(3)]
    return (np.concatenate(walls) - 0.5).astype(np.float32)


def test_after_a_lost_track_a_place_that_fits_halfway_is_not_trusted() -> None:
    config = OdometryConfig(min_quality=0.25, relock_quality=0.7)
    half = np.concatenate((corner(300, 9), np.random.default_rng(1).uniform(2.2, 3.2, (900, 3)))).astype(np.float32)

    followed = Odometry(config, 1)
    lost = Odometry(config, 1)
    for odometry in (followed, lost):
        for i in range(12):
            assert odometry.register(corner(400, i), i)["trusted"]
    assert not lost.register(np.zeros((0, 3), np.float32), 12)["trusted"]
    on_track, after_loss = followed.register(half, 13), lost.register(half, 13)
    assert 0.25 < on_track["quality"] < 0.7 and on_track["trusted"]
    assert not after_loss["trusted"] and "on the map" in after_loss["reason"]
    assert lost.register(corner(400, 50), 14)["trusted"]
