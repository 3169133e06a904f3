import numpy as np
import pytest

from placegraph.nodes.hierarchy.approach_poses import ApproachTarget, find_approach
from placegraph.nodes.hierarchy.plan_grid import PlanGrid
from placegraph.nodes.hierarchy.traversability import LEVEL_M, TraversabilityConfig, TraversabilityMap

CONFIG = TraversabilityConfig()
GRID = PlanGrid(np.array([-1.0, -2.0]), 0.05, (80, 80))  # 4 x 4 m


def middles():
    rows, columns = np.mgrid[:80, :80]
    return GRID.origin + (np.stack((columns, rows), axis=-1) + 0.5) * 0.05


def boxed(low, high):
    xy = middles()
    return (xy >= low).all(axis=-1) & (xy <= high).all(axis=-1)


def target(low, high, z):
    footprint = np.array([[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]])
    return ApproachTarget(footprint, np.array([*footprint.mean(axis=0), z]))


def stand(thing, walls=(), here=None, reached=None, clearance=1.0):
    """walls: (low, high, height in metres) of what stands in the room."""
    tops = np.zeros(GRID.shape, np.uint8)
    free = np.ones(GRID.shape, bool)
    for low, high, height in walls:
        tops[boxed(low, high)] = round(height / LEVEL_M)
        free &= ~boxed(np.array(low) - 0.25, np.array(high) + 0.25)
    here = free if here is None else here & free
    ground = TraversabilityMap(GRID, 0.0, free, np.full(GRID.shape, clearance, np.float32), free, tops)
    found = find_approach(thing, here, here if reached is None else reached, ground, CONFIG)
    return found and (*middles()[found.cell], found.yaw_rad)


def test_an_object_on_the_floor_is_faced_from_just_outside_the_robot_s_radius():
    x, y, yaw = stand(target((0.9, -0.1), (1.1, 0.1), 0.1))
    gap = max(abs(x - 1), abs(y)) - 0.1
    assert CONFIG.robot_radius_m <= gap < 0.45
    assert np.allclose([np.cos(yaw), np.sin(yaw)], np.array([1 - x, -y]) / np.hypot(1 - x, y), atol=0.03)


def test_an_object_in_a_corner_is_faced_from_inside_the_room():
    corner = [((-1, -2), (-0.9, 2), 1.5), ((-1, -2), (3, -1.9), 1.5)]
    x, y, yaw = stand(target((-0.85, -1.85), (-0.6, -1.6), 0.3), corner)
    assert x > -0.7 and y > -1.7 and (np.cos(yaw) < 0 or np.sin(yaw) < 0)


def test_a_cup_is_seen_over_its_table_and_not_over_a_cupboard():
    cup = target((0.9, -0.05), (1.0, 0.05), 0.8)
    table = ((0.6, -0.6), (1.2, 0.6), 0.7)
    x, y, _ = stand(cup, [table])
    assert 0.25 < max(0.6 - x, x - 1.2, abs(y) - 0.6) < 0.45
    assert stand(cup, [((0.6, -0.6), (1.2, 0.6), 1.4)]) is None
    half = ((0.6, -0.6), (0.8, 0.6), 1.4)  # a high back: only from the other side
    assert stand(cup, [table, half])[0] > 0.8


def test_out_of_reach_outside_the_room_or_with_no_room_at_all_there_is_no_place():
    ball = target((0.9, -0.1), (1.1, 0.1), 0.1)
    assert stand(ball, here=boxed((2.3, -2), (3, 2))) is None
    assert stand(ball, here=np.zeros(GRID.shape, bool)) is None
    assert stand(target((8.9, -0.1), (9.1, 0.1), 0.1)) is None


def test_a_place_that_can_be_reached_goes_before_a_nearer_one():
    ball = target((0.9, -0.1), (1.1, 0.1), 0.1)
    assert stand(ball, reached=boxed((1.5, -2), (3, 2)))[0] >= 1.5
    assert stand(ball, reached=np.zeros(GRID.shape, bool)) is not None


@pytest.mark.parametrize("height", [2.0, 2.5])
def test_what_hangs_high_is_not_hidden_by_low_things(height):
    assert stand(target((0.9, -0.1), (1.1, 0.1), height), [((0.3, -2), (0.35, 2), 1.2)]) is not None


def test_a_roomy_place_goes_before_a_nearer_one_that_barely_fits():
    ball = target((0.9, -0.1), (1.1, 0.1), 0.1)
    roomy = np.where(boxed((1.5, -2), (3, 2)), 0.5, CONFIG.robot_radius_m)
    assert stand(ball, clearance=roomy)[0] >= 1.5
    assert stand(ball, clearance=CONFIG.robot_radius_m) is not None
