import itertools

import numpy as np
import pytest

from placegraph.nodes.hierarchy.floors import FloorConfig, find_floors

NO_CAMERAS = np.zeros((0, 3))


def floors(points, cameras=NO_CAMERAS, **changes):
    return find_floors(np.asarray(points, float).reshape(-1, 3), np.asarray(cameras, float), FloorConfig(**changes))


def sheet(z, size=4.0, start=0.0):
    axis = np.arange(0.025, size, 0.05)
    x, y = np.meshgrid(start + axis, axis)
    return np.stack((x.ravel(), y.ravel(), np.full(x.size, z)), axis=1)


def test_no_points_no_floor():
    assert floors([]) == []


@pytest.mark.parametrize("cameras", [NO_CAMERAS, [[0, 0, 1.5]], [[0, 0, -9]]])
def test_one_point_is_a_floor(cameras):
    (span,) = floors([[1.0, 2, 3]], cameras)
    assert span.low_m == pytest.approx(3, abs=0.01) and span.high_m == pytest.approx(3, abs=0.01)


def test_one_plane_and_no_ceiling():
    (span,) = floors(sheet(0.0), [[1, 1, 1.4]])
    assert span.low_m == pytest.approx(0, abs=0.01) and span.low_m <= span.high_m < 0.1


def test_only_a_wall_gives_a_provisional_floor_at_its_foot():
    z, y = np.meshgrid(np.arange(-1, 1.5, 0.01), np.arange(0, 3, 0.05))
    wall = np.stack((np.zeros(z.size), y.ravel(), z.ravel()), axis=1)
    (span,) = floors(wall, [[2, 1, 0.3]])
    assert span.low_m == pytest.approx(-1, abs=0.15) and span.high_m == pytest.approx(1.5, abs=0.1)


@pytest.mark.parametrize("storeys", [1, 2, 3])
def test_storeys_of_a_house(house_points, walk, storeys):
    found = floors(house_points(storeys), walk(storeys))
    assert [round(f.low_m, 1) for f in found] == [0.0, 3.0, 6.0][:storeys]
    assert [round(f.high_m, 1) for f in found] == [2.6, 5.6, 8.6][:storeys]
    for below, above in itertools.pairwise(found):
        assert below.zone_high_m == above.zone_low_m


def test_noise_of_the_sensor_does_not_move_floors(house_points, walk):
    points = house_points(2) + np.random.default_rng(0).normal(0, 0.015, (len(house_points(2)), 3))
    found = floors(points, walk(2))
    assert [f.low_m for f in found] == pytest.approx([0, 3], abs=0.03)


def test_a_storey_nobody_went_up_to_is_no_floor(house_points, walk):
    assert len(floors(house_points(2), walk(1))) == 1


def test_a_floor_of_a_few_square_metres_counts_when_someone_stood_on_it(house_points, walk):
    landing = np.concatenate((house_points(1), sheet(3.0, 3.0)))  # .9 of the strongest peak would lose it
    found = floors(landing, [*walk(2)])
    assert [round(f.low_m, 1) for f in found] == [0.0, 3.0]


def test_a_large_table_over_a_floor_hardly_seen_is_no_floor():
    rim = sheet(0.0, 1.0, 2.2)
    (span,) = floors(np.concatenate((sheet(0.75, 2.0), rim)), [[1, -0.5, 1.5]] * 5)
    assert span.low_m == pytest.approx(0, abs=0.02)


def test_a_step_of_half_a_metre_is_no_further_floor():
    points = np.concatenate((sheet(0.0), sheet(0.5, 4.0, 4.0)))
    cameras = [[x, 1, 1.5 if x < 4 else 2.0] for x in np.linspace(0, 8, 20)]
    assert len(floors(points, cameras)) == 1


def test_dense_points_in_a_corner_weigh_no_more_than_their_area(house_points, walk):
    heap = np.random.default_rng(1).uniform((0, 0, 1.29), (0.2, 0.2, 1.31), (50000, 3))
    found = floors(np.concatenate((house_points(1), heap)), walk(1))
    assert [round(f.low_m, 1) for f in found] == [0.0]


def test_two_exactly_flat_levels_with_nothing_between():
    grid = np.stack(np.meshgrid(np.arange(0, 5, 0.05), np.arange(0, 5, 0.05)), axis=-1).reshape(-1, 2)
    points = np.concatenate([np.insert(grid, 2, z, axis=1) for z in (0.0, 3.0)]).astype(np.float32)
    cameras = np.array([[2, 2, z] for z in (1.4, 4.4) for _ in range(5)], np.float32)
    spans = find_floors(points, cameras, FloorConfig())
    assert [span.low_m for span in spans] == pytest.approx([0, 3], abs=0.02)
    assert all(span.low_m <= span.high_m <= span.ceiling_m for span in spans)
