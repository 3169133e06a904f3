import numpy as np
import pytest

from placegraph.nodes.hierarchy.floors import FloorSpan
from placegraph.nodes.hierarchy.plan_grid import PlanGrid, floor_grid
from placegraph.nodes.hierarchy.rooms import (
    RoomConfig,
    distance_field,
    find_rooms,
    keep_walls,
    observed_mask,
    segment_rooms,
    wall_mask,
)

CONFIG = RoomConfig()
SPAN = FloorSpan(0.0, 2.6, -1.0, 3.0)
NOTHING = np.zeros((0, 3))


def rooms_of(points, free=NOTHING, span=SPAN):
    return find_rooms(np.asarray(points, float), free, 0.1, span, CONFIG)


def plan(*lines):
    """A plan of characters, 0.5 m each: '#' wall, '.' seen, ' ' unseen."""
    big = np.kron(np.array([[ord(c) for c in line] for line in lines]), np.ones((10, 10), int))
    return big == ord("#"), big != ord(" ")


def test_one_point_is_a_room():
    grid, (room,) = rooms_of([[1.0, 2, 0]])
    assert room.mask[grid.cells(np.array([[1.0, 2.0]]))].all()
    assert len(room.outline) >= 4 and np.abs(room.outline - (1, 2)).max() < 0.3


def test_without_walls_the_observed_area_is_one_room():
    x, y = np.meshgrid(np.arange(0, 3, 0.05), np.arange(0, 2, 0.05))
    grid, (room,) = rooms_of(np.stack((x.ravel(), y.ravel(), 0 * x.ravel()), axis=1))
    assert room.mask.sum() * grid.cell_m**2 == pytest.approx(6, rel=0.1)
    assert room.outline.min(axis=0) == pytest.approx((0, 0), abs=0.06)
    assert room.outline.max(axis=0) == pytest.approx((3, 2), abs=0.06)


def test_two_rooms_with_a_door(house_points):
    grid, rooms = rooms_of(house_points(1))
    assert [room.mask.sum() * grid.cell_m**2 for room in rooms] == pytest.approx([15.2, 15.2], rel=0.06)
    first, second = (room.outline.mean(axis=0) for room in rooms)
    assert sorted([first[0] < 4, second[0] < 4]) == [False, True]


def test_what_was_not_seen_is_not_a_room(house_points):
    half = house_points(1)
    half = half[half[:, 0] < 4.02]
    _, rooms = rooms_of(half)
    assert len(rooms) == 1 and rooms[0].outline.max(axis=0)[0] < 4.2


def test_space_seen_through_counts_as_room_without_points_of_its_floor(house_points):
    points = house_points(1)
    points = points[points[:, 2] > 0.1]
    points = points[points[:, 2] < 2.5]  # walls only
    x, y = np.meshgrid(np.arange(0.15, 3.9, 0.1), np.arange(0.15, 3.9, 0.1))
    grid, rooms = rooms_of(points, np.stack((x.ravel(), y.ravel(), 0 * x.ravel() + 1.25), axis=1))
    assert rooms[0].mask.sum() * grid.cell_m**2 == pytest.approx(15, rel=0.1)


def test_low_furniture_does_not_part_a_room(house_points):
    x, z = np.meshgrid(np.arange(0, 4, 0.05), np.arange(0, 1.2, 0.05))
    sideboard = np.stack((x.ravel(), 0 * x.ravel() + 2, z.ravel()), axis=1)
    assert len(rooms_of(np.concatenate((house_points(1), sideboard)))[1]) == 2


def test_a_narrow_corridor_beside_a_hall_is_a_room():
    walls, seen = plan(
        "################",
        "#..............#",
        "#..............#",
        "#######.########",
        "#..............#",
        "#..............#",
        "#..............#",
        "#..............#",
        "#..............#",
        "#..............#",
        "################",
    )
    labels = segment_rooms(walls, seen, CONFIG)
    assert labels.max() == 2
    assert labels[20, 20] == labels[20, 140] != labels[80, 80] == labels[60, 20]


def test_a_wide_opening_does_not_part_a_room():
    walls, seen = plan(
        "##########",
        "#........#",
        "#........#",
        "#........#",
        "##......##",
        "#........#",
        "#........#",
        "#........#",
        "##########",
    )
    assert segment_rooms(walls, seen, CONFIG).max() == 1


def test_unseen_cells_and_walls_have_no_label():
    walls, seen = plan("########  ", "#......#  ", "#......#  ", "#......#  ", "########  ")
    labels = segment_rooms(walls, seen, CONFIG)
    assert (labels[walls] == 0).all() and (labels[~seen] == 0).all() and (labels[seen & ~walls] == 1).all()


def test_space_too_narrow_for_a_seed_is_still_a_room():
    walls = np.ones((40, 40), bool)
    walls[10:13] = False
    assert (segment_rooms(walls, np.ones_like(walls), CONFIG) == ~walls).all()


def test_distance_field_is_in_metres():
    walls = np.zeros((81, 81), bool)
    walls[[0, -1]] = walls[:, [0, -1]] = True
    assert distance_field(walls, CONFIG)[40, 40] == pytest.approx(2.0, abs=0.15)


def test_walls_are_what_fills_the_slice_not_what_has_many_points():
    grid = PlanGrid(np.zeros(2), 0.05, (60, 60))
    y, z = (side.ravel() for side in np.meshgrid(np.arange(0.5, 2, 0.05), np.arange(0, 2.6, 0.05)))
    wall = np.stack((np.full(y.size, 0.525), y, z), axis=1)
    shelf = np.repeat(np.stack((np.full(30, 1.525), np.arange(0.5, 2, 0.05), np.full(30, 1.85)), axis=1), 50, axis=0)
    found = wall_mask(np.concatenate((wall, shelf)), SPAN, grid, CONFIG)
    assert found[20, 10] and not found[:, 20:].any()


@pytest.mark.parametrize(("width", "rooms"), [(0.5, 1), (3.0, 2)])
def test_a_lintel_parts_rooms_and_a_lamp_as_high_does_not(width, rooms):
    ground = [[x, y, 0.0] for x in np.arange(0.025, 6, 0.05) for y in np.arange(0.025, 3, 0.05)]
    walls = [[x, y, z] for z in np.arange(0, 2.6, 0.05) for x in np.arange(0.025, 6, 0.05) for y in (0.025, 2.975)]
    walls += [[x, y, z] for z in np.arange(0, 2.6, 0.05) for y in np.arange(0.025, 3, 0.05) for x in (0.025, 5.975)]
    ys = 1.5 + np.arange(-width / 2 + 0.025, width / 2, 0.05)
    hanging = [[x, y, z] for x in (2.975, 3.025) for y in ys for z in (2.1, 2.15, 2.2)]
    assert len(rooms_of(ground + walls + hanging)[1]) == rooms


def test_no_tall_points_no_walls():
    grid = PlanGrid(np.zeros(2), 0.05, (10, 10))
    assert not wall_mask(np.zeros((3, 3)), SPAN, grid, CONFIG).any()
    assert not wall_mask(np.zeros((3, 3)), FloorSpan(0.0, 0.0, 0.0, 0.0), grid, CONFIG).any()


def test_gaps_in_the_observed_area_are_closed_also_at_the_border():
    x, y = np.meshgrid(np.arange(0, 2, 0.2), np.arange(0, 2, 0.2))
    points = np.stack((x.ravel(), y.ravel(), 0 * x.ravel()), axis=1)
    grid = floor_grid(points, 0.05)
    observed = observed_mask(points, NOTHING, 0.1, grid, CONFIG)
    assert observed[5:-6, 5:-6].all() and not observed[0].any()


def test_outline_of_a_rectangle_is_exact():
    mask = np.zeros((20, 30), bool)
    mask[5:15, 10:25] = True
    outline = PlanGrid(np.array([1.0, 2.0]), 0.1, (20, 30)).outline(mask)
    assert outline.min(axis=0) == pytest.approx((2.0, 2.5), abs=0.06)
    assert outline.max(axis=0) == pytest.approx((3.5, 3.5), abs=0.06)


@pytest.mark.parametrize("count", [0, 1])
def test_pieces_shorter_than_a_wall_are_no_walls(count: int) -> None:
    occupied = np.zeros((60, 60), bool)
    assert not keep_walls(occupied, CONFIG).any()
    occupied[5, 5 : 5 + 40 * count] = True  # two metres of wall
    occupied[30:40, 30:40] = True  # half a metre of table
    walls = keep_walls(occupied, CONFIG)
    assert walls.sum() == 40 * count and not walls[30:40, 30:40].any()
