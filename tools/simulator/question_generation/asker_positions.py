"""Free positions from which a person may ask, and the relations left, right, front and behind seen from there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from placegraph.runtime.arrays import F64
from placegraph.tools.simulator.house_model import ON_CEILING, House, Room, Wall, WallOpening
from placegraph.tools.simulator.occupancy_grid import PASSAGE_KINDS, free_grid, points_in_polygon
from placegraph.tools.simulator.question_generation.box_relations import TernaryArray, ternary
from placegraph.tools.simulator.question_generation.item_table import ItemTable

EYE_M = 1.5  # above the floor
POSITIONS_PER_ROOM = 3  # random positions per room
MIN_VIEW_M, MAX_VIEW_M = 0.8, 6.0  # distance range from the eyes to the anchor
CLEAR_M, NOT_BEYOND_M = 0.35, 0.15  # YES above the first, NO below minus the second
MAX_CROSS_RATIO = 0.8  # largest ratio of the other axis to the main one


@dataclass(frozen=True, eq=False)
class AskerPosition:
    """Eye position (3,) in a room; `door` is the word for the room's only entrance when it is there, else empty."""

    eye: F64
    door: str = ""


def asker_positions(house: House, random: np.random.Generator) -> dict[int, tuple[AskerPosition, ...]]:
    """Eye positions by room id: the entrance first where there is only one, then some at random."""
    positions: dict[int, tuple[AskerPosition, ...]] = {}
    for floor in house.floors:
        origin, free = free_grid(house, floor.index)
        rows, columns = np.nonzero(free)
        places = origin + np.stack((columns + 0.5, rows + 0.5), axis=-1) * 0.05
        for room in floor.rooms:
            room_places = places[points_in_polygon(room.polygon, places)]
            if not len(room_places):
                continue
            eyes = [
                _entrance(house, room, room_places),
                *[
                    AskerPosition(position)
                    for position in room_places[random.integers(len(room_places), size=POSITIONS_PER_ROOM)]
                ],
            ]
            positions[room.id] = tuple(
                AskerPosition(np.append(position.eye, floor.z_m + EYE_M).round(3), position.door)
                for position in eyes
                if position is not None
            )
    return positions


def _entrance(house: House, room: Room, places: F64) -> AskerPosition | None:
    """The free place (2,) at a room's only door or archway; None when there are several, or it is blocked."""
    floor = house.floors[room.floor]
    ways: list[tuple[Wall, WallOpening]] = [
        (wall, opening)
        for wall in floor.walls
        for opening in wall.openings
        if opening.kind in PASSAGE_KINDS and room.id in opening.rooms
    ]
    if len(ways) != 1:
        return None
    wall, opening = ways[0]
    distance = np.linalg.norm(places - wall.middle_of(opening), axis=1)
    nearest = int(np.argmin(distance))
    word = "door" if opening.kind == "door" else "doorway"
    return AskerPosition(places[nearest], word) if distance[nearest] < 0.9 else None


def in_sight(room: Room, eye: F64, point: F64) -> bool:
    """Whether the segment between two points (2+,) stays in the room's polygon, up to its last 0.2 m."""
    length = float(np.linalg.norm(point[:2] - eye[:2]))
    shares = np.linspace(0, max(1 - 0.2 / max(length, 0.2), 0.0), 25)[:, None]
    return bool(points_in_polygon(room.polygon, eye[:2] * (1 - shares) + point[:2] * shares).all())


def view_relations(table: ItemTable, eye: F64, anchor: int) -> dict[str, TernaryArray]:
    """(N,) left, right, front and behind of an anchor in the same room, for a viewer who looks at it."""
    forward = table.center[anchor, :2] - eye[:2]
    forward = forward / np.linalg.norm(forward)
    leftward = np.array([-forward[1], forward[0]])  # z x f
    offset = table.center[:, :2] - table.center[anchor, :2]
    left, ahead = offset @ leftward, offset @ forward
    comparable = table.same_room[:, anchor].copy()
    comparable[anchor] = False
    # not used for ceiling lamps, or for a clock far above a bench
    level = (table.axis_gap[:, anchor, 2] < 0.3) & (table.support != ON_CEILING)
    answers = {}
    for view, main, cross in (
        ("left", left, ahead), ("right", -left, ahead), ("front", -ahead, left), ("behind", ahead, left)
    ):  # fmt: skip
        clear = (
            level & (main >= CLEAR_M) & (np.abs(cross) <= MAX_CROSS_RATIO * main) & (table.plan_gap[:, anchor] <= 2.0)
        )
        answers[view] = ternary(clear, comparable & (main > -NOT_BEYOND_M))
    return answers


def order_from_left(table: ItemTable, eye: F64, ids: list[int]) -> list[int] | None:
    """The items from left to right for a viewer who looks at their middle; None where it is ambiguous."""
    offsets = table.center[ids, :2] - eye[:2]
    away = np.linalg.norm(offsets, axis=1)
    if (away < MIN_VIEW_M).any() or (away > 8.0).any():
        return None
    forward = offsets.mean(axis=0)
    forward = forward / max(float(np.linalg.norm(forward)), 1e-9)
    right = np.array([forward[1], -forward[0]])
    side, ahead = offsets @ right, offsets @ forward
    bearing = np.degrees(np.arctan2(side, ahead))
    order = np.argsort(bearing, kind="stable")
    apart = (np.diff(bearing[order]) >= 7.0).all() and (np.diff(side[order]) >= 0.25).all()
    return [ids[k] for k in order] if apart and (np.abs(bearing) <= 55).all() else None
