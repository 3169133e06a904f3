"""How the rooms of a house are joined: doors, archways and stairs, and how far a robot travels between them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from placegraph.nodes.hierarchy.path_planning import path_length_m, shortest_paths
from placegraph.nodes.hierarchy.plan_grid import PlanGrid
from placegraph.runtime.arrays import F64
from placegraph.tools.simulator.model import Floor, House, Stairs
from placegraph.tools.simulator.space import PASSAGES, free_grid, inside

CELL_M = 0.05
STEP_OFF_M = 0.3  # from the first or last edge of a flight to where one stands before it
NEAR_M = 1.0  # from there to a free cell, at most


@dataclass(frozen=True, eq=False)
class Passage:
    """A door, archway or stairs; ends (2, 3) lie in rooms[0] and rooms[1], of stairs foot and head, in metres."""

    id: int  # counted from 0 in the house
    kind: str
    rooms: tuple[int, int]  # Room.ids
    ends: F64
    width_m: float
    travel_m: tuple[tuple[int, float], ...]  # (id, metres) to passages of a higher id on the same floor


def passages(house: House) -> tuple[Passage, ...]:
    """The passages of a house, floor by floor, stairs last; travel is that of a robot of .25 m radius, in metres."""
    found = [one for floor in house.floors for one in _openings(floor)]
    found += [_flight(house, stairs) for stairs in house.stairs]
    travel: dict[int, list[tuple[int, float]]] = {i: [] for i in range(len(found))}
    floor_of = {room.id: room.floor for room in house.rooms}
    for floor in house.floors:
        here = [(i, end) for i, one in enumerate(found) for room, end in zip(one[1], one[2], strict=True)
                if floor_of[room] == floor.index]  # fmt: skip
        here = list(dict(here).items())  # an opening has two equal ends on its floor
        for (i, j), length in _lengths(house, floor, here).items():
            travel[i].append((j, length))
    return tuple(
        Passage(i, kind, rooms, ends, width, tuple(sorted(travel[i])))
        for i, (kind, rooms, ends, width) in enumerate(found)
    )


_Found = tuple[str, tuple[int, int], F64, float]


def _openings(floor: Floor) -> list[_Found]:
    found: list[_Found] = []
    for wall in floor.walls:
        a, b = np.array(wall.a), np.array(wall.b)
        for one in wall.openings:
            if one.kind in PASSAGES and len(one.rooms) == 2:
                middle = a + (b - a) / np.linalg.norm(b - a) * (one.start_m + one.end_m) / 2
                ends = np.stack([np.array([*middle, floor.z_m])] * 2)
                found.append((one.kind, (one.rooms[0], one.rooms[1]), ends, one.end_m - one.start_m))
    return found


def _flight(house: House, stairs: Stairs) -> _Found:
    along = stairs.head[:2] - stairs.foot[:2]
    along = along / np.linalg.norm(along) * STEP_OFF_M
    ends = np.stack((stairs.foot, stairs.head))
    stood = (stairs.foot[:2] - along, stairs.head[:2] + along)
    rooms = []
    for floor, xy in zip((stairs.floor, stairs.floor + 1), stood, strict=True):
        rooms.append(next(room.id for room in house.floors[floor].rooms if inside(room.polygon, xy)))
    return "stairs", (rooms[0], rooms[1]), ends, stairs.width_m


def _lengths(house: House, floor: Floor, here: list[tuple[int, F64]]) -> dict[tuple[int, int], float]:
    """Metres between places on a floor, each named by the id of its passage; without those that no way joins."""
    origin, free = free_grid(house, floor.index, CELL_M)
    rows, columns = np.nonzero(free)
    cells, ids = [], []
    for i, end in here:
        apart = np.hypot(*(origin + (np.stack((columns, rows), axis=1) + 0.5) * CELL_M - end[:2]).T)
        if len(apart) and apart.min() <= NEAR_M:
            nearest = int(np.argmin(apart))
            cells.append((int(rows[nearest]), int(columns[nearest])))
            ids.append(i)
    paths = shortest_paths(cells, free, PlanGrid(origin, CELL_M, (free.shape[0], free.shape[1])))
    return {
        (ids[i], ids[j]): path_length_m(paths.path(i, cells[j]))
        for i in range(len(ids))
        for j in range(i + 1, len(ids))
        if np.isfinite(paths.distance_m[i][cells[j]])
    }
