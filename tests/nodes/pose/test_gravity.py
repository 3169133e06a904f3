import numpy as np
import pytest

from placegraph.nodes.pose import gravity
from placegraph.runtime.vision.geometry import rotation_between

UNKNOWN = np.full(3, np.nan)
EMPTY = np.zeros((0, 3), np.float32)


def floor_and_wall(up: np.ndarray, seed: int = 0) -> np.ndarray:
    """A level floor and a wall in a start frame in which `up` is up; camera y is down."""
    random = np.random.default_rng(seed)
    floor = np.column_stack((random.uniform(-2, 2, (600, 2)), np.full(600, -1.2)))
    wall = np.column_stack((random.uniform(-2, 2, 800), np.full(800, 2.0), random.uniform(-1.2, 1, 800)))
    turn = rotation_between(np.array([0.0, 0.0, 1.0]), up)
    return ((np.vstack((floor, wall)) + random.normal(0, 0.003, (1400, 3))) @ turn.T).astype(np.float32)


def test_no_frames_is_said_to_be_unreliable() -> None:
    found = gravity.estimate_up([], 0)
    assert not found.reliable and "no trusted frame" in found.source


def test_frames_without_points_take_the_camera_as_level_and_say_so() -> None:
    found = gravity.estimate_up([(np.eye(4), UNKNOWN, EMPTY)], 0)
    assert not found.reliable and np.allclose(found.up, [0, -1, 0])


def test_the_source_is_believed() -> None:
    up = np.array([0.0, -0.8, -0.6])
    found = gravity.estimate_up([(np.eye(4), up, EMPTY), (np.eye(4), UNKNOWN, EMPTY)], 0)
    assert found.source == "the source" and np.allclose(found.up, up)


@pytest.mark.parametrize("pitch", [0.0, 0.3, -0.4])
def test_floor_wins_over_a_larger_wall(pitch: float) -> None:
    up = np.array([0.0, -np.cos(pitch), -np.sin(pitch)])
    found = gravity.estimate_up([(np.eye(4), UNKNOWN, floor_and_wall(up))], 0)
    assert found.reliable
    assert np.degrees(np.arccos(found.up @ up)) < 0.5
    assert np.allclose(gravity.world_from_start(found.up)[:3, :3] @ found.up, [0, 0, 1])


def test_same_seed_same_direction() -> None:
    cloud = floor_and_wall(np.array([0.0, -1.0, 0.0])).astype(float)
    one, two = (gravity.find_level_plane(cloud, np.array([0.0, -1.0, 0.0]), 3) for _ in range(2))
    assert np.array_equal(one[0], two[0])


def test_only_a_wall_is_no_level_plane() -> None:
    random = np.random.default_rng(0)
    wall = np.column_stack((random.uniform(-2, 2, (500, 2)), random.normal(2, 0.002, 500))).astype(np.float32)
    assert not gravity.estimate_up([(np.eye(4), UNKNOWN, wall)], 0).reliable


@pytest.mark.parametrize(("roll", "up"), [(0, (0, -1, 0)), (90, (-1, 0, 0)), (180, (0, 1, 0)), (270, (1, 0, 0))])
def test_a_turned_mount_turns_up(roll: int, up: tuple[int, int, int]) -> None:
    blind = [(np.eye(4), np.full(3, np.nan), np.zeros((0, 3), np.float32))]
    assert np.allclose(gravity.estimate_up(blind, 0, np.deg2rad(roll)).up, up)
