import cv2
import numpy as np
import pytest

from placegraph.nodes.hierarchy.openings import NO_ROOM, find_openings, grow_rooms
from placegraph.nodes.hierarchy.plan_grid import PlanGrid
from placegraph.nodes.hierarchy.traversability import TraversabilityConfig, TraversabilityMap

CONFIG = TraversabilityConfig()
SHAPE = (60, 120)  # 3 x 6 m


def ground(passable):
    clearance = cv2.distanceTransform(np.pad(passable, 1).astype(np.uint8), cv2.DIST_L2, 0)[1:-1, 1:-1] * 0.05 - 0.025
    clearance[~passable] = 0
    standable = clearance >= CONFIG.robot_radius_m
    return TraversabilityMap(
        PlanGrid(np.zeros(2), 0.05, SHAPE), 0.0, passable, clearance, standable, np.zeros(SHAPE, np.uint8)
    )


def two_rooms(*doors):
    """Rooms left and right of a wall of four columns; doors as rows (from, to). Gives masks and what is passable."""
    west, east = np.zeros(SHAPE, bool), np.zeros(SHAPE, bool)
    west[2:-2, 2:58], east[2:-2, 62:-2] = True, True
    passable = west | east
    for low, high in doors:
        passable[low:high, 58:62] = True
    return [west, east], passable


def openings(masks, passable):
    here = ground(passable)
    return find_openings(grow_rooms(masks, here, CONFIG), here, CONFIG)


def test_nothing_is_passable():
    masks, _ = two_rooms()
    assert openings(masks, np.zeros(SHAPE, bool)) == []
    assert (grow_rooms(masks, ground(np.zeros(SHAPE, bool)), CONFIG) == NO_ROOM).all()


@pytest.mark.parametrize(("doors", "found"), [((), 0), (((20, 38),), 1), (((20, 26),), 0), (((4, 22), (30, 48)), 2)])
def test_each_gap_wide_enough_for_the_robot_is_an_opening(doors, found):
    made = openings(*two_rooms(*doors))
    assert [one.rooms for one in made] == [(0, 1)] * found
    for one, (low, high) in zip(made, doors, strict=False):
        assert low < one.cell[0] < high and 57 <= one.cell[1] <= 62
        assert one.width_m == pytest.approx((high - low) * 0.05, abs=0.06)


def test_no_opening_into_a_room_without_standable_room():
    masks, passable = two_rooms((20, 38))
    passable[:, 66:] = False
    assert openings(masks, passable) == []


def test_rooms_do_not_grow_through_more_than_a_wall():
    masks, passable = two_rooms((20, 38))
    masks[1][:, :90] = False  # 1.5 m that no room claims
    assert openings(masks, passable) == []
