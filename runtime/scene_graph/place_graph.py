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
from typing import Any

import numpy as np

from placegraph.runtime.arrays import F64
from placegraph.runtime.errors import SchemaError

KINDS = ("door", "opening", "stairs")
CONNECTION_ID = re.compile(r"C(0|[1-9][0-9]*)")
ROUNDING_M = 0.01  # lengths and positions are rounded to 1 mm; along several points the rounding adds up


@dataclass(frozen=True, kw_only=True, eq=False)
class Connection:
    """A passage between two rooms; its ends are in rooms[0] and rooms[1], of stairs the lower one first."""

    id: str
    kind: str  # one of KINDS
    rooms: tuple[str, str]
    ends: F64  # (2, 3); of a door and an opening both are its middle
    width_m: float
    length_m: float  # of the path between the ends: 0 for a door

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
    length_m: float
    points: F64  # (K, 2), K >= 2, from the first end to the second


@dataclass(frozen=True)
class Approach:
    """Where a robot can stand to face an object, and the travel distances from its room's connections and middle."""

    position: tuple[float, float, float]  # of the robot's middle on the floor
    yaw_rad: float  # about z, 0 along x
    travel_m: tuple[tuple[str, float], ...]  # (id as in RouteSegment.ends, metres); empty when it cannot be reached


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


def rounded(values: Any, digits: int) -> Any:
    """Numbers as the canonical JSON has them."""
    # adding 0.0 turns -0.0 into 0.0, so that equal graphs print alike
    return (np.round(np.asarray(values, float), digits) + 0.0).tolist()


def connection_to_dict(connection: Connection) -> dict[str, Any]:
    """A connection's entry in the canonical JSON."""
    return {
        "id": connection.id,
        "kind": connection.kind,
        "rooms": list(connection.rooms),
        "ends": rounded(connection.ends, 3),
        "width_m": rounded(connection.width_m, 3),
        "length_m": rounded(connection.length_m, 3),
    }


def connection_from_dict(entry: Any, where: str) -> Connection:
    """Read what connection_to_dict made; raises SchemaError."""
    try:
        return Connection(
            id=str(entry["id"]),
            kind=str(entry["kind"]),
            rooms=_pair(entry["rooms"]),
            ends=np.array(entry["ends"], float).reshape(2, 3),
            width_m=float(entry["width_m"]),
            length_m=float(entry["length_m"]),
        )
    except (KeyError, TypeError, ValueError) as error:
        raise SchemaError(f"{where}: {type(error).__name__}: {error}") from None


def route_segment_to_dict(segment: RouteSegment) -> dict[str, Any]:
    """A way's entry in the canonical JSON."""
    return {
        "room": segment.room,
        "ends": list(segment.ends),
        "length_m": rounded(segment.length_m, 3),
        "points": rounded(segment.points, 3),
    }


def route_segment_from_dict(entry: Any, where: str) -> RouteSegment:
    """Read what way_to_dict made; raises SchemaError."""
    try:
        return RouteSegment(
            room=str(entry["room"]),
            ends=_pair(entry["ends"]),
            length_m=float(entry["length_m"]),
            points=np.array(entry["points"], float).reshape(-1, 2),
        )
    except (KeyError, TypeError, ValueError) as error:
        raise SchemaError(f"{where}: {type(error).__name__}: {error}") from None


def approach_to_dict(approach: Approach | None) -> dict[str, Any] | None:
    """An object's approach in the canonical JSON; null for none."""
    if approach is None:
        return None
    return {
        "position": rounded(approach.position, 3),
        "yaw_rad": rounded(approach.yaw_rad, 3),
        "travel_m": {end: rounded(length, 3) for end, length in approach.travel_m},
    }


def approach_from_dict(entry: Any) -> Approach | None:
    """Read what approach_to_dict made; raises KeyError, TypeError, ValueError for what it did not make."""
    if entry is None:
        return None
    x, y, z = (float(value) for value in entry["position"])
    travel = tuple((str(end), float(length)) for end, length in sorted(entry["travel_m"].items()))
    return Approach((x, y, z), float(entry["yaw_rad"]), travel)


def _pair(values: Any) -> tuple[str, str]:
    first, second = values
    return str(first), str(second)
