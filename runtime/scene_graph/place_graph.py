"""The place graph: connections between rooms, route segments inside rooms, and approach poses of objects.

Rooms are the nodes and connections the edges. Unlike a spatial relation ("left of"), which depends on the viewpoint and
is computed when asked for, a door is part of the building and is stored. Positions are metres in the world frame, on
the floor. Not as in the paper, which has no place graph: a robot needs routes and travel distances.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import WithJsonSchema

from placegraph.runtime.arrays import F64
from placegraph.runtime.errors import SchemaError
from placegraph.runtime.scene_graph.json_types import Box, LengthsById, Metres, Outline, Position, Radians

KINDS = ("door", "opening", "stairs")
CONNECTION_ID = re.compile(r"C(0|[1-9][0-9]*)")
ROUNDING_M = 0.01  # lengths and positions are rounded to 1 mm; along several points the rounding adds up


@dataclass(frozen=True, kw_only=True, eq=False)
class Connection:
    """A passage between two rooms; its ends are in rooms[0] and rooms[1], of stairs the lower one first."""

    id: str
    kind: Annotated[str, WithJsonSchema({"enum": list(KINDS)})]
    rooms: tuple[str, str]
    ends: Box  # (2, 3) metres; of a door and an opening both are its middle
    width_m: Metres
    length_m: Metres  # of the path between the ends: 0 for a door

    def end_in(self, room: str) -> F64:
        """(3,) the end that is in one of its rooms."""
        return np.asarray(self.ends[self.rooms.index(room)])

    def room_beyond(self, room: str) -> str:
        """The room on the other side."""
        return self.rooms[1 - self.rooms.index(room)]


@dataclass(frozen=True, kw_only=True, eq=False)
class RouteSegment:
    """The shortest path of a robot inside one room; an end is a connection's id, or the room's id for its middle."""

    room: str
    ends: tuple[str, str]
    length_m: Metres
    points: Outline  # (K, 2) metres, K >= 2, from the first end to the second


@dataclass(frozen=True)
class Approach:
    """Where a robot can stand to face an object, and the travel distances from its room's connections and middle."""

    position: Position  # of the robot's middle on the floor
    yaw_rad: Radians  # about z, 0 along x
    travel_m: LengthsById  # (id as in RouteSegment.ends, metres); empty when it cannot be reached


def connection_key(connection_id: str) -> int:
    """The number of a connection's id; raises SchemaError for what is none."""
    if not isinstance(connection_id, str) or not CONNECTION_ID.fullmatch(connection_id):
        raise SchemaError(f"scene graph: {connection_id!r} is not a connection's id (C and a number)")
    return int(connection_id[1:])


def check_connection(connection: Connection, rooms: frozenset[str]) -> None:
    """Both rooms exist and differ; numbers finite, width > 0, length at least the straight line. Raises SchemaError."""
    where = f"scene graph connection {connection.id}"
    connection_key(connection.id)
    if connection.kind not in KINDS:
        raise SchemaError(f"{where}: kind must be one of {', '.join(KINDS)}, found {connection.kind!r}")
    if len(connection.rooms) != 2 or connection.rooms[0] == connection.rooms[1]:
        raise SchemaError(f"{where}: must join two rooms, found {list(connection.rooms)}")
    for room in connection.rooms:
        if room not in rooms:
            raise SchemaError(f"{where}: {room} is no room of the graph")
    if connection.ends.shape != (2, 3) or not np.isfinite(connection.ends).all():
        raise SchemaError(f"{where}: ends must be (2, 3) and finite, found {connection.ends.tolist()}")
    if not math.isfinite(connection.width_m) or connection.width_m <= 0:
        raise SchemaError(f"{where}: width_m must be above 0, found {connection.width_m}")
    _check_length(where, connection.length_m, float(np.linalg.norm(connection.ends[1] - connection.ends[0])))


def check_route_segment(segment: RouteSegment, connections: Mapping[str, Connection], rooms: frozenset[str]) -> None:
    """Room and ends exist and meet; the length is at least the straight line. Raises SchemaError."""
    where = f"scene graph way {segment.ends} in {segment.room}"
    if segment.room not in rooms:
        raise SchemaError(f"{where}: {segment.room} is no room of the graph")
    for end in segment.ends:
        _check_end(where, end, segment.room, connections)
    if (
        segment.points.ndim != 2
        or segment.points.shape[1] != 2
        or len(segment.points) < 2
        or not np.isfinite(segment.points).all()
    ):
        raise SchemaError(f"{where}: points must be (K, 2), K >= 2, and finite")
    _check_length(where, segment.length_m, float(np.linalg.norm(segment.points[-1] - segment.points[0])))


def check_approach(where: str, approach: Approach, room: str, connections: Mapping[str, Connection]) -> None:
    """Finite numbers; distances to connections of the object's room, at least the straight line. Raises SchemaError."""
    if not all(map(math.isfinite, (*approach.position, approach.yaw_rad))) or len(approach.position) != 3:
        raise SchemaError(f"{where}: approach must be 3 finite numbers and a finite yaw")
    for end, length in approach.travel_m:
        _check_end(f"{where}: approach", end, room, connections)
        straight = 0.0
        if end in connections:
            straight = float(np.linalg.norm(connections[end].end_in(room)[:2] - np.array(approach.position[:2])))
        _check_length(f"{where}: approach from {end}", length, straight)


def _check_end(where: str, end: str, room: str, connections: Mapping[str, Connection]) -> None:
    if end != room and (end not in connections or room not in connections[end].rooms):
        raise SchemaError(f"{where}: {end} is neither {room} nor one of its connections")


def _check_length(where: str, length_m: float, straight_m: float) -> None:
    if not math.isfinite(length_m) or length_m < straight_m - ROUNDING_M:
        raise SchemaError(f"{where}: length {length_m} m is not at least the straight line, {straight_m:.3f} m")
