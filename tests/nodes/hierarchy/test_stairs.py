import numpy as np
import pytest

from placegraph.nodes.hierarchy.floors import FloorConfig, FloorSpan
from placegraph.nodes.hierarchy.stairs import NO_FLOOR, find_stairs, path_segments_on, standing_floors
from placegraph.nodes.hierarchy.traversability import TraversabilityConfig

SPANS = [FloorSpan(0.0, 2.6, -0.1, 2.9), FloorSpan(3.0, 5.6, 2.9, 6.0)]
CONFIG = TraversabilityConfig()
BELOW = np.array([(x, 0, 1.4) for x in np.linspace(-3, 0, 13)])
CLIMB = np.array([(0.25 * i, 0, 1.4 + 0.25 * i) for i in range(1, 12)])
ABOVE = np.array([(x, 0, 4.4) for x in np.linspace(3, 6, 13)])
NOTHING = np.zeros((0, 3))


def stairs_of(path, points=NOTHING, spans=SPANS):
    standing = standing_floors(path, spans, FloorConfig(), CONFIG)
    return find_stairs(path, standing, spans, points, CONFIG)


def test_no_camera_or_no_floor():
    assert stairs_of(NOTHING) == [] and stairs_of(ABOVE, spans=[]) == []
    assert len(path_segments_on(0, NOTHING, np.zeros(0, np.int64), CONFIG)) == 0


def test_standing_is_being_at_the_usual_height():
    path = np.concatenate((BELOW, CLIMB, ABOVE))
    standing = standing_floors(path, SPANS, FloorConfig(), CONFIG)
    assert standing.tolist() == [0] * 13 + [NO_FLOOR] * 11 + [1] * 13
    assert len(path_segments_on(0, path, standing, CONFIG)) == 12


@pytest.mark.parametrize("down", [False, True])
def test_one_flight_up_or_down(down):
    path = np.concatenate((BELOW, CLIMB, ABOVE))
    (stairs,) = stairs_of(path[::-1] if down else path)
    assert stairs.floors == (0, 1)
    np.testing.assert_allclose(stairs.ends, [[0, 0, 0], [3, 0, 3]])
    assert stairs.length_m == pytest.approx(np.hypot(3, 3))


def test_a_flight_climbed_twice_is_one_and_another_is_another():
    back = np.array([(3, 2.0, 4.4), (3, 1, 4.4)])
    path = np.concatenate((BELOW, CLIMB, ABOVE, ABOVE[::-1], CLIMB[::-1], BELOW[::-1]))
    assert len(stairs_of(path)) == 1
    elsewhere = np.array([0, 5.0, 0])
    other = np.concatenate((path, BELOW, np.linspace(BELOW[-1], BELOW[0] + elsewhere, 20), BELOW + elsewhere,
                            CLIMB + elsewhere, ABOVE + elsewhere, back))  # fmt: skip
    assert len(stairs_of(other)) == 2


def test_half_way_up_and_back_and_a_jump_are_no_stairs():
    assert stairs_of(np.concatenate((BELOW, CLIMB[:5], CLIMB[:5][::-1], BELOW[::-1]))) == []
    assert stairs_of(np.concatenate((BELOW, ABOVE + np.array([4, 0, 0])))) == []


def test_width_between_walls_beside_the_camera():
    x, z = np.meshgrid(np.arange(0, 3, 0.05), np.arange(0, 5, 0.05))
    walls = [np.stack((x.ravel(), np.full(x.size, y), z.ravel()), axis=1) for y in (-0.45, 0.6)]
    (stairs,) = stairs_of(np.concatenate((BELOW, CLIMB, ABOVE)), np.concatenate(walls))
    assert stairs.width_m == pytest.approx(0.9, abs=0.05)
