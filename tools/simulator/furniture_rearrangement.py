"""The same house some time later: some pieces of furniture, with what is on them, stand elsewhere in their rooms."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import cv2
import numpy as np

from placegraph.runtime.arrays import F64
from placegraph.runtime.errors import ConfigError, SourceError
from placegraph.tools.simulator.camera_trajectory import floor_free_space, landing_cell
from placegraph.tools.simulator.house_model import NOWHERE, ON_FLOOR, FurnitureLocation, House, PlacedItem
from placegraph.tools.simulator.occupancy_grid import expand_rectangle, points_in_polygon
from placegraph.tools.simulator.room_furnishing import floor_outline

SALT = 6_301  # a random stream of its own
TRIALS = 200  # places that are tried for one piece
MIN_MOVE_M = 1.0  # more than the width of most pieces, so that the old place is empty
GAP_M = 0.05  # to what stands beside it
MAX_AREA_M2 = 1.0  # largest footprint, what two persons could move
FIXED_CLASSES = frozenset({
    "door", "window", "stairs", "radiator", "kitchen counter", "stove", "refrigerator", "sink", "toilet", "bathtub",
    "shower", "washing machine", "rug", "fireplace", "dishwasher",
})  # fmt: skip


def rearrange(house: House, count: int, seed: int) -> House:
    """The house after `count` pieces on the floor were moved by 1 m or more within their rooms.

    Ids stay; a moved piece leaves its location. Every room can still be reached. Raises ConfigError when fewer pieces
    can be moved.
    """
    random = np.random.default_rng([seed, SALT])
    order = random.permutation([item.id for item in house.items if _is_movable(item)]).tolist()
    moved: set[int] = set()
    for number in order:
        if len(moved) == count:
            return house
        if (after := _with_piece_moved(house, house.items[number], random)) is not None:
            house = after
            moved.add(number)
    if len(moved) < count:
        raise ConfigError(f"house {house.seed}: only {len(moved)} pieces of furniture can be moved, not {count}")
    return house


def moved_item_ids(before: House, after: House) -> tuple[int, ...]:
    """Ids of the items whose pose changed, including those carried along."""
    pairs = zip(before.items, after.items, strict=True)
    return tuple(a.id for a, b in pairs if (a.x, a.y, a.z, a.yaw) != (b.x, b.y, b.z, b.yaw))


def _is_movable(placed: PlacedItem) -> bool:
    area = float(np.prod(np.diff(placed.item.extent, axis=0)[0, :2]))
    return placed.support == ON_FLOOR and placed.item.name not in FIXED_CLASSES and area <= MAX_AREA_M2


def _with_piece_moved(house: House, piece: PlacedItem, random: np.random.Generator) -> House | None:
    """The house with the piece at a free place of its room; None when there is none."""
    room = next(room for room in house.rooms if room.id == piece.room)
    carried = set(_carried_ids(house.items, piece.id))
    if any(place.id == piece.location and len(set(place.members) - carried) < 2 for place in house.locations):
        return None
    standing = [item for item in house.items if item.id not in carried and item.support == ON_FLOOR]
    low, high = room.polygon.min(axis=0), room.polygon.max(axis=0)
    for _ in range(TRIALS):
        x, y = random.uniform(low, high).tolist()
        yaw = piece.yaw + float(random.choice([0.0, 0.5, 1.0, 1.5])) * np.pi
        moved_piece = replace(piece, x=x, y=y, yaw=yaw, location=NOWHERE)
        if np.hypot(x - piece.x, y - piece.y) < MIN_MOVE_M or not _fits(moved_piece, room.polygon, standing):
            continue
        after = _with_items(
            house, {item_id: _moved_along(house.items[item_id], piece, moved_piece) for item_id in carried}
        )
        try:
            check_reachable(after, room.floor)
        except SourceError:
            continue
        return after
    return None


def _fits(piece: PlacedItem, polygon: F64, standing: Sequence[PlacedItem]) -> bool:
    wide = expand_rectangle(piece.footprint, GAP_M)
    if not bool(np.all(points_in_polygon(polygon, wide))):
        return False
    box = piece.box
    for neighbor in standing:
        apart = neighbor.box[0, 2] >= box[1, 2] or box[0, 2] >= neighbor.box[1, 2]
        if (
            not apart
            and cv2.intersectConvexConvex(wide.astype(np.float32), neighbor.footprint.astype(np.float32))[0] > 0
        ):
            return False
    return True


def _carried_ids(items: Sequence[PlacedItem], number: int) -> Iterator[int]:
    """The piece and everything on it, directly or indirectly."""
    yield number
    for item in items:
        if item.support == number:
            yield from _carried_ids(items, item.id)


def _moved_along(carried: PlacedItem, before: PlacedItem, after: PlacedItem) -> PlacedItem:
    """An item that moves with a piece."""
    pose = after.world_from_item @ np.linalg.inv(before.world_from_item) @ carried.world_from_item
    x, y, z = pose[:3, 3].tolist()
    return replace(carried, x=x, y=y, z=z, yaw=carried.yaw + after.yaw - before.yaw, location=NOWHERE)


def _with_items(house: House, moved: dict[int, PlacedItem]) -> House:
    items = tuple(moved.get(item.id, item) for item in house.items)
    return replace(house, items=items, locations=tuple(_without_moved(place, items) for place in house.locations))


def _without_moved(place: FurnitureLocation, items: Sequence[PlacedItem]) -> FurnitureLocation:
    """A location without the members that were moved away."""
    members = tuple(item_id for item_id in place.members if items[item_id].location == place.id)
    standing = [items[item_id] for item_id in members if items[item_id].support == ON_FLOOR]
    if members == place.members or not standing:
        return place
    return replace(place, members=members, outline=floor_outline(standing))


def check_reachable(house: House, floor_index: int) -> None:
    """Raise SourceError unless every room and the stairs of a floor can be reached on foot."""
    free_space = floor_free_space(house, house.floors[floor_index])
    for flight in house.stairs:
        if floor_index in (flight.floor, flight.floor + 1):
            landing_cell(house, flight, free_space, up=floor_index > flight.floor)
