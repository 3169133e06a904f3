"""The shortest way through the place graph of a scene graph: from a room, an object or a point to a room or object.

Inside rooms the stored ways are used. Where none is stored (from a point, or between two objects of one room) the
straight line stands in, and the route says so.
Source: issue 4, "room-to-room paths"; Dijkstra's algorithm. The paper has none.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass

import numpy as np

from placegraph.runtime.arrays import F64
from placegraph.runtime.scene_graph import SceneGraph

_State = tuple[str, str]  # a connection and the room on whose side of it one is; "" for start and goal


@dataclass(frozen=True, eq=False)
class Route:
    """Rooms and connections in turn, length, and way points (K, 3) in metres, world frame."""

    ids: tuple[str, ...]  # room, connection, room, ..., room
    length_m: float
    points: F64
    straight: bool  # part of it is a straight line that nobody has checked


@dataclass(frozen=True, eq=False)
class _End:
    """Start or goal: its room, and the metres from it to the ends of that room's ways (ids as in Way.ends)."""

    room: str
    distance_m: dict[str, float]
    point: F64 | None  # None: the room's own middle
    straight: bool = False


def room_at(graph: SceneGraph, xyz_world: F64) -> str:
    """The room that holds a point (3,), or the nearest one of the floor that it stands on; "" without any room."""
    rooms = graph.layer("room")
    if not rooms:
        return ""
    # a floor is stood on: the highest that is not above the point
    lows = sorted({float(room.box[0, 2]) for room in rooms})
    low = max((one for one in lows if one <= xyz_world[2]), default=lows[0])
    here = [room for room in rooms if float(room.box[0, 2]) == low]
    return min(here, key=lambda room: _distance_to(room.footprint, xyz_world[:2])).id


def find_route(graph: SceneGraph, start: str | F64, goal: str) -> Route | None:
    """The shortest route; None where no way is known. `start`: id of a room or object, or a point (3,), world frame.

    `goal`: id of a room or object; a location counts as its room.
    """
    a, b = _end_of(graph, start), _end_of(graph, goal)
    if a is None or b is None:
        return None
    if a.room == b.room:
        return _within(graph, a, b)
    before: dict[_State, _State] = {}
    best: dict[_State, float] = {}
    queue: list[tuple[float, _State, _State]] = [
        (length, (end, a.room), ("", a.room))
        for end, length in sorted(a.distance_m.items())
        if end in graph.connections
    ]
    heapq.heapify(queue)
    while queue:
        length, state, came = heapq.heappop(queue)
        if state in best:
            continue
        best[state], before[state] = length, came
        if not state[0]:
            return _route(graph, a, b, before, length)
        for step, further in _steps(graph, state, b):
            if step not in best:
                heapq.heappush(queue, (length + further, step, state))
    return None


def _steps(graph: SceneGraph, state: _State, goal: _End) -> list[tuple[_State, float]]:
    at, room = state
    connection = graph.connections[at]
    found: list[tuple[_State, float]] = [((at, connection.other(room)), connection.length_m)]
    for way in graph.ways:
        if way.room == room and at in way.ends and room not in way.ends:
            found.append(((way.ends[1 - way.ends.index(at)], room), way.length_m))
    if room == goal.room and at in goal.distance_m:
        found.append((("", room), goal.distance_m[at]))
    return found


def _end_of(graph: SceneGraph, place: str | F64) -> _End | None:
    if not isinstance(place, str):
        xyz = np.asarray(place, float)
        room = room_at(graph, xyz)
        if not room:
            return None
        feet = np.array([*xyz[:2], graph.nodes[room].box[0, 2]])
        ends = {one.id: one.end_in(room) for one in graph.connections.values() if room in one.rooms}
        return _End(room, {i: float(np.linalg.norm(end - feet)) for i, end in ends.items()}, feet, straight=True)
    room = graph.room_of(place)
    if not room:
        return None
    if graph.nodes[place].layer == "object":
        approach = graph.nodes[place].approach
        return None if approach is None else _End(room, dict(approach.travel_m), np.array(approach.position))
    here = [way for way in graph.ways if way.room == room and room in way.ends]
    return _End(room, {way.ends[1 - way.ends.index(room)]: way.length_m for way in here}, None)


def _within(graph: SceneGraph, a: _End, b: _End) -> Route:
    """A route that stays in one room."""
    points = [one.point for one in (a, b) if one.point is not None]
    if len(points) < 2:
        length = sum(one.distance_m.get(one.room, 0.0) for one in (a, b))
        return Route((a.room,), length, np.array(points).reshape(-1, 3), a.straight)
    return Route((a.room,), float(np.linalg.norm(points[1] - points[0])), np.stack(points), straight=True)


def _route(graph: SceneGraph, a: _End, b: _End, before: dict[_State, _State], length_m: float) -> Route:
    states = [("", b.room)]
    while states[-1] in before and (states[-1] != ("", a.room)):
        states.append(before[states[-1]])
    states = states[-2:0:-1]  # without the two ends: connections with their sides, in order
    ids, points = [a.room], [] if a.point is None else [a.point[None]]
    came = a.room if a.point is None else ""
    for connection_id, room in states:
        if room == ids[-1]:  # through the room, up to the connection
            points.append(_points(graph, room, came, connection_id))
        else:
            ids += [connection_id, room]
            points.append(graph.connections[connection_id].end_in(room)[None])
        came = connection_id
    points.append(_points(graph, b.room, came, b.room) if b.point is None else b.point[None])
    line = np.concatenate(points)
    kept = np.r_[True, np.linalg.norm(np.diff(line, axis=0), axis=1) > 0]
    return Route(tuple(ids), length_m, line[kept], a.straight)


def _points(graph: SceneGraph, room: str, came: str, to: str) -> F64:
    """(K, 3) of the stored way between two ends in a room; of none the connection's end alone."""
    low = float(graph.nodes[room].box[0, 2])
    for way in graph.ways:
        if way.room == room and set(way.ends) == {came, to}:
            line = way.points if way.ends[0] == came else way.points[::-1]
            return np.column_stack((line, np.full(len(line), low)))
    return graph.connections[to].end_in(room)[None]


def _distance_to(footprint: F64, xy: F64) -> float:
    """Metres from a point to a polygon (N, 2); 0 inside."""
    if len(footprint) < 3:
        return float(np.linalg.norm(footprint - xy, axis=1).min(initial=np.inf))
    a, b = footprint, np.roll(footprint, -1, axis=0)
    along = b - a
    share = np.clip(((xy - a) * along).sum(axis=1) / np.maximum((along**2).sum(axis=1), 1e-12), 0, 1)
    nearest = float(np.linalg.norm(a + share[:, None] * along - xy, axis=1).min())
    above = (a[:, 1] > xy[1]) != (b[:, 1] > xy[1])
    rise = np.where(along[:, 1] == 0, 1.0, along[:, 1])
    crossed = above & (xy[0] < a[:, 0] + (xy[1] - a[:, 1]) / rise * along[:, 0])
    return 0.0 if crossed.sum() % 2 else nearest
