"""Furnished houses: nothing collides, everything is where it belongs, every room stays walkable, groups are true."""

from __future__ import annotations

from functools import cache

import cv2
import numpy as np
import pytest
from scipy.spatial import ConvexHull

from placegraph.runtime.errors import ConfigError
from placegraph.tools.simulator.furniture_groups.group_layout import GroupLayout, nearest_fit
from placegraph.tools.simulator.house_model import (
    NOWHERE,
    ON_CEILING,
    ON_FLOOR,
    ON_WALL,
    Floor,
    House,
    Item,
    Material,
    PlacedItem,
    Room,
    SupportSurface,
    Wall,
    WallOpening,
)  # fmt: skip
from placegraph.tools.simulator.mesh_primitives import box
from placegraph.tools.simulator.object_classes import NAMES
from placegraph.tools.simulator.occupancy_grid import PASSAGE_KINDS, free_grid, opening_rectangle, points_in_polygon
from placegraph.tools.simulator.room_furnishing import furnish

F64 = np.typing.NDArray[np.float64]
SEEDS = range(10)
T = 0.12  # thickness of the test house's walls


def footprint_rectangle(x0: float, y0: float, x1: float, y1: float) -> F64:
    return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]], float)


def bare_house(seed: int) -> House:
    """Two rows of rooms with a hallway between them; an L-shaped living room; doors, an archway and windows."""
    d, h = T / 2, 2.6
    rooms = (
        Room(0, 0, "hallway", footprint_rectangle(d, 4 + d, 12 - d, 5.6 - d)),
        Room(1, 0, "living room", np.array([[d, d], [6 - d, d], [6 - d, 4 - d], [4, 4 - d], [4, 3], [d, 3]], float)),
        Room(2, 0, "kitchen", footprint_rectangle(6 + d, d, 9 - d, 4 - d)),
        Room(3, 0, "bathroom", footprint_rectangle(9 + d, d, 12 - d, 4 - d)),
        Room(4, 0, "bedroom", footprint_rectangle(d, 5.6 + d, 4.2 - d, 9.4 - d)),
        Room(5, 0, "office", footprint_rectangle(4.2 + d, 5.6 + d, 8 - d, 9.4 - d)),
        Room(6, 0, "playroom", footprint_rectangle(8 + d, 5.6 + d, 12 - d, 9.4 - d)),
    )

    def opening(kind: str, start: float, width: float, *ids: int) -> WallOpening:
        low, high = (0.8, 2.1) if kind == "window" else (0.0, 2.05)
        return WallOpening(kind, start, start + width, low, high, ids)

    def door(start: float, width: float, *ids: int) -> WallOpening:
        return opening("door", start, width, *ids)

    walls = (
        Wall((0, 0), (12, 0), T, tuple(opening("window", *at) for at in ((1, 1.6), (7, 1.2), (10, 0.8)))),
        Wall((12, 0), (12, 9.4), T),
        Wall((12, 9.4), (0, 9.4), T, tuple(opening("window", *at) for at in ((1.5, 1.4), (5.5, 1.2), (9, 2)))),
        Wall((0, 9.4), (0, 0), T, (opening("door", 4.2, 0.9, 0),)),
        Wall((0, 4), (12, 4), T, (opening("archway", 4.3, 1.5, 0, 1), door(7, 0.85, 0, 2), door(10, 0.85, 0, 3))),
        Wall((0, 5.6), (12, 5.6), T, (door(3, 0.9, 0, 4), door(5, 0.9, 0, 5), door(9, 0.9, 0, 6))),
        Wall((6, 0), (6, 4), T), Wall((9, 0), (9, 4), T), Wall((4.2, 5.6), (4.2, 9.4), T), Wall((8, 5.6), (8, 9.4), T),
        Wall((0, 3 + d), (4, 3 + d), T), Wall((4 - d, 3), (4 - d, 4), T),
    )  # fmt: skip
    floor = Floor(0, 0.0, h, footprint_rectangle(-d, -d, 12 + d, 9.4 + d), rooms, walls)
    return House(seed, (floor,), (), ())


@cache
def furnished(seed: int) -> House:
    return furnish(bare_house(seed), seed)


def parted(one: F64, other: F64, slack_m: float) -> bool:
    """Whether two convex quads (4, 2) overlap by no more than a slack, by the separating axes."""
    for polygon in (one, other):
        sides = np.roll(polygon, -1, axis=0) - polygon
        for x, y in sides / np.linalg.norm(sides, axis=1, keepdims=True):
            a, b = one @ (y, -x), other @ (y, -x)
            if a.max() <= b.min() + slack_m or b.max() <= a.min() + slack_m:
                return True
    return False


def room_of(house: House, placed: PlacedItem) -> Room:
    return house.rooms[placed.room]


def may_overlap(one: PlacedItem, other: PlacedItem) -> bool:
    names = {one.item.name, other.item.name}
    drawn_up = [{"chair", "table"}, {"office chair", "desk"}]
    return "rug" in names or (one.location == other.location != NOWHERE and names in drawn_up)


@pytest.mark.parametrize("seed", SEEDS)
def test_ids_are_consecutive_and_what_carries_comes_first(seed: int) -> None:
    house = furnished(seed)
    assert [one.id for one in house.items] == list(range(len(house.items)))
    assert [one.id for one in house.locations] == list(range(len(house.locations)))
    assert all(one.support < one.id for one in house.items)
    assert {one.item.name for one in house.items} <= set(NAMES)


@pytest.mark.parametrize("seed", SEEDS)
def test_nothing_that_stands_on_the_floor_collides(seed: int) -> None:
    standing = [one for one in furnished(seed).items if one.support == ON_FLOOR or one.item.name == "radiator"]
    for k, one in enumerate(standing):
        for other in standing[:k]:
            if room_of(furnished(seed), one).floor != room_of(furnished(seed), other).floor:
                continue
            assert may_overlap(one, other) or parted(one.footprint, other.footprint, 0.005), (
                one.item.name,
                other.item.name,
            )


@pytest.mark.parametrize("seed", SEEDS)
def test_everything_is_inside_its_room(seed: int) -> None:
    house = furnished(seed)
    for one in house.items:
        floor = house.floors[room_of(house, one).floor]
        middle = one.footprint.mean(axis=0)
        shrunk = middle + (one.footprint - middle) * 0.995
        assert points_in_polygon(room_of(house, one).polygon, shrunk).all(), (one.item.name, one.room)
        low, high = one.box[:, 2] - floor.z_m
        assert low > -1e-6 and high < floor.height_m + 1e-6, one.item.name


@pytest.mark.parametrize("seed", SEEDS)
def test_small_things_lie_wholly_on_their_surface_and_apart(seed: int) -> None:
    house = furnished(seed)
    carried: dict[tuple[int, float], list[PlacedItem]] = {}
    for one in house.items:
        if one.support < 0:
            continue
        carrier = house.items[one.support]
        assert one.room == carrier.room and one.location == carrier.location
        c, s = np.cos(carrier.yaw), np.sin(carrier.yaw)
        local = (one.footprint - (carrier.x, carrier.y)) @ np.array([[c, -s], [s, c]])
        height = one.box[1, 2] - one.box[0, 2]
        assert any(
            abs(one.z - carrier.z - board.z) < 1e-6
            and local[:, 0].min() > board.x0 - 1e-6 and local[:, 0].max() < board.x1 + 1e-6
            and local[:, 1].min() > board.y0 - 1e-6 and local[:, 1].max() < board.y1 + 1e-6
            and height <= board.clearance_m
            for board in carrier.item.surfaces
        ), (one.item.name, carrier.item.name)  # fmt: skip
        for other in carried.setdefault((one.support, round(one.z, 6)), []):
            assert parted(one.footprint, other.footprint, 1e-6), (one.item.name, other.item.name)
        carried[one.support, round(one.z, 6)].append(one)


@pytest.mark.parametrize("seed", SEEDS)
def test_every_door_leads_to_every_other_and_to_nearly_all_that_is_free(seed: int) -> None:
    house = furnished(seed)
    origin, free = free_grid(house, 0)
    _, labels = cv2.connectedComponents(free.astype(np.uint8), connectivity=4)
    sizes = np.bincount(labels[free])
    assert sizes.max() > 0.9 * free.sum()
    for wall in house.floors[0].walls:
        for opening in wall.openings:
            if opening.kind in PASSAGE_KINDS:
                column, row = ((opening_rectangle(wall, opening).mean(axis=0) - origin) / 0.05).astype(int)
                if opening.rooms != (0,):  # the way out of the house ends at its outer edge
                    assert labels[row, column] == sizes.argmax()
    for room in house.rooms:
        rows, columns = np.nonzero(labels == sizes.argmax())
        middles = origin + (np.stack((columns, rows), axis=1) + 0.5) * 0.05
        assert points_in_polygon(room.polygon, middles).sum() * 0.05**2 > 0.6, room.type


@pytest.mark.parametrize("seed", SEEDS)
def test_doors_are_kept_free_and_only_low_things_stand_at_windows(seed: int) -> None:
    house = furnished(seed)
    standing = [one for one in house.items if one.support == ON_FLOOR and one.item.name != "rug"]
    for wall in house.floors[0].walls:
        for opening in wall.openings:
            depth = 0.88 if opening.kind in PASSAGE_KINDS else 0.4
            zone = opening_rectangle(wall, opening, depth)
            for one in standing:
                if opening.kind in PASSAGE_KINDS or (one.box[1, 2] > 1.0 and one.item.name != "sink"):
                    assert parted(zone, one.footprint, 0.01) or not room_faces(house, one, zone), one.item.name


def room_faces(house: House, one: PlacedItem, zone: F64) -> bool:
    """Whether a zone through a wall reaches into the item's own room: a deep zone may cross into a third one."""
    middles = (zone[[0, 3]] + zone[[1, 2]]) / 2
    return bool(points_in_polygon(room_of(house, one).polygon, middles).any())


@pytest.mark.parametrize("seed", SEEDS)
def test_locations_hold_their_members_within_their_outline(seed: int) -> None:
    house = furnished(seed)
    assert len(house.locations) >= 6
    for location in house.locations:
        members = [house.items[k] for k in location.members]
        assert len(members) >= 2 and all(one.location == location.id and one.room == location.room for one in members)
        corners = np.concatenate([one.footprint for one in members if one.support == ON_FLOOR])
        x, y = location.outline.T
        area = (x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2
        assert area == pytest.approx(ConvexHull(corners).volume), "convex hull, counterclockwise"
    grouped = {k for location in house.locations for k in location.members}
    assert grouped == {one.id for one in house.items if one.location != NOWHERE}


@pytest.mark.parametrize("seed", SEEDS)
def test_groups_keep_their_distance_and_members_stand_together(seed: int) -> None:
    house = furnished(seed)
    boxes = {
        location.id: np.stack(
            [house.items[k].box[:, :2] for k in location.members if house.items[k].support == ON_FLOOR]
        )
        for location in house.locations
    }

    def distance(a: F64, b: F64) -> float:
        gap = np.maximum(a[0] - b[1], b[0] - a[1])
        return float(np.linalg.norm(np.maximum(gap, 0)))

    for one in house.locations:
        for other in house.locations[: one.id]:
            if one.room == other.room:
                assert min(distance(a, b) for a in boxes[one.id] for b in boxes[other.id]) >= 0.449, (
                    one.kind,
                    other.kind,
                )
        rest = list(range(1, len(boxes[one.id])))
        reached = [0]
        while rest:
            near = [k for k in rest if min(distance(boxes[one.id][k], boxes[one.id][j]) for j in reached) <= 0.36]
            assert near, f"{one.kind} falls apart"
            reached += near
            rest = [k for k in rest if k not in near]


@pytest.mark.parametrize("seed", SEEDS)
def test_what_hangs_is_at_a_wall_or_the_ceiling_and_covers_nothing(seed: int) -> None:
    house = furnished(seed)
    hanging = [one for one in house.items if one.support == ON_WALL]
    for one in house.items:
        if one.support == ON_CEILING:
            assert one.box[1, 2] == pytest.approx(2.6, abs=1e-6)
    for one in hanging:
        place_at_wall = one.world_from_item[:2, 3] + one.world_from_item[:2, 1] * one.item.extent[1, 1]
        polygon = room_of(house, one).polygon
        ahead = np.roll(polygon, -1, axis=0) - polygon
        normal = np.stack((-ahead[:, 1], ahead[:, 0]), axis=1) / np.linalg.norm(ahead, axis=1, keepdims=True)
        assert np.abs(((place_at_wall - polygon) * normal).sum(axis=1)).min() < 0.02, one.item.name
        for other in house.items:
            if other.id != one.id and other.room == one.room and other.item.name not in ("window", "rug"):
                a, b = one.box, other.box
                assert not ((a[0] < b[1] - 1e-6) & (b[0] < a[1] - 1e-6)).all(), (one.item.name, other.item.name)


def test_a_floor_is_well_filled() -> None:
    counts = [len(furnished(seed).items) for seed in SEEDS]
    assert 60 <= np.median(counts) <= 120, counts


def test_equal_seeds_give_equal_bytes_and_others_differ() -> None:
    def content(house: House) -> bytes:
        places = np.array([(one.x, one.y, one.z, one.yaw, one.room, one.support, one.location) for one in house.items])
        return places.tobytes() + b"".join(part.vertices.tobytes() for one in house.items for part in one.item.parts)

    assert content(furnish(bare_house(3), 3)) == content(furnished(3)) != content(furnished(4))


def test_a_floor_that_is_not_there_is_refused() -> None:
    with pytest.raises(ConfigError, match="no floor 1"):
        free_grid(bare_house(0), 1)


def test_the_free_grid_keeps_a_robots_radius_from_walls_and_things_but_not_from_rugs() -> None:
    room = Room(0, 0, "hallway", footprint_rectangle(0, 0, 4, 4))
    walls = tuple(Wall(a, b, 0.1) for a, b in (((0, -0.05), (4, -0.05)), ((0, 4.05), (4, 4.05))))
    house = House(0, (Floor(0, 0.0, 2.5, footprint_rectangle(-0.1, -0.1, 4.1, 4.1), (room,), walls),), (), ())
    thing = Item("box", (box((-0.5, -0.5, 0.0), (0.5, 0.5, 0.5), Material((9, 9, 9))),))
    flat = Item("rug", (box((-0.5, -0.5, 0.0), (0.5, 0.5, 0.015), Material((9, 9, 9))),))
    high = Item("ceiling lamp", (box((-0.5, -0.5, 0.0), (0.5, 0.5, 0.3), Material((9, 9, 9))),))

    def around(item: Item | None, z: float = 0.0) -> tuple[float, bool]:
        items = () if item is None else (PlacedItem(0, item, 2.0, 2.0, z, 0.0, 0),)
        origin, free = free_grid(House(0, house.floors, (), (), items), 0)
        column, row = ((np.array([2.0, 2.0]) - origin) / 0.05).astype(int)
        return float(free.sum() * 0.05**2), bool(free[row, column])

    empty, _ = around(None)
    assert empty == pytest.approx(3.5**2, abs=0.8)
    assert around(flat) == (empty, True) == around(high, 2.0)
    area, middle = around(thing)
    assert not middle and area == pytest.approx(empty - (1.5**2 - (4 - np.pi) * 0.25**2), abs=0.5)


def test_what_is_too_large_or_too_high_for_a_surface_is_not_put_there() -> None:
    board = SupportSurface(-0.2, -0.2, 0.2, 0.2, 0.7, 0.3)
    cube = Item("box", (box((-0.1, -0.1, 0.0), (0.1, 0.1, 0.2), Material((9, 9, 9))),))
    assert nearest_fit(board, cube, 5.0, -5.0, 0.0) == pytest.approx((0.09, -0.09))
    assert nearest_fit(SupportSurface(-0.2, -0.2, 0.2, 0.2, 0.7, 0.1), cube, 0, 0, 0.0) is None
    assert nearest_fit(SupportSurface(-0.05, -0.2, 0.2, 0.2, 0.7, 1.0), cube, 0, 0, np.pi / 4) is None
    layout = GroupLayout("", np.random.default_rng(0))
    carrier = layout.place_free(Item("table", cube.parts, "", (board,)), 1.0, 2.0, np.pi / 2)
    assert layout.place_on(carrier, cube, -1.0, 0.0) and not layout.place_on(carrier, cube, -0.05, 0.05)
    assert (layout.pieces[1].x, layout.pieces[1].y, layout.pieces[1].z) == pytest.approx((1.0, 1.91, 0.7))
