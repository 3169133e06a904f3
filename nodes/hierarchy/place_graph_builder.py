"""The place graph of a map: connections between rooms, route segments between them, approach poses of objects.

Rooms that did not change keep what was found for them in the build before. The paper has no such step.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from placegraph.nodes.hierarchy.approach_poses import ApproachCell, ApproachTarget, find_approach
from placegraph.nodes.hierarchy.floors import FloorConfig, FloorSpan
from placegraph.nodes.hierarchy.openings import Opening, find_openings, grow_rooms
from placegraph.nodes.hierarchy.path_planning import ShortestPaths, path_length_m, shortest_paths
from placegraph.nodes.hierarchy.persistent_ids import PersistentIds
from placegraph.nodes.hierarchy.plan_grid import PlanGrid
from placegraph.nodes.hierarchy.rooms import RoomConfig
from placegraph.nodes.hierarchy.stairs import Stairs, find_stairs, path_segments_on, standing_floors
from placegraph.nodes.hierarchy.traversability import (
    TraversabilityConfig,
    TraversabilityMap,
    compute_traversability,
    drop_off_points,
)
from placegraph.runtime.arrays import F64, I32, I64, U8, Bool, Points
from placegraph.runtime.messages import Map
from placegraph.runtime.scene_graph.place_graph import Approach, Connection, Way

CONNECTION_HALF_M = 0.5  # half the side of the square by which a connection is recognised in the next map
STAIRS_ROOM_M = 1.0  # stairs end in a room that is so near at most; both chosen by hand


@dataclass(frozen=True, eq=False)
class FloorPlan:
    """One floor as the room layer has it: its points and free cells (N, 3), and each room's id and mask."""

    id: str
    span: FloorSpan
    grid: PlanGrid
    points_world: Points
    free_points_world: Points
    rooms: tuple[tuple[str, Bool], ...]


@dataclass(frozen=True, eq=False)
class PlacedObject:
    """An object: its id, its room's id, and what it looks like from above."""

    id: str
    room_id: str
    target: ApproachTarget


@dataclass(frozen=True, eq=False)
class PlaceGraph:
    """Connections and route segments of a map, and the approaches of its objects by id."""

    connections: list[Connection]
    route_segments: list[Way]
    approaches: dict[str, Approach]


@dataclass(frozen=True, eq=False)
class _FloorConnections:
    """What was found for one floor, and from which inputs; with equal inputs it is not computed again."""

    plan: FloorPlan
    traversability: TraversabilityMap
    room_of_cell: I32
    openings: list[Opening]
    inputs: tuple[NDArray[Any], ...]

    def position(self, cell: tuple[int, int]) -> F64:
        center = self.plan.grid.origin + (np.array(cell[::-1]) + 0.5) * self.plan.grid.cell_m
        return np.array([*center, self.plan.span.low])


@dataclass(eq=False)
class _ConnectionDraft:
    """A connection before it has an id, with the cell where it begins in each of its rooms."""

    kind: str
    rooms: tuple[str, str]
    cells: tuple[tuple[int, int], tuple[int, int]]
    ends: F64
    width_m: float
    length_m: float
    group: str
    boundary: Bool | None = None  # of an opening: cells that paths in both rooms may use
    id: str = ""


@dataclass(frozen=True, eq=False)
class _RoomPaths:
    """What was found for one room, and from which inputs."""

    connection_ids: tuple[str, ...]
    standable: Bool
    obstacle_levels: U8
    paths: ShortestPaths
    center: tuple[int, int] | None
    reachable: Bool
    route_segments: dict[tuple[str, str], Way] = field(default_factory=dict)
    approach_cells: dict[str, tuple[ApproachTarget, ApproachCell | None]] = field(default_factory=dict)


class PlaceGraphBuilder:
    """Makes the place graph of each Map and remembers the ids of connections."""

    def __init__(self, config: TraversabilityConfig, floors: FloorConfig, rooms: RoomConfig) -> None:
        self._config, self._floor_config, self._door_m = config, floors, rooms.door_m
        self._connection_ids = PersistentIds("C")
        self._floors: dict[str, _FloorConnections] = {}
        self._rooms: dict[str, _RoomPaths] = {}

    def build(self, map_: Map, plans: Sequence[FloorPlan], objects: Sequence[PlacedObject]) -> PlaceGraph:
        """Connections, route segments and approaches of a map. Deterministic in the sequence of maps."""
        spans = [plan.span for plan in plans]
        standing = standing_floors(map_.camera_positions_world, spans, self._floor_config, self._config)
        floors = [self._floor(map_, plan, number, standing) for number, plan in enumerate(plans)]
        self._floors = {floor.plan.id: floor for floor in floors}
        connections = self._connections(map_, floors, spans, standing)
        route_segments: list[Way] = []
        approaches: dict[str, Approach] = {}
        previous, self._rooms = self._rooms, {}
        for floor in floors:
            for number, (room_id, _) in enumerate(floor.plan.rooms):
                in_room = [connection for connection in connections if room_id in connection.rooms]
                room = self._room_paths(floor, number, room_id, in_room, previous.get(room_id))
                self._rooms[room_id] = room
                ends = [connection.id for connection in in_room] + [room_id] * (room.center is not None)
                route_segments += _route_segments(room_id, ends, room)
                room_objects = [placed for placed in objects if placed.room_id == room_id]
                approaches |= self._approaches(floor, room, ends, room_objects)
        return PlaceGraph([_connection(draft) for draft in connections], route_segments, approaches)

    def _connections(
        self, map_: Map, floors: list[_FloorConnections], spans: list[FloorSpan], standing: I64
    ) -> list[_ConnectionDraft]:
        drafts = [draft for floor in floors for draft in self._openings(floor)]
        for stairs in find_stairs(map_.camera_positions_world, standing, spans, map_.points_world, self._config):
            if (draft := self._stairs(stairs, floors)) is not None:
                drafts.append(draft)
        squares = [(draft.group, _square(draft.ends.mean(axis=0))) for draft in drafts]
        for draft, connection_id in zip(drafts, self._connection_ids.assign(squares), strict=True):
            draft.id = connection_id
        return sorted(drafts, key=lambda draft: int(draft.id[1:]))

    def _floor(self, map_: Map, plan: FloorPlan, number: int, standing: I64) -> _FloorConnections:
        segments = path_segments_on(number, map_.camera_positions_world, standing, self._config)
        drop_offs = drop_off_points(map_.points_world, plan.span, self._config)
        masks = [mask for _, mask in plan.rooms]
        points, free = plan.points_world, plan.free_points_world
        inputs: tuple[Points | Bool, ...] = (points, drop_offs, free, segments, plan.grid.origin, *masks)
        previous = self._floors.get(plan.id)
        if previous is not None and previous.plan.span == plan.span and _equal(previous.inputs, inputs):
            return _FloorConnections(plan, previous.traversability, previous.room_of_cell, previous.openings, inputs)
        traversability = compute_traversability(
            points, drop_offs, free, map_.free_cell_m, segments, plan.grid, plan.span, self._config
        )
        room_of_cell = grow_rooms(masks, traversability, self._config)
        openings = find_openings(room_of_cell, traversability, self._config)
        return _FloorConnections(plan, traversability, room_of_cell, openings, inputs)

    def _openings(self, floor: _FloorConnections) -> list[_ConnectionDraft]:
        def draft(opening: Opening) -> _ConnectionDraft:
            first, second = (floor.plan.rooms[number][0] for number in opening.rooms)
            kind = "door" if opening.width_m < self._door_m else "opening"
            ends = np.stack([floor.position(opening.cell)] * 2)
            cells = (opening.cell, opening.cell)
            return _ConnectionDraft(
                kind, (first, second), cells, ends, opening.width_m, 0.0, floor.plan.id, opening.boundary
            )

        return [draft(opening) for opening in floor.openings]

    def _stairs(self, stairs: Stairs, floors: Sequence[_FloorConnections]) -> _ConnectionDraft | None:
        """Stairs between the rooms in which they end; None where an end lies in no room."""
        rooms, cells, ends = [], [], []
        for number, end in zip(stairs.floors, stairs.ends, strict=True):
            floor = floors[number]
            grid = floor.plan.grid
            rows, columns = np.nonzero(floor.traversability.standable & (floor.room_of_cell >= 0))
            apart = np.hypot(*(grid.origin + (np.stack((columns, rows), 1) + 0.5) * grid.cell_m - end[:2]).T)
            if not len(apart) or apart.min() > STAIRS_ROOM_M:
                return None
            nearest = int(np.argmin(apart))
            cells.append((int(rows[nearest]), int(columns[nearest])))
            rooms.append(floor.plan.rooms[int(floor.room_of_cell[cells[-1]])][0])
            ends.append(floor.position(cells[-1]))
        length = max(stairs.length_m, float(np.linalg.norm(ends[1] - ends[0])))
        group = " ".join(floors[number].plan.id for number in stairs.floors)
        return _ConnectionDraft(
            "stairs", (rooms[0], rooms[1]), (cells[0], cells[1]), np.stack(ends), stairs.width_m, length, group
        )

    def _room_paths(
        self,
        floor: _FloorConnections,
        number: int,
        room_id: str,
        connections: list[_ConnectionDraft],
        previous: _RoomPaths | None,
    ) -> _RoomPaths:
        standable = floor.room_of_cell == number
        for connection in connections:
            if connection.boundary is not None:
                standable = standable | connection.boundary
        standable = standable & floor.traversability.standable
        cells = [connection.cells[connection.rooms.index(room_id)] for connection in connections]
        levels = np.where(floor.room_of_cell == number, floor.traversability.obstacle_levels, 0).astype(np.uint8)
        center = _widest_cell(standable, floor.traversability)
        starts = (*cells, *([center] if center else []))
        ids = tuple(connection.id for connection in connections)
        same_ends = previous is not None and (previous.connection_ids, previous.paths.starts) == (ids, starts)
        if previous is not None and same_ends and np.array_equal(previous.standable, standable):
            if np.array_equal(previous.obstacle_levels, levels):
                return previous
            return _RoomPaths(
                ids, standable, levels, previous.paths, center, previous.reachable, previous.route_segments
            )
        paths = shortest_paths(starts, standable, floor.plan.grid)
        # a room without connections: what is connected to its centre
        reachable = np.asarray(np.isfinite(paths.distance_m[: len(cells) or None]).any(axis=0))
        return _RoomPaths(ids, standable, levels, paths, center, reachable)

    def _approaches(
        self, floor: _FloorConnections, room: _RoomPaths, ends: list[str], objects: Sequence[PlacedObject]
    ) -> dict[str, Approach]:
        approaches = {}
        for placed in objects:
            cached = room.approach_cells.get(placed.id)
            if cached is None or not _same_target(cached[0], placed.target):
                approach_cell = find_approach(
                    placed.target, room.standable, room.reachable, floor.traversability, self._config
                )
                cached = room.approach_cells[placed.id] = (placed.target, approach_cell)
            approach = cached[1]
            if approach is None:
                continue
            x, y, z = floor.position(approach.cell).tolist()
            lengths = room.paths.distance_m[:, approach.cell[0], approach.cell[1]].tolist()
            travel = sorted((end, length) for end, length in zip(ends, lengths, strict=True) if np.isfinite(length))
            approaches[placed.id] = Approach((x, y, z), approach.yaw_rad, tuple(travel))
        return approaches


def _equal(a: Sequence[NDArray[Any]], b: Sequence[NDArray[Any]]) -> bool:
    return len(a) == len(b) and all(map(np.array_equal, a, b))


def _same_target(a: ApproachTarget, b: ApproachTarget) -> bool:
    return np.array_equal(a.center, b.center) and np.array_equal(a.footprint, b.footprint)


def _square(center: F64) -> F64:
    return center[:2] + CONNECTION_HALF_M * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])


def _widest_cell(standable: Bool, floor: TraversabilityMap) -> tuple[int, int] | None:
    """The standable cell of a room that is furthest from obstacles; the first of several."""
    if not standable.any():
        return None
    row, column = np.unravel_index(int(np.argmax(np.where(standable, floor.clearance_m, -1))), standable.shape)
    return int(row), int(column)


def _route_segments(room_id: str, ends: list[str], room: _RoomPaths) -> list[Way]:
    paths = room.paths
    for i in range(len(ends)):
        for j in range(i + 1, len(ends)):
            pair = (ends[i], ends[j])
            if pair not in room.route_segments and np.isfinite(paths.distance_m[i][paths.starts[j]]):
                points = paths.path(i, paths.starts[j])
                length = path_length_m(points)
                room.route_segments[pair] = Way(room=room_id, ends=pair, length_m=length, points=points)
    return list(room.route_segments.values())


def _connection(draft: _ConnectionDraft) -> Connection:
    return Connection(
        id=draft.id,
        kind=draft.kind,
        rooms=draft.rooms,
        ends=draft.ends,
        width_m=draft.width_m,
        length_m=draft.length_m,
    )
