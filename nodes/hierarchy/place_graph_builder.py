"""The place graph of a map: its rooms' connections, the ways between them, where to stand before each object.

Rooms that did not change keep what was found for them in the step before.
Source: issue 4, place graph. The paper has none.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from placegraph.nodes.hierarchy.approach_poses import Stand, Target, find_stand
from placegraph.nodes.hierarchy.floors import FloorConfig, FloorSpan
from placegraph.nodes.hierarchy.openings import Opening, find_openings, owners
from placegraph.nodes.hierarchy.path_planning import Reach, length_of, reach_from
from placegraph.nodes.hierarchy.persistent_ids import Identities, Place
from placegraph.nodes.hierarchy.rooms import Grid, RoomConfig
from placegraph.nodes.hierarchy.stairs import Stairs, find_stairs, floors_stood_on, steps_on
from placegraph.nodes.hierarchy.traversability import Ground, TravelConfig, deep_points, find_ground
from placegraph.runtime.arrays import F64, I32, I64, U8, Bool, Points
from placegraph.runtime.messages import Map
from placegraph.runtime.scene_graph.place_graph import Approach, Connection, RouteSegment

PLACE_M = 0.5  # a connection is known again by a square of twice that around it
STAIRS_ROOM_M = 1.0  # stairs end in the room that is so near, at most


@dataclass(frozen=True, eq=False)
class FloorPlan:
    """One floor as the room layer has it: its points and free cells (N, 3), and each room's id and mask."""

    id: str
    span: FloorSpan
    grid: Grid
    points_world: Points
    free_points_world: Points
    rooms: tuple[tuple[str, Bool], ...]


@dataclass(frozen=True, eq=False)
class PlacedObject:
    """An object: its id, room, and what it looks like from above."""

    id: str
    room: str
    target: Target


@dataclass(frozen=True, eq=False)
class PlaceGraph:
    """Connections and ways of a map, and the approaches of its objects by id."""

    connections: list[Connection]
    ways: list[RouteSegment]
    approaches: dict[str, Approach]


@dataclass(frozen=True, eq=False)
class _Floor:
    plan: FloorPlan
    ground: Ground
    owner: I32
    openings: list[Opening]
    made_of: tuple[NDArray[Any], ...]  # equal inputs: nothing to compute again

    def at(self, cell: tuple[int, int]) -> F64:
        middle = self.plan.grid.origin + (np.array(cell[::-1]) + 0.5) * self.plan.grid.cell_m
        return np.array([*middle, self.plan.span.low])


@dataclass(eq=False)
class _Portal:
    """A connection before it has an id: for each of its rooms the cell where it begins."""

    kind: str
    rooms: tuple[str, str]
    cells: tuple[tuple[int, int], tuple[int, int]]
    ends: F64
    width_m: float
    length_m: float
    group: str
    meeting: Bool | None = None  # of an opening: cells that belong to both rooms' ways
    id: str = ""


@dataclass(frozen=True, eq=False)
class _Room:
    """What was found for one room, and from what."""

    ids: tuple[str, ...]  # of its connections
    free: Bool
    tops: U8
    reach: Reach
    middle: tuple[int, int] | None
    reached: Bool
    ways: dict[tuple[str, str], RouteSegment] = field(default_factory=dict)
    stands: dict[str, tuple[Target, Stand | None]] = field(default_factory=dict)


class PlaceGraphBuilder:
    """Makes the place graph of each Map and remembers the ids of connections."""

    def __init__(self, config: TravelConfig, floors: FloorConfig, rooms: RoomConfig) -> None:
        self._config, self._floor_config, self._door_m = config, floors, rooms.door_m
        self._identities = Identities("C")
        self._floors: dict[str, _Floor] = {}
        self._rooms: dict[str, _Room] = {}

    def build(self, world: Map, plans: Sequence[FloorPlan], objects: Sequence[PlacedObject]) -> PlaceGraph:
        """Connections, ways and approaches of a map. Deterministic in the sequence of maps."""
        spans = [plan.span for plan in plans]
        standing = floors_stood_on(world.camera_positions_world, spans, self._floor_config, self._config)
        floors = [self._floor(world, plan, number, standing) for number, plan in enumerate(plans)]
        self._floors = {floor.plan.id: floor for floor in floors}
        portals = [portal for floor in floors for portal in self._openings(floor)]
        stairs = find_stairs(world.camera_positions_world, standing, spans, world.points_world, self._config)
        portals += [portal for one in stairs if (portal := self._stairs(one, floors)) is not None]
        places = [Place(_square(portal.ends.mean(axis=0)), portal.group) for portal in portals]
        for portal, connection_id in zip(portals, self._identities.assign(places), strict=True):
            portal.id = connection_id
        portals.sort(key=lambda portal: int(portal.id[1:]))
        ways: list[RouteSegment] = []
        approaches: dict[str, Approach] = {}
        known, self._rooms = self._rooms, {}
        for floor in floors:
            for number, (room_id, _) in enumerate(floor.plan.rooms):
                mine = [portal for portal in portals if room_id in portal.rooms]
                room = self._rooms[room_id] = self._room(floor, number, room_id, mine, known.get(room_id))
                ends = [portal.id for portal in mine] + [room_id] * (room.middle is not None)
                ways += _ways(room_id, ends, room)
                held = [thing for thing in objects if thing.room == room_id]
                approaches |= self._approaches(floor, room, ends, held)
        return PlaceGraph([_connection(portal) for portal in portals], ways, approaches)

    def _floor(self, world: Map, plan: FloorPlan, number: int, standing: I64) -> _Floor:
        steps = steps_on(number, world.camera_positions_world, standing, self._config)
        deep = deep_points(world.points_world, plan.span, self._config)
        masks = [mask for _, mask in plan.rooms]
        made_of: tuple[Points | Bool, ...] = (
            plan.points_world,
            deep,
            plan.free_points_world,
            steps,
            plan.grid.origin,
            *masks,
        )
        known = self._floors.get(plan.id)
        if known is not None and known.plan.span == plan.span and _equal(known.made_of, made_of):
            return _Floor(plan, known.ground, known.owner, known.openings, made_of)
        ground = find_ground(
            plan.points_world,
            deep,
            plan.free_points_world,
            world.free_cell_m,
            steps,
            plan.grid,
            plan.span,
            self._config,
        )
        owner = owners(masks, ground, self._config)
        return _Floor(plan, ground, owner, find_openings(owner, ground, self._config), made_of)

    def _openings(self, floor: _Floor) -> list[_Portal]:
        def portal(opening: Opening) -> _Portal:
            one, other = (floor.plan.rooms[number][0] for number in opening.rooms)
            kind = "door" if opening.width_m < self._door_m else "opening"
            ends = np.stack([floor.at(opening.cell)] * 2)
            cells = (opening.cell, opening.cell)
            return _Portal(kind, (one, other), cells, ends, opening.width_m, 0.0, floor.plan.id, opening.meeting)

        return [portal(opening) for opening in floor.openings]

    def _stairs(self, stairs: Stairs, floors: Sequence[_Floor]) -> _Portal | None:
        """Stairs between the rooms in which they end; None where an end lies in no room."""
        rooms, cells, ends = [], [], []
        for number, end in zip(stairs.floors, stairs.ends, strict=True):
            floor = floors[number]
            rows, columns = np.nonzero(floor.ground.standing & (floor.owner >= 0))
            apart = np.hypot(
                *(floor.plan.grid.origin + (np.stack((columns, rows), 1) + 0.5) * floor.plan.grid.cell_m - end[:2]).T
            )
            if not len(apart) or apart.min() > STAIRS_ROOM_M:
                return None
            nearest = int(np.argmin(apart))
            cells.append((int(rows[nearest]), int(columns[nearest])))
            rooms.append(floor.plan.rooms[int(floor.owner[cells[-1]])][0])
            ends.append(floor.at(cells[-1]))
        length = max(stairs.length_m, float(np.linalg.norm(ends[1] - ends[0])))
        group = " ".join(floors[number].plan.id for number in stairs.floors)
        return _Portal(
            "stairs", (rooms[0], rooms[1]), (cells[0], cells[1]), np.stack(ends), stairs.width_m, length, group
        )

    def _room(self, floor: _Floor, number: int, room_id: str, portals: list[_Portal], known: _Room | None) -> _Room:
        free = floor.owner == number
        for portal in portals:
            if portal.meeting is not None:
                free = free | portal.meeting
        free = free & floor.ground.standing
        cells = [portal.cells[portal.rooms.index(room_id)] for portal in portals]
        tops = np.where(floor.owner == number, floor.ground.tops, 0).astype(np.uint8)
        middle = _middle(free, floor.ground)
        starts = (*cells, *([middle] if middle else []))
        ids = tuple(portal.id for portal in portals)
        if known is not None and (known.ids, known.reach.cells) == (ids, starts) and np.array_equal(known.free, free):
            if np.array_equal(known.tops, tops):
                return known
            return _Room(ids, free, tops, known.reach, middle, known.reached, known.ways)
        reach = reach_from(starts, free, floor.plan.grid)
        # a room without connections: what hangs together with its middle
        reached = np.asarray(np.isfinite(reach.distance_m[: len(cells) or None]).any(axis=0))
        return _Room(ids, free, tops, reach, middle, reached)

    def _approaches(
        self, floor: _Floor, room: _Room, ends: list[str], objects: Sequence[PlacedObject]
    ) -> dict[str, Approach]:
        found = {}
        for thing in objects:
            known = room.stands.get(thing.id)
            if known is None or not _same(known[0], thing.target):
                known = (thing.target, find_stand(thing.target, room.free, room.reached, floor.ground, self._config))
                room.stands[thing.id] = known
            stand = known[1]
            if stand is None:
                continue
            x, y, z = floor.at(stand.cell).tolist()
            lengths = room.reach.distance_m[:, stand.cell[0], stand.cell[1]].tolist()
            travel = sorted((end, length) for end, length in zip(ends, lengths, strict=True) if np.isfinite(length))
            found[thing.id] = Approach((x, y, z), stand.yaw_rad, tuple(travel))
        return found


def _equal(one: Sequence[NDArray[Any]], other: Sequence[NDArray[Any]]) -> bool:
    return len(one) == len(other) and all(map(np.array_equal, one, other))


def _same(one: Target, other: Target) -> bool:
    return np.array_equal(one.middle, other.middle) and np.array_equal(one.footprint, other.footprint)


def _square(middle: F64) -> F64:
    return middle[:2] + PLACE_M * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])


def _middle(free: Bool, ground: Ground) -> tuple[int, int] | None:
    """Where a room is widest, of cells where the robot can stand; the first of several."""
    if not free.any():
        return None
    row, column = np.unravel_index(int(np.argmax(np.where(free, ground.clearance_m, -1))), free.shape)
    return int(row), int(column)


def _ways(room_id: str, ends: list[str], room: _Room) -> list[RouteSegment]:
    reach = room.reach
    for i in range(len(ends)):
        for j in range(i + 1, len(ends)):
            pair = (ends[i], ends[j])
            if pair not in room.ways and np.isfinite(reach.distance_m[i][reach.cells[j]]):
                points = reach.way(i, reach.cells[j])
                room.ways[pair] = RouteSegment(room=room_id, ends=pair, length_m=length_of(points), points=points)
    return list(room.ways.values())


def _connection(portal: _Portal) -> Connection:
    return Connection(
        id=portal.id,
        kind=portal.kind,
        rooms=portal.rooms,
        ends=portal.ends,
        width_m=portal.width_m,
        length_m=portal.length_m,
    )
