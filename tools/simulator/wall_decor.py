"""Items on walls, ceilings and windows: pictures, clocks, mirrors, towels, lamps, curtains, radiators."""

from __future__ import annotations

import numpy as np

from placegraph.tools.simulator.catalogue import design
from placegraph.tools.simulator.furniture_placement import RoomPlanner
from placegraph.tools.simulator.house_model import NOWHERE, ON_CEILING, ON_WALL, House, Item, PlacedItem
from placegraph.tools.simulator.occupancy_grid import points_in_polygon
from placegraph.tools.simulator.room_sides import RoomSide, WallGap

OFF_WALL_M = 0.006  # keeps the wall's surface from showing through
CORNER_M = 0.1
MIDDLE_M = 1.5  # height of the middle of pictures: eye level
COLD_ROOMS = ("hallway", "corridor")

Random = np.random.Generator


def add_wall_decor(planner: RoomPlanner, house: House, random: Random, first_id: int) -> list[PlacedItem]:
    """Everything on the walls and the ceiling of one room, ids from `first_id`; also added to the planner."""
    start = len(planner.items)
    _windows(planner, random, first_id)
    for name, count in _wall_item_counts(planner.room.type, float(random.random()), random):
        for _ in range(count):
            item, z = _wall_item(name, random)
            placed = _random_wall_place(planner, item, z, random, first_id + len(planner.items) - start)
            if placed is not None:
                planner.add([placed])
    _lamps(planner, house, random, first_id + len(planner.items) - start)
    return planner.items[start:]


def _wall_item_counts(room_type: str, roll: float, random: Random) -> list[tuple[str, int]]:
    """The classes to hang in a room and how many of each."""
    if room_type in ("bathroom", "laundry"):
        return [("towel", int(roll < 0.5)), ("clock", int(roll > 0.9))]
    if room_type == "kitchen":
        return [("clock", int(roll < 0.6)), ("picture", int(roll < 0.35)), ("towel", int(roll > 0.5))]
    if room_type in COLD_ROOMS:
        return [("mirror", int(roll < 0.35)), ("picture", int(random.integers(0, 3))), ("clock", int(roll > 0.75))]
    return [("clock", int(roll < 0.3)), ("picture", int(random.integers(0, 3))), ("mirror", int(roll > 0.75))]


def _wall_item(name: str, random: Random) -> tuple[Item, float]:
    """An item for the wall and the height of its lowest point above the floor."""
    if name == "towel":
        return design(name, random, width_m=float(random.uniform(0.4, 0.55)), height_m=0.65, depth_m=0.08), 0.75
    if name == "mirror":
        item = design(name, random, width_m=float(random.uniform(0.4, 0.6)), height_m=float(random.uniform(0.8, 1.2)))
        return item, 0.7
    item = design(name, random)
    half = (item.extent[1, 2] - item.extent[0, 2]) / 2
    return item, (1.9 if name == "clock" else MIDDLE_M + float(random.uniform(-0.08, 0.08))) - float(half)


def _hang_at(
    planner: RoomPlanner, side: RoomSide, item: Item, along_m: float, z: float, number: int, support: int = ON_WALL
) -> PlacedItem:
    """An item with its back to a side of the room."""
    x, y = side.at(along_m, OFF_WALL_M + float(item.extent[1, 1])).tolist()
    return PlacedItem(number, item, x, y, planner.floor.z_m + z, side.yaw, planner.room.id, support, NOWHERE)


def _random_wall_place(planner: RoomPlanner, item: Item, z: float, random: Random, number: int) -> PlacedItem | None:
    """An item at a random free place of a wall, or None."""
    (x0, _, _), (x1, _, high) = item.extent.tolist()
    half = (x1 - x0) / 2
    for _ in range(25):
        side = planner.sides[int(random.choice(len(planner.sides), p=_side_probabilities(planner)))]
        low, top = half + CORNER_M, side.length_m - half - CORNER_M
        if top <= low or z + high > planner.floor.height_m - 0.05:
            continue
        t = float(random.uniform(low, top))
        placed = _hang_at(planner, side, item, t, z, number)
        walled = side.is_wall(t - half, t + half) and side.is_closed(t - half, t + half, z, z + high, CORNER_M)
        if walled and planner.is_unbuilt(side.strip(t - half, t + half, 0.16)) and planner.is_clear(placed, 0.06):
            return placed
    return None


def _side_probabilities(planner: RoomPlanner) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    lengths = np.array([side.length_m for side in planner.sides])
    return np.asarray(lengths / lengths.sum())


def _windows(planner: RoomPlanner, random: Random, first_id: int) -> None:
    """Radiators below and curtains in front of windows, where furniture leaves space."""
    start = len(planner.items)
    for side in planner.sides:
        for gap in side.gaps:
            if gap.kind != "window" or gap.start_m < 0 or gap.end_m > side.length_m:
                continue
            for placed in (_radiator(planner, side, gap, random), _curtain(planner, side, gap, random)):
                if placed is None or not planner.is_clear(placed, 0.01) or planner.is_kept_free(placed):
                    continue
                if planner.stays_walkable([placed]):
                    planner.add([_with_id(placed, first_id + len(planner.items) - start)])


def _with_id(placed: PlacedItem, number: int) -> PlacedItem:
    return PlacedItem(number, placed.item, placed.x, placed.y, placed.z, placed.yaw, placed.room, placed.support)


def _radiator(planner: RoomPlanner, side: RoomSide, gap: WallGap, random: Random) -> PlacedItem | None:
    if random.random() > 0.65:
        return None
    width = min(float(random.uniform(0.6, 1.2)), gap.end_m - gap.start_m)
    item = design("radiator", random, width_m=width, height_m=max(min(0.6, gap.low_m - 0.08), 0.35))
    return _hang_at(planner, side, item, (gap.start_m + gap.end_m) / 2, 0.0, 0)


def _curtain(planner: RoomPlanner, side: RoomSide, gap: WallGap, random: Random) -> PlacedItem | None:
    if random.random() > 0.7 or planner.room.type in ("bathroom", "laundry"):
        return None
    top = min(gap.high_m + 0.12, planner.floor.height_m - 0.06)
    middle = (gap.start_m + gap.end_m) / 2
    half = min((gap.end_m - gap.start_m) / 2 + 0.22, middle - 0.02, side.length_m - middle - 0.02)
    for low in (0.03, max(gap.low_m - 0.1, 0.03)):  # to the floor, or shorter above furniture
        item = design("curtain", random, width_m=2 * half, height_m=top - low, depth_m=0.1)
        placed = _hang_at(planner, side, item, middle, low, 0)
        if planner.is_clear(placed, 0.01):
            return placed
    return None


def _lamps(planner: RoomPlanner, house: House, random: Random, first_id: int) -> None:
    """A ceiling lamp at each light of the room, or in its middle."""
    floor, number = planner.floor, first_id
    polygon, ceiling_m = planner.room.polygon, floor.z_m + floor.height_m
    spots = [
        (x, y) for x, y, z in house.lights if floor.z_m < z < ceiling_m and points_in_polygon(polygon, np.array((x, y)))
    ] or [planner.middle.tolist()]
    item = design("ceiling lamp", random, height_m=float(random.uniform(0.2, 0.5)))
    for x, y in spots:
        z = ceiling_m - float(item.extent[1, 2])
        placed = PlacedItem(number, item, x, y, z, 0.0, planner.room.id, ON_CEILING)
        if planner.is_clear(placed, 0.02):
            planner.add([placed])
            number += 1
