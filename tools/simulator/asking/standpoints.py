"""Where a person may stand in a room and ask: free places, and what is left, right, in front and behind from there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from placegraph.runtime.arrays import F64
from placegraph.tools.simulator.asking.relations import Answers, graded
from placegraph.tools.simulator.asking.scene import Scene
from placegraph.tools.simulator.model import ON_CEILING, House, Opening, Room, Wall
from placegraph.tools.simulator.space import PASSAGES, free_grid, inside

EYE_M = 1.5  # above the floor
PLACES = 3  # tried in a room
AWAY_M, REACH_M = 0.8, 6.0  # from a standpoint to what is looked at
CLEAR_M, BLUR_M = 0.35, 0.15  # YES from the one on, NO beyond the other on the far side
CONE = 0.8  # largest share of sideways in forward, or forward in sideways
VIEWS = ("left", "right", "front", "behind")


@dataclass(frozen=True, eq=False)
class Standpoint:
    """A place (3,) of eyes in a room; `door` is the word for the room's only way in where it is there, else empty."""

    eye: F64
    door: str = ""


def standpoints(house: House, random: np.random.Generator) -> dict[int, tuple[Standpoint, ...]]:
    """Free places to ask from, by room id: the way in first where there is only one, then some others at random."""
    found: dict[int, tuple[Standpoint, ...]] = {}
    for floor in house.floors:
        origin, free = free_grid(house, floor.index)
        rows, columns = np.nonzero(free)
        places = origin + np.stack((columns + 0.5, rows + 0.5), axis=-1) * 0.05
        for room in floor.rooms:
            own = places[inside(room.polygon, places)]
            if not len(own):
                continue
            eyes = [
                _entrance(house, room, own),
                *[Standpoint(one) for one in own[random.integers(len(own), size=PLACES)]],
            ]
            found[room.id] = tuple(
                Standpoint(np.append(one.eye, floor.z_m + EYE_M).round(3), one.door) for one in eyes if one is not None
            )
    return found


def _entrance(house: House, room: Room, places: F64) -> Standpoint | None:
    """The free place (2,) of a room's only door or archway; None where there are several ways in, or it is blocked."""
    floor = house.floors[room.floor]
    ways: list[tuple[Wall, Opening]] = [
        (wall, one) for wall in floor.walls for one in wall.openings if one.kind in PASSAGES and room.id in one.rooms
    ]
    if len(ways) != 1:
        return None
    wall, opening = ways[0]
    a, b = np.array(wall.a), np.array(wall.b)
    middle = a + (b - a) / np.linalg.norm(b - a) * (opening.start_m + opening.end_m) / 2
    distance = np.linalg.norm(places - middle, axis=1)
    nearest = int(np.argmin(distance))
    word = "door" if opening.kind == "door" else "doorway"
    return Standpoint(places[nearest], word) if distance[nearest] < 0.9 else None


def in_sight(room: Room, eye: F64, point: F64) -> bool:
    """Whether the straight way between two points (2+,) stays in the room's polygon, up to its last 0.2 m."""
    length = float(np.linalg.norm(point[:2] - eye[:2]))
    shares = np.linspace(0, max(1 - 0.2 / max(length, 0.2), 0.0), 25)[:, None]
    return bool(inside(room.polygon, eye[:2] * (1 - shares) + point[:2] * shares).all())


def viewed(scene: Scene, eye: F64, anchor: int) -> dict[str, Answers]:
    """(N,) answers of left, right, front and behind for one who looks at an anchor of the same room (METHOD.md 9)."""
    forward = scene.center[anchor, :2] - eye[:2]
    forward = forward / np.linalg.norm(forward)
    leftward = np.array([-forward[1], forward[0]])  # z x f
    offset = scene.center[:, :2] - scene.center[anchor, :2]
    left, ahead = offset @ leftward, offset @ forward
    here = scene.same_room[:, anchor].copy()
    here[anchor] = False
    # nobody says so of a lamp on the ceiling, or of a clock far above a bench
    level = (scene.axis_gap[:, anchor, 2] < 0.3) & (scene.support != ON_CEILING)
    answers = {}
    for view, main, cross in (
        ("left", left, ahead), ("right", -left, ahead), ("front", -ahead, left), ("behind", ahead, left)
    ):  # fmt: skip
        clear = level & (main >= CLEAR_M) & (np.abs(cross) <= CONE * main) & (scene.flat_gap[:, anchor] <= 2.0)
        answers[view] = graded(clear, here & (main > -BLUR_M))
    return answers


def row_from_left(scene: Scene, eye: F64, ids: list[int]) -> list[int] | None:
    """The items from left to right as seen from a place that looks at their middle; None where that may be disputed."""
    offsets = scene.center[ids, :2] - eye[:2]
    away = np.linalg.norm(offsets, axis=1)
    if (away < AWAY_M).any() or (away > 8.0).any():
        return None
    forward = offsets.mean(axis=0)
    forward = forward / max(float(np.linalg.norm(forward)), 1e-9)
    right = np.array([forward[1], -forward[0]])
    side, ahead = offsets @ right, offsets @ forward
    bearing = np.degrees(np.arctan2(side, ahead))
    order = np.argsort(bearing, kind="stable")
    apart = (np.diff(bearing[order]) >= 7.0).all() and (np.diff(side[order]) >= 0.25).all()
    return [ids[k] for k in order] if apart and (np.abs(bearing) <= 55).all() else None
