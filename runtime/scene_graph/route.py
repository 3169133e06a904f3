"""The shortest route through the place graph of a scene graph: from a room, object or point to a room or object.

Inside rooms the stored route segments are used. Where none is stored (from a point, or between two objects of one room)
the route has a straight line instead and is marked `straight`.
Not in the paper. Source: Dijkstra's algorithm.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass

import cv2
import numpy as np

from placegraph.runtime.arrays import F64
from placegraph.runtime.scene_graph import SceneGraph

_State = tuple[str, str]  # a connection ("" for start and goal) and the room on this side of it


@dataclass(frozen=True, eq=False)
class Route:
    """Rooms and connections in turn, length, and waypoints (K, 3) in metres, world frame."""

    ids: tuple[str, ...]  # room, connection, room, ..., room
    length_m: float
    points: F64
    straight: bool  # part of it is a straight line that was not checked for obstacles


@dataclass(frozen=True, eq=False)
class _Endpoint:
    """Start or goal: its room, and the metres from it to the ends of that room's segments (RouteSegment.ends)."""

    room: str
    distance_m: dict[str, float]
    point: F64 | None  # None: the room's own middle
    straight: bool = False


def room_at(graph: SceneGraph, xyz_world: F64) -> str:
    """The room that holds a point (3,), or the nearest one of the floor that it stands on; "" without any room."""
    rooms = graph.layer("room")
    if not rooms:
        return ""
    # the point is on the highest floor that is not above it
    heights = sorted({float(room.box[0, 2]) for room in rooms})
    floor_z = max((z for z in heights if z <= xyz_world[2]), default=heights[0])
    candidates = [room for room in rooms if float(room.box[0, 2]) == floor_z]
    return min(candidates, key=lambda room: _distance_to(room.footprint, xyz_world[:2])).id


def find_route(graph: SceneGraph, start: str | F64, goal: str) -> Route | None:
    """The shortest route; None where no route is known. `start`: id of a room or object, or a point (3,), world frame.

    `goal`: id of a room or object; a location counts as its room.
    """
    a, b = _endpoint(graph, start), _endpoint(graph, goal)
    if a is None or b is None:
        return None
    if a.room == b.room:
        return _route_within_room(a, b)
    previous: dict[_State, _State] = {}
    queue: list[tuple[float, _State, _State]] = [
        (length, (end, a.room), ("", a.room))
        for end, length in sorted(a.distance_m.items())
        if end in graph.connections
    ]
    heapq.heapify(queue)
    while queue:
        length, state, came_from = heapq.heappop(queue)
        if state in previous:
            continue
        previous[state] = came_from
        if not state[0]:
            return _route(graph, a, b, previous, length)
        for neighbor, distance in _neighbors(graph, state, b):
            if neighbor not in previous:
                heapq.heappush(queue, (length + distance, neighbor, state))
    return None


def _neighbors(graph: SceneGraph, state: _State, goal: _Endpoint) -> list[tuple[_State, float]]:
    """The states that can be reached directly from a state, and the metres to each."""
    connection_id, room = state
    connection = graph.connections[connection_id]
    neighbors: list[tuple[_State, float]] = [((connection_id, connection.room_beyond(room)), connection.length_m)]
    for segment in graph.route_segments:
        if segment.room == room and connection_id in segment.ends and room not in segment.ends:
            neighbors.append(((segment.ends[1 - segment.ends.index(connection_id)], room), segment.length_m))
    if room == goal.room and connection_id in goal.distance_m:
        neighbors.append((("", room), goal.distance_m[connection_id]))
    return neighbors


def _endpoint(graph: SceneGraph, place: str | F64) -> _Endpoint | None:
    if not isinstance(place, str):
        xyz = np.asarray(place, float)
        room = room_at(graph, xyz)
        if not room:
            return None
        on_floor = np.array([*xyz[:2], graph.nodes[room].box[0, 2]])
        ends = {door.id: door.end_in(room) for door in graph.connections.values() if room in door.rooms}
        distances = {connection_id: float(np.linalg.norm(end - on_floor)) for connection_id, end in ends.items()}
        return _Endpoint(room, distances, on_floor, straight=True)
    room = graph.room_of(place)
    if not room:
        return None
    if graph.nodes[place].layer == "object":
        approach = graph.nodes[place].approach
        return None if approach is None else _Endpoint(room, dict(approach.travel_m), np.array(approach.position))
    to_middle = [segment for segment in graph.route_segments if segment.room == room and room in segment.ends]
    lengths = {segment.ends[1 - segment.ends.index(room)]: segment.length_m for segment in to_middle}
    return _Endpoint(room, lengths, None)


def _route_within_room(a: _Endpoint, b: _Endpoint) -> Route:
    points = [endpoint.point for endpoint in (a, b) if endpoint.point is not None]
    if len(points) < 2:
        length = sum(endpoint.distance_m.get(endpoint.room, 0.0) for endpoint in (a, b))
        return Route((a.room,), length, np.array(points).reshape(-1, 3), a.straight)
    return Route((a.room,), float(np.linalg.norm(points[1] - points[0])), np.stack(points), straight=True)


def _route(graph: SceneGraph, a: _Endpoint, b: _Endpoint, previous: dict[_State, _State], length_m: float) -> Route:
    states = [("", b.room)]
    while states[-1] in previous and (states[-1] != ("", a.room)):
        states.append(previous[states[-1]])
    states = states[-2:0:-1]  # without start and goal: connections with their sides, in order
    ids, points = [a.room], [] if a.point is None else [a.point[None]]
    came_from = a.room if a.point is None else ""
    for connection_id, room in states:
        if room == ids[-1]:  # through the room, up to the connection
            points.append(_segment_points(graph, room, came_from, connection_id))
        else:
            ids += [connection_id, room]
            points.append(graph.connections[connection_id].end_in(room)[None])
        came_from = connection_id
    points.append(_segment_points(graph, b.room, came_from, b.room) if b.point is None else b.point[None])
    line = np.concatenate(points)
    distinct = np.r_[True, np.linalg.norm(np.diff(line, axis=0), axis=1) > 0]
    return Route(tuple(ids), length_m, line[distinct], a.straight)


def _segment_points(graph: SceneGraph, room: str, start: str, end: str) -> F64:
    """(K, 3) of the stored segment between two ends in a room; the connection's end alone if there is none."""
    floor_z = float(graph.nodes[room].box[0, 2])
    for segment in graph.route_segments:
        if segment.room == room and set(segment.ends) == {start, end}:
            line = segment.points if segment.ends[0] == start else segment.points[::-1]
            return np.column_stack((line, np.full(len(line), floor_z)))
    return graph.connections[end].end_in(room)[None]


def _distance_to(footprint: F64, xy: F64) -> float:
    """Metres from a point to a polygon (N, 2); 0 inside, infinite without a polygon."""
    if not len(footprint):
        return np.inf
    return max(0.0, -cv2.pointPolygonTest(footprint.astype(np.float32), xy.tolist(), True))
