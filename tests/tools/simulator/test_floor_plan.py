"""Floor plans: the floors asked for, rooms apart and joined, walls that hold their openings, stairs to walk on."""

from __future__ import annotations

from functools import cache

import cv2
import numpy as np
import pytest

from placegraph.runtime.arrays import F64
from placegraph.runtime.errors import ConfigError
from placegraph.tools.simulator.building_mesh import split_into_rectangles, subtract_rectangles
from placegraph.tools.simulator.floor_plan import generate_floor_plan
from placegraph.tools.simulator.floor_plan_rooms import Rectangle, RoomCell
from placegraph.tools.simulator.floor_plan_walls import trace_walls
from placegraph.tools.simulator.house_model import ON_FLOOR, ON_WALL, House, Room, Staircase, Wall
from placegraph.tools.simulator.occupancy_grid import cells_in_polygon, points_in_polygon, unfurnished_grid

CASES = [(seed, None) for seed in (*range(9), 318)] + [(seed, floors) for seed in (20, 21) for floors in (1, 2, 3)]
CLIMBED = [(seed, floors) for seed in (*range(5), 20, 21) for floors in (2, 3)]
AREAS_M2 = {
    "living room": (16, 32), "kitchen": (8, 16), "bathroom": (4, 9), "bedroom": (10, 18), "dining room": (8.5, 17),
    "office": (6.5, 15), "laundry": (4, 9), "playroom": (8.5, 17), "hallway": (4, 36), "corridor": (4, 36),
}  # fmt: skip


@cache
def _house(seed: int, floors: int | None) -> House:
    return generate_floor_plan(seed, floors)


def _area(polygon: F64) -> float:
    """Signed, positive when counterclockwise."""
    x, y = polygon.T
    return float(0.5 * (x * np.roll(y, -1) - np.roll(x, -1) * y).sum())


def _point(wall: Wall, along_m: float, across_m: float = 0.0) -> F64:
    a, b = np.array(wall.a), np.array(wall.b)
    way = (b - a) / np.linalg.norm(b - a)
    return np.asarray(a + way * along_m + np.array([-way[1], way[0]]) * across_m)


def _way(stairs: Staircase) -> F64:
    run = (stairs.head - stairs.foot)[:2]
    return np.asarray(run / np.linalg.norm(run))


def _bytes(house: House) -> list[bytes]:
    arrays = [part.vertices for part in house.structure] + [room.polygon for room in house.rooms]
    arrays += [part.vertices for item in house.items for part in item.item.parts]
    return [array.tobytes() for array in arrays] + [repr([floor.walls for floor in house.floors]).encode()]


@pytest.mark.parametrize("floors", [0, 4, -1])
def test_a_number_of_floors_that_no_house_has_is_refused(floors: int) -> None:
    with pytest.raises(ConfigError, match=f"1 to 3 floors, not {floors}"):
        generate_floor_plan(0, floors)


def test_a_negative_seed_is_refused() -> None:
    with pytest.raises(ConfigError, match="-1"):
        generate_floor_plan(-1)


@pytest.mark.parametrize("floors", [1, 2, 3])
def test_the_number_of_floors_is_honored_and_each_flight_leads_one_up(floors: int) -> None:
    house = _house(20, floors)
    assert [floor.index for floor in house.floors] == list(range(floors))
    assert [stairs.floor for stairs in house.stairs] == list(range(floors - 1))
    assert house.floors[0].z_m == 0
    for low, high in zip(house.floors[:-1], house.floors[1:], strict=True):
        assert 2.5 <= low.height_m <= 2.8 and 0.249 <= high.z_m - low.z_m - low.height_m <= 0.301


def test_the_seed_chooses_one_to_three_floors() -> None:
    assert {len(_house(seed, None).floors) for seed in range(9)} == {1, 2, 3}


def test_equal_seeds_give_equal_bytes_and_others_differ() -> None:
    assert _bytes(generate_floor_plan(3)) == _bytes(generate_floor_plan(3))
    assert generate_floor_plan(3).lights == generate_floor_plan(3).lights
    assert _bytes(generate_floor_plan(3)) != _bytes(generate_floor_plan(4))


@pytest.mark.parametrize(("seed", "floors"), CASES)
def test_every_house_has_what_one_lives_in(seed: int, floors: int | None) -> None:
    house = _house(seed, floors)
    types = [room.type for room in house.rooms]
    assert {"living room", "kitchen", "bathroom", "bedroom"} <= set(types)
    assert [room.id for room in house.rooms] == list(range(len(types)))
    assert all(3 <= len(floor.rooms) <= 8 for floor in house.floors)
    assert all(room.floor == floor.index for floor in house.floors for room in floor.rooms)


@pytest.mark.parametrize(("seed", "floors"), CASES)
def test_rooms_are_counterclockwise_of_sensible_size_and_apart(seed: int, floors: int | None) -> None:
    house = _house(seed, floors)
    for room in house.rooms:
        least, most = AREAS_M2[room.type]
        assert least <= _area(room.polygon) <= most, (room.id, room.type)
        assert len(room.polygon) in (4, 6)
        steps = np.roll(room.polygon, -1, axis=0) - room.polygon
        assert (np.min(np.abs(steps), axis=1) < 1e-9).all() and (np.max(np.abs(steps), axis=1) > 0.3).all()
    for floor in house.floors:
        random = np.random.default_rng(0)
        low, high = floor.outline.min(axis=0), floor.outline.max(axis=0)
        points = random.uniform(low, high, (20_000, 2))
        taken = sum(points_in_polygon(room.polygon, points).astype(int) for room in floor.rooms)
        wells = [stairs.hole for stairs in house.stairs if stairs.floor == floor.index - 1]
        taken += sum((points_in_polygon(well, points).astype(int) for well in wells), np.zeros(len(points), int))
        assert np.max(taken) == 1, "rooms and stair holes share no ground"
        assert not np.any(taken[~points_in_polygon(floor.outline, points)]), "and lie within the outline"


@pytest.mark.parametrize(("seed", "floors"), CASES)
def test_openings_lie_in_their_wall_apart_and_join_the_rooms_they_say(seed: int, floors: int | None) -> None:
    for floor in _house(seed, floors).floors:
        for wall in floor.walls:
            ends = [0.0, *(v for hole in wall.openings for v in (hole.start_m, hole.end_m))]
            assert (np.diff([*ends, float(np.hypot(*np.subtract(wall.b, wall.a)))]) > 0.05).all()
            for hole in wall.openings:
                width, reach = hole.end_m - hole.start_m, wall.thickness_m / 2 + 0.05
                spots = [[_point(wall, along, s * reach) for along in (hole.start_m, hole.end_m)] for s in (-1, 1)]
                behind = [[_room_at(floor.rooms, spot) for spot in side] for side in spots]
                if hole.kind == "window":
                    assert 0.8 - 1e-9 <= width <= 2.0 and 0.5 <= hole.low_m <= 1.0 and 2.0 <= hole.high_m <= 2.3
                    assert sorted(behind) == sorted([[-1, -1], [hole.rooms[0]] * 2])
                else:
                    assert sorted(behind) == [[room, room] for room in hole.rooms]
                    low, high = (0.85, 0.95) if hole.kind == "door" else (1.4, 2.6)
                    assert low - 1e-9 <= width <= high + 1e-9 and hole.low_m == 0 and hole.high_m >= 2.04


def _room_at(rooms: tuple[Room, ...], xy: F64) -> int:
    return next((room.id for room in rooms if points_in_polygon(room.polygon, xy[None])[0]), -1)


@pytest.mark.parametrize(("seed", "floors"), CASES)
def test_one_can_walk_to_every_room_and_to_both_ends_of_the_stairs(seed: int, floors: int | None) -> None:
    house, cell = _house(seed, floors), 0.05
    for floor in house.floors:
        origin, walkable = unfurnished_grid(house, floor.index, cell)
        for item in house.items:
            low, high = item.box[:, 2] - floor.z_m
            if low < 1.6 and high > 0.03:
                walkable[cells_in_polygon(item.footprint, origin, walkable.shape, cell)] = False
        free_spans = (
            cv2.distanceTransform(np.pad(walkable, 1).astype(np.uint8), cv2.DIST_L2, 5)[1:-1, 1:-1] * cell > 0.28
        )
        _, parts = cv2.connectedComponents(free_spans.astype(np.uint8), connectivity=4)
        main = parts == np.bincount(parts[free_spans]).argmax()
        for room in floor.rooms:
            assert main[cells_in_polygon(room.polygon, origin, main.shape, cell)].mean() > 0.25, (room.id, room.type)
        for stairs in house.stairs:
            for level, end, sign in ((stairs.floor, stairs.foot, -1), (stairs.floor + 1, stairs.head, 1)):
                if level == floor.index:
                    column, row = np.floor((end[:2] + sign * 0.5 * _way(stairs) - origin) / cell).astype(int)
                    assert main[row, column], "landing"


@pytest.mark.parametrize(("seed", "floors"), CLIMBED)
def test_flights_fit_their_item_and_their_hole(seed: int, floors: int) -> None:
    house = _house(seed, floors)
    items = [item for item in house.items if item.item.name == "stairs"]
    assert len(items) == len(house.stairs)
    for item, stairs in zip(items, house.stairs, strict=True):
        lower, upper = house.floors[stairs.floor], house.floors[stairs.floor + 1]
        way, across = _way(stairs), np.array([-_way(stairs)[1], _way(stairs)[0]])
        assert stairs.foot[2] == lower.z_m and stairs.head[2] == upper.z_m
        assert 0.9 <= stairs.width_m <= 1.1 and 3.2 <= np.linalg.norm((stairs.head - stairs.foot)[:2]) <= 4.2
        corners = [e[:2] + s * across * stairs.width_m / 2 for e in (stairs.foot, stairs.head) for s in (-1, 1)]
        np.testing.assert_allclose(np.sort(item.footprint, axis=0), np.sort(corners, axis=0), atol=0.02)
        assert item.support == ON_FLOOR and house.rooms[item.room].floor == stairs.floor
        np.testing.assert_allclose(item.box[:, 2], [lower.z_m, upper.z_m], atol=0.02)
        tops = item.vertices_world[item.vertices_world[:, 2] > upper.z_m - 0.25]
        assert ((tops[:, :2] - (item.x, item.y)) @ way).min() > 0, "it rises towards the head"
        middle = np.mean(corners, axis=0)
        inset = np.array([middle + (corner - middle) * 0.99 for corner in corners])
        assert points_in_polygon(stairs.hole, inset).all(), "the hole is above the whole flight"
        assert points_in_polygon(house.rooms[item.room].polygon, inset).all()
        for level, end, sign in ((lower, stairs.foot, -1), (upper, stairs.head, 1)):
            strip = [end[:2] + sign * d * way + s * across * 0.42 for d in (0.05, 0.45, 0.9) for s in (-1, 0, 1)]
            assert len({_room_at(level.rooms, spot) for spot in strip} - {-1}) == 1
            assert all(_room_at(level.rooms, spot) >= 0 for spot in strip), "a landing"
        _assert_railed(house, stairs)


@pytest.mark.parametrize(("seed", "floors"), CLIMBED)
def test_a_person_fits_above_every_step(seed: int, floors: int) -> None:
    house = _house(seed, floors)
    triangles = np.concatenate([part.vertices[part.faces] for part in house.structure])
    low, high = triangles.min(axis=1), triangles.max(axis=1)
    for stairs in house.stairs:
        across = np.array([-_way(stairs)[1], _way(stairs)[0], 0.0]) * 0.4
        for share in np.linspace(0, 1, 30):
            step = stairs.foot * (1 - share) + stairs.head * share
            left, right = np.minimum(step - across, step + across), np.maximum(step - across, step + across)
            left[2], right[2] = step[2] + 0.25, step[2] + 2.0
            assert not np.any(np.all((low < right) & (high > left), axis=1)), (stairs.floor, share)


def _assert_railed(house: House, stairs: Staircase) -> None:
    """Around the hole something upright stands at .5 m above the upper floor, but not at the head."""
    z = house.floors[stairs.floor + 1].z_m
    triangles = np.concatenate([part.vertices[part.faces] for part in house.structure])
    boxes = np.stack((triangles.min(axis=1), triangles.max(axis=1)), axis=1)
    upright = boxes[(boxes[:, 0, 2] < z + 0.4) & (boxes[:, 1, 2] > z + 0.6) & (boxes[:, 1, 2] < z + 2.9)]
    for a, b in zip(stairs.hole, np.roll(stairs.hole, -1, axis=0), strict=True):
        for spot in (a * (1 - t) + b * t for t in (0.1, 0.5, 0.9)):
            stands = np.all((upright[:, 0, :2] - 0.06 <= spot) & (spot <= upright[:, 1, :2] + 0.06), axis=1).any()
            at_head = abs((spot - stairs.head[:2]) @ _way(stairs)) < 1e-6
            assert stands != at_head


@pytest.mark.parametrize(("seed", "floors"), CASES)
def test_items_are_counted_and_doors_and_windows_stand_where_they_belong(seed: int, floors: int | None) -> None:
    house = _house(seed, floors)
    assert [item.id for item in house.items] == list(range(len(house.items)))
    assert {item.item.name for item in house.items} <= {"door", "window", "stairs"}
    windows = sum(hole.kind == "window" for floor in house.floors for wall in floor.walls for hole in wall.openings)
    assert sum(item.item.name == "window" for item in house.items) == windows
    for item in house.items:
        room = house.rooms[item.room]
        if item.item.name == "door":
            assert points_in_polygon(room.polygon, item.footprint).all()
        if item.item.name == "window":
            assert item.support == ON_WALL
            front = np.array([np.sin(item.yaw), -np.cos(item.yaw)])
            assert points_in_polygon(room.polygon, (np.array([item.x, item.y]) + 0.5 * front)[None])[0]


@pytest.mark.parametrize(("seed", "floors"), CASES)
def test_the_structure_is_light_and_every_room_is_lit(seed: int, floors: int | None) -> None:
    house = _house(seed, floors)
    assert sum(len(part.faces) for part in house.structure) < 4000 * len(house.floors)
    lights = np.array(house.lights)
    for room in house.rooms:
        floor = house.floors[room.floor]
        here = points_in_polygon(room.polygon, lights[:, :2]) & (
            np.abs(lights[:, 2] - floor.z_m - floor.height_m + 0.25) < 1e-9
        )
        assert here.sum() in (1, 2)


def test_the_floor_is_seen_below_every_spot_of_a_room_and_not_in_the_hole() -> None:
    house = _house(20, 2)
    floor, stairs = house.floors[1], house.stairs[0]
    for polygon, covered in [(room.polygon, True) for room in floor.rooms] + [(stairs.hole, False)]:
        spots = polygon.mean(axis=0) + (polygon - polygon.mean(axis=0)) * 0.3
        spots = spots[points_in_polygon(polygon, spots)]
        hit = np.zeros(len(spots), bool)
        for part in house.structure:
            for triangle in part.vertices[part.faces]:
                if np.ptp(triangle[:, 2]) < 1e-9 and abs(triangle[0, 2] - floor.z_m) < 0.005:
                    hit |= points_in_polygon(triangle[:, :2], spots)
        assert (hit == covered).all()


def test_a_wall_less_its_holes_is_all_of_the_rest() -> None:
    pieces = subtract_rectangles((0, 4, 0, 2.5), [(1, 2, -0.01, 2), (3, 3.5, 1, 2), (3.8, 5, 0, 3)])
    assert sum((b - a) * (d - c) for a, b, c, d in pieces) == pytest.approx(4 * 2.5 - 2 - 0.5 - 0.2 * 2.5)
    assert not any(a < 1.5 < b and c < 1 < d for a, b, c, d in pieces)


def test_an_l_less_a_hole_is_cut_into_rectangles() -> None:
    polygon = np.array([[0, 0], [4, 0], [4, 2], [2, 2], [2, 4], [0, 4.0]])
    places = split_into_rectangles(polygon, (np.array([[0, 0], [1, 0], [1, 1], [0, 1.0]]),))
    assert sum((p.x1 - p.x0) * (p.y1 - p.y0) for p in places) == pytest.approx(11)
    assert not any(one.meets(other) for k, one in enumerate(places) for other in places[:k])


def test_a_room_ends_at_its_walls_faces_and_its_side_knows_what_lies_behind() -> None:
    cells = [RoomCell("hallway", Rectangle(0, 0, 6, 2)), RoomCell("office", Rectangle(0, 2, 3, 5))]
    grid = trace_walls(cells, None, None, 0.2, 0.1)
    np.testing.assert_allclose(grid.polygons[1].min(axis=0), [0.1, 2.1])  # the wall goes on outside: thick all along
    np.testing.assert_allclose(grid.polygons[1].max(axis=0), [2.9, 4.9])
    assert _area(grid.outline) == pytest.approx(6.2 * 2.2 + 3.2 * 3.0)
    (top,) = [side for side in grid.sides if side.room == 0 and side.at_m == pytest.approx(1.9)]
    assert [face.behind for face in top.stretches] == [1, -1]
