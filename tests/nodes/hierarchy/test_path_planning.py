from itertools import pairwise

import numpy as np
import pytest

from placegraph.nodes.hierarchy.path_planning import path_length_m, shortest_paths
from placegraph.nodes.hierarchy.plan_grid import PlanGrid

GRID = PlanGrid(np.array([10.0, -5.0]), 0.05, (60, 80))


def everywhere():
    return np.ones(GRID.shape, bool)


def test_no_cells_and_no_starts():
    assert shortest_paths([], np.zeros(GRID.shape, bool), GRID).distance_m.shape == (0, 60, 80)
    assert shortest_paths([], everywhere(), GRID).distance_m.shape == (0, 60, 80)


def test_one_cell_alone_reaches_itself():
    free = np.zeros(GRID.shape, bool)
    free[7, 9] = True
    paths = shortest_paths([(7, 9)], free, GRID)
    assert paths.distance_m[0, 7, 9] == 0 and np.isinf(paths.distance_m).sum() == free.size - 1
    points = paths.path(0, (7, 9))
    np.testing.assert_allclose(points, [[10.475, -4.625]] * 2)
    assert path_length_m(points) == 0


@pytest.mark.parametrize("end", [(10, 70), (50, 10), (40, 40), (55, 78), (17, 60), (30, 12)])
def test_the_way_over_open_ground_is_straight(end):
    paths = shortest_paths([(10, 10)], everywhere(), GRID)
    straight = 0.05 * np.hypot(end[0] - 10, end[1] - 10)
    assert straight - 1e-9 <= paths.distance_m[0][end] <= 1.028 * straight
    points = paths.path(0, end)
    assert len(points) == 2 and path_length_m(points) == pytest.approx(straight)


def test_around_a_wall():
    free = everywhere()
    free[:50, 40] = False  # x = 12.0 .. 12.05, up to y = -2.5
    paths = shortest_paths([(10, 10), (10, 70)], free, GRID)
    shortest = 2 * np.hypot(40.5, 29.5) * 0.05  # over the last free cell beside the wall's end, or nearly
    points = paths.path(0, (10, 70))
    assert shortest - 0.1 < path_length_m(points) < 1.03 * shortest
    assert path_length_m(points) <= paths.distance_m[0, 10, 70] + 1e-9
    assert paths.distance_m[0, 10, 70] == pytest.approx(paths.distance_m[1, 10, 10])
    line = np.concatenate([a + (b - a) * np.linspace(0, 1, 500)[:, None] for a, b in pairwise(points)])
    assert free[GRID.cells(line)].mean() > 0.99  # the corner of a cell may be cut by a centimetre


def test_no_way_through_a_closed_wall_nor_between_cells_that_touch_at_a_corner():
    free = everywhere()
    free[:, 40] = False
    assert np.isinf(shortest_paths([(10, 10)], free, GRID).distance_m[0, 10, 70])
    corner = np.zeros(GRID.shape, bool)
    corner[0, 0] = corner[1, 1] = True
    assert np.isinf(shortest_paths([(0, 0)], corner, GRID).distance_m[0, 1, 1])
