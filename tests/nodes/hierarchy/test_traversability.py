import numpy as np
import pytest

from placegraph.nodes.hierarchy.floors import FloorSpan
from placegraph.nodes.hierarchy.plan_grid import PlanGrid
from placegraph.nodes.hierarchy.traversability import TraversabilityConfig, compute_traversability, drop_off_points

GRID = PlanGrid(np.zeros(2), 0.05, (80, 80))  # 4 x 4 m
SPAN = FloorSpan(0.0, 2.6, -0.1, 2.9)
NOTHING = np.zeros((0, 3))
PATH = np.zeros((0, 2, 3))


def spread(x, y, z, step=0.05):
    return np.stack(np.meshgrid(np.arange(x[0], x[1], step) + step / 2, np.arange(y[0], y[1], step) + step / 2, [z])
                    , axis=-1).reshape(-1, 3)  # fmt: skip


FLOOR = spread((0.5, 3.5), (0.5, 3.5), 0.0)
FREE = spread((0.5, 3.5), (0.5, 3.5), 0.75, 0.1)


def ground(points=FLOOR, free=FREE, path=PATH, below=NOTHING, **settings):
    config = TraversabilityConfig(**settings)
    deep = drop_off_points(below, SPAN, config)
    return compute_traversability(points, deep, free, 0.1, np.asarray(path, float), GRID, SPAN, config)


def at(image, x, y):
    return image[int(y / 0.05), int(x / 0.05)]


def test_floor_seen_through_free_space_is_passable_and_nothing_else():
    made = ground()
    assert at(made.passable, 2, 2) and at(made.standable, 2, 2) and not at(made.passable, 0.2, 2)
    assert at(made.passable, 0.6, 2) and not at(made.standable, 0.6, 2)
    assert at(made.clearance_m, 2.0, 0.62) == pytest.approx(0.12, abs=0.06)


@pytest.mark.parametrize(("points", "free"), [(FLOOR, NOTHING), (NOTHING, FREE), (NOTHING, NOTHING)])
def test_unknown_is_not_passable(points, free):
    assert not ground(points, free).passable.any()


@pytest.mark.parametrize(("low", "high", "blocked"), [(0.2, 0.5, 1), (0.02, 0.1, 0), (1.8, 2.4, 0), (1.2, 2.4, 1)])
def test_what_stands_on_the_floor_or_hangs_too_low_is_in_the_way(low, high, blocked):
    post = np.array([(2.025, 2.025, z) for z in np.arange(low, high, 0.05)])
    assert at(ground(np.concatenate((FLOOR, post))).passable, 2.025, 2.025) != blocked


def test_a_thin_table_top_is_in_the_way_and_a_single_voxel_is_not():
    assert not at(ground(np.concatenate((FLOOR, spread((1.5, 2.5), (1.5, 2.5), 0.7)))).passable, 2, 2)
    assert at(ground(np.concatenate((FLOOR, [(2.025, 2.025, 0.7)]))).passable, 2.025, 2.025)


def test_the_noise_before_a_wall_is_no_obstacle_and_a_low_thing_before_it_is():
    wall = np.concatenate([spread((1.0, 3.0), (3.0, 3.1), z) for z in np.arange(0.2, 2.4, 0.05)])
    noise = np.concatenate([spread((1.0, 3.0), (2.9, 3.0), z) for z in (0.5, 0.9, 1.3)])
    box = np.concatenate([spread((1.5, 2.0), (2.7, 3.0), z) for z in (0.2, 0.25, 0.3)])
    made = ground(np.concatenate((FLOOR, wall, noise, box)))
    assert at(made.passable, 2.5, 2.95) and not at(made.passable, 2.5, 3.05) and not at(made.passable, 1.75, 2.75)


def test_where_the_camera_went_the_robot_may_stand_whatever_was_seen():
    made = ground(NOTHING, NOTHING, [((1, 1, 1.4), (2, 1, 1.4))])
    assert at(made.standable, 1.5, 1) and at(made.passable, 1.5, 1.2) and not at(made.passable, 1.5, 1.4)


def test_the_blind_spot_below_the_camera_is_floor_unless_the_ground_falls_away():
    hole = FLOOR[np.hypot(FLOOR[:, 0] - 2, FLOOR[:, 1] - 2) > 0.5]
    beside = [((1.2, 2, 1.4), (1.3, 2, 1.4))]
    assert not at(ground(hole).passable, 2, 2)
    assert at(ground(hole, path=beside).passable, 2, 2)
    assert not at(ground(hole, path=beside, below=spread((1.5, 2.5), (1.5, 2.5), -0.5)).passable, 2, 2)
    assert at(ground(hole, path=beside, below=spread((1.5, 2.5), (1.5, 2.5), -2.5)).passable, 2, 2)


def test_obstacle_levels_are_those_of_the_highest_point_below_the_robot_s_height():
    post = np.array([(2.025, 2.025, z) for z in np.arange(0.2, 0.93, 0.05)])
    lamp = np.array([(1.025, 1.025, z) for z in np.arange(1.8, 2.0, 0.05)])
    tops = ground(np.concatenate((FLOOR, post, lamp))).obstacle_levels
    assert at(tops, 2.025, 2.025) == 9 and at(tops, 1.025, 1.025) == 0
