"""The place graph of a map: connections between rooms, route segments between them, approach poses of objects.

Rooms that did not change keep what was found for them in the build before. The paper has no such step.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations

import numpy as np

from placegraph.nodes.hierarchy.approach_poses import ApproachCell, ApproachTarget, find_approach
from placegraph.nodes.hierarchy.floors import FloorConfig, FloorSpan
from placegraph.nodes.hierarchy.memo import Memo, digest
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
from placegraph.runtime.arrays import F64, I32, I64, Bool, Points
from placegraph.runtime.messages import Map
from placegraph.runtime.scene_graph.place_graph import Approach, Connection, RouteSegment

CONNECTION_HALF_M = 0.5  # half the side of the square by which a connection is recognised in the next map
STAIRS_ROOM_M = 1.0  # stairs end in a room that is so near at most; both chosen by hand


@dataclass(frozen=True, eq=False)
class FloorPlan:
    """One floor as the room layer has it: its points and free cells (N, 3), and each room's id and mask."""

    id: str
    key: bytes  # differs where the points, free cells or heights differ
    span: FloorSpan
    grid: PlanGrid
    points_world: Points
    free_points_world: Points
    rooms: tuple[tuple[str, Bool], ...]

    def position(self, cell: tuple[int, int]) -> F64:
        """(3,) metres, world, of a cell (row, column) on the floor."""
        return np.array([*self.grid.centers(*np.array(cell)), self.span.low_m])


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
    route_segments: list[RouteSegment]
    approaches: dict[str, Approach]


@dataclass(frozen=True, eq=False)
class _FloorOpenings:
    """What was found for one floor, whatever the ids of its rooms."""

    traversability: TraversabilityMap
    room_of_cell: I32
    openings: list[Opening]


@dataclass(frozen=True, eq=False)
class _PlacedConnection:
    """A connection, the cell where it begins in each of its rooms, and the floors that it cannot leave."""

    connection: Connection
    cells: tuple[tuple[int, int], tuple[int, int]]
    group: str
    boundary: Bool | None = None  # of an opening: cells that paths in both rooms may use


@dataclass(frozen=True, eq=False)
class _RoomPaths:
    """Where a robot can stand in a room, and its paths from the ends: connections, then the room's own centre."""

    key: bytes
    ends: list[str]
    standable: Bool
    reachable: Bool
    paths: ShortestPaths


class PlaceGraphBuilder:
    """Makes the place graph of each Map and remembers the ids of connections."""

    def __init__(self, config: TraversabilityConfig, floors: FloorConfig, rooms: RoomConfig) -> None:
        self._config, self._floor_config, self._door_m = config, floors, rooms.door_m
        self._connection_ids = PersistentIds("C")
        self._floor_memo: Memo[_FloorOpenings] = Memo()
        self._path_memo: Memo[ShortestPaths] = Memo()
        self._segment_memo: Memo[F64] = Memo()
        self._approach_memo: Memo[ApproachCell | None] = Memo()

    def build(self, map_: Map, plans: Sequence[FloorPlan], objects: Sequence[PlacedObject]) -> PlaceGraph:
        """Connections, route segments and approaches of a map. Deterministic in the sequence of maps."""
        spans = [plan.span for plan in plans]
        standing = standing_floors(map_.camera_positions_world, spans, self._floor_config, self._config)
        floors = [(plan, self._find_openings(map_, plan, number, standing)) for number, plan in enumerate(plans)]
        stairs = find_stairs(map_.camera_positions_world, standing, spans, map_.points_world, self._config)
        connections = self._connections(floors, stairs)
        route_segments: list[RouteSegment] = []
        approaches: dict[str, Approach] = {}
        for plan, floor in floors:
            for number, (room_id, _) in enumerate(plan.rooms):
                in_room = [item for item in connections if room_id in item.connection.rooms]
                room = self._room_paths(plan, floor, number, in_room)
                route_segments += self._route_segments(room_id, room)
                levels = np.where(floor.room_of_cell == number, floor.traversability.obstacle_levels, 0)
                key = digest(room.key, levels)
                for placed in [placed for placed in objects if placed.room_id == room_id]:
                    if (approach := self._approach(plan, floor, room, key, placed.target)) is not None:
                        approaches[placed.id] = approach
        for memo in (self._floor_memo, self._path_memo, self._segment_memo, self._approach_memo):
            memo.end_build()
        return PlaceGraph([item.connection for item in connections], route_segments, approaches)

    def _find_openings(self, map_: Map, plan: FloorPlan, number: int, standing: I64) -> _FloorOpenings:
        segments = path_segments_on(number, map_.camera_positions_world, standing, self._config)
        drop_offs = drop_off_points(map_.points_world, plan.span, self._config)

        def compute() -> _FloorOpenings:
            traversability = compute_traversability(
                plan.points_world,
                drop_offs,
                plan.free_points_world,
                map_.free_cell_m,
                segments,
                plan.grid,
                plan.span,
                self._config,
            )
            room_of_cell = grow_rooms([mask for _, mask in plan.rooms], traversability, self._config)
            openings = find_openings(room_of_cell, traversability, self._config)
            return _FloorOpenings(traversability, room_of_cell, openings)

        return self._floor_memo.get(digest(plan.key, drop_offs, segments), compute)

    def _connections(
        self, floors: Sequence[tuple[FloorPlan, _FloorOpenings]], stairs: Sequence[Stairs]
    ) -> list[_PlacedConnection]:
        """All connections with their ids, in the order of these."""
        found = [self._door(plan, opening) for plan, floor in floors for opening in floor.openings]
        found += [item for item in (_join_floors(flight, floors) for flight in stairs) if item is not None]
        squares = [(item.group, _square(item.connection.ends.mean(axis=0))) for item in found]
        ids = self._connection_ids.assign(squares)
        found = [
            replace(item, connection=replace(item.connection, id=connection_id))
            for item, connection_id in zip(found, ids, strict=True)
        ]
        return sorted(found, key=lambda item: int(item.connection.id[1:]))

    def _door(self, plan: FloorPlan, opening: Opening) -> _PlacedConnection:
        first, second = (plan.rooms[number][0] for number in opening.rooms)
        connection = Connection(
            id="",
            kind="door" if opening.width_m < self._door_m else "opening",
            rooms=(first, second),
            ends=np.stack([plan.position(opening.cell)] * 2),
            width_m=opening.width_m,
            length_m=0.0,
        )
        return _PlacedConnection(connection, (opening.cell, opening.cell), plan.id, opening.boundary)

    def _room_paths(
        self, plan: FloorPlan, floor: _FloorOpenings, number: int, connections: Sequence[_PlacedConnection]
    ) -> _RoomPaths:
        room_id = plan.rooms[number][0]
        standable = floor.room_of_cell == number
        for item in connections:
            if item.boundary is not None:
                standable = standable | item.boundary
        standable = standable & floor.traversability.standable
        starts = [item.cells[item.connection.rooms.index(room_id)] for item in connections]
        ends = [item.connection.id for item in connections]
        if standable.any():
            starts.append(_widest_cell(standable, floor.traversability))
            ends.append(room_id)
        key = digest(standable, np.array(starts), plan.grid.origin)
        paths = self._path_memo.get(key, lambda: shortest_paths(starts, standable, plan.grid))
        # a room without connections: what is connected to its centre
        reachable = np.asarray(np.isfinite(paths.distance_m[: len(connections) or None]).any(axis=0))
        return _RoomPaths(key, ends, standable, reachable, paths)

    def _route_segments(self, room_id: str, room: _RoomPaths) -> list[RouteSegment]:
        segments = []
        for i, j in combinations(range(len(room.ends)), 2):
            end = room.paths.starts[j]
            if np.isfinite(room.paths.distance_m[i][end]):
                points = self._segment_memo.get(digest(room.key, i, j), partial(room.paths.path, i, end))
                ends = (room.ends[i], room.ends[j])
                segments.append(RouteSegment(room=room_id, ends=ends, length_m=path_length_m(points), points=points))
        return segments

    def _approach(
        self, plan: FloorPlan, floor: _FloorOpenings, room: _RoomPaths, key: bytes, target: ApproachTarget
    ) -> Approach | None:
        """Where to stand before an object; key: differs where the room or its obstacles differ."""
        found = self._approach_memo.get(
            digest(key, target.footprint, target.center),
            lambda: find_approach(target, room.standable, room.reachable, floor.traversability, self._config),
        )
        if found is None:
            return None
        x, y, z = plan.position(found.cell).tolist()
        lengths = room.paths.distance_m[:, found.cell[0], found.cell[1]].tolist()
        travel = sorted((end, length) for end, length in zip(room.ends, lengths, strict=True) if np.isfinite(length))
        return Approach((x, y, z), found.yaw_rad, tuple(travel))


def _join_floors(flight: Stairs, floors: Sequence[tuple[FloorPlan, _FloorOpenings]]) -> _PlacedConnection | None:
    """Stairs between the rooms in which they end; None where an end lies in no room."""
    rooms, cells, ends = [], [], []
    for number, end in zip(flight.floors, flight.ends, strict=True):
        plan, floor = floors[number]
        rows, columns = np.nonzero(floor.traversability.standable & (floor.room_of_cell >= 0))
        apart = np.hypot(*(plan.grid.centers(rows, columns) - end[:2]).T)
        if not len(apart) or apart.min() > STAIRS_ROOM_M:
            return None
        nearest = int(np.argmin(apart))
        cells.append((int(rows[nearest]), int(columns[nearest])))
        rooms.append(plan.rooms[int(floor.room_of_cell[cells[-1]])][0])
        ends.append(plan.position(cells[-1]))
    connection = Connection(
        id="",
        kind="stairs",
        rooms=(rooms[0], rooms[1]),
        ends=np.stack(ends),
        width_m=flight.width_m,
        length_m=max(flight.length_m, float(np.linalg.norm(ends[1] - ends[0]))),
    )
    group = " ".join(floors[number][0].id for number in flight.floors)
    return _PlacedConnection(connection, (cells[0], cells[1]), group)


def _square(center: F64) -> F64:
    return center[:2] + CONNECTION_HALF_M * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])


def _widest_cell(standable: Bool, floor: TraversabilityMap) -> tuple[int, int]:
    """The standable cell of a room that is furthest from obstacles; the first of several."""
    row, column = np.unravel_index(int(np.argmax(np.where(standable, floor.clearance_m, -1))), standable.shape)
    return int(row), int(column)
