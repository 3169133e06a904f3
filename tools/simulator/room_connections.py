"""Connections of rooms: doors, archways and stairs, and the travel distances between them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from placegraph.nodes.hierarchy.path_planning import path_length_m, shortest_paths
from placegraph.nodes.hierarchy.plan_grid import PlanGrid
from placegraph.runtime.arrays import F64
from placegraph.tools.simulator.house_model import Floor, House, Staircase
from placegraph.tools.simulator.occupancy_grid import PASSAGE_KINDS, free_grid, points_in_polygon

CELL_M = 0.05
STEP_OFF_M = 0.3  # from the first or last edge of a flight to where one stands before it
NEAR_M = 1.0  # from there to a free cell, at most


@dataclass(frozen=True, eq=False)
class RoomConnection:
    """A door, archway or stairs; ends (2, 3) are in rooms[0] and rooms[1], foot and head for stairs, in metres."""

    id: int  # counted from 0 in the house
    kind: str
    rooms: tuple[int, int]  # Room.ids
    ends: F64
    width_m: float
    travel_m: tuple[tuple[int, float], ...]  # (id, metres) to passages of a higher id on the same floor


def room_connections(house: House) -> tuple[RoomConnection, ...]:
    """The connections of a house, floor by floor, stairs last; travel is for a robot of .25 m radius."""
    passages = [passage for floor in house.floors for passage in _openings(floor)]
    passages += [_stair_connection(house, stairs) for stairs in house.stairs]
    travel: dict[int, list[tuple[int, float]]] = {i: [] for i in range(len(passages))}
    floor_of = {room.id: room.floor for room in house.rooms}
    for floor in house.floors:
        ends = {  # by passage; an opening has two equal ends on its floor
            i: end
            for i, (_, rooms, passage_ends, _) in enumerate(passages)
            for room, end in zip(rooms, passage_ends, strict=True)
            if floor_of[room] == floor.index
        }
        for (i, j), length in _travel_lengths(house, floor, list(ends.items())).items():
            travel[i].append((j, length))
    return tuple(
        RoomConnection(i, kind, rooms, ends, width, tuple(sorted(travel[i])))
        for i, (kind, rooms, ends, width) in enumerate(passages)
    )


_Passage = tuple[str, tuple[int, int], F64, float]


def _openings(floor: Floor) -> list[_Passage]:
    passages: list[_Passage] = []
    for wall in floor.walls:
        for opening in wall.openings:
            if opening.kind in PASSAGE_KINDS and len(opening.rooms) == 2:
                middle = wall.middle_of(opening)
                ends = np.stack([np.array([*middle, floor.z_m])] * 2)
                passages.append(
                    (opening.kind, (opening.rooms[0], opening.rooms[1]), ends, opening.end_m - opening.start_m)
                )
    return passages


def _stair_connection(house: House, stairs: Staircase) -> _Passage:
    along = stairs.head[:2] - stairs.foot[:2]
    along = along / np.linalg.norm(along) * STEP_OFF_M
    ends = np.stack((stairs.foot, stairs.head))
    stood = (stairs.foot[:2] - along, stairs.head[:2] + along)
    rooms = []
    for floor, xy in zip((stairs.floor, stairs.floor + 1), stood, strict=True):
        rooms.append(next(room.id for room in house.floors[floor].rooms if points_in_polygon(room.polygon, xy)))
    return "stairs", (rooms[0], rooms[1]), ends, stairs.width_m


def _travel_lengths(house: House, floor: Floor, places: list[tuple[int, F64]]) -> dict[tuple[int, int], float]:
    """Metres between places on a floor, keyed by connection ids; pairs without a route are left out."""
    origin, free = free_grid(house, floor.index, CELL_M)
    rows, columns = np.nonzero(free)
    cells, ids = [], []
    for i, end in places:
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
