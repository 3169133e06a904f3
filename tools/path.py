"""`placegraph path`: the shortest route between two places of a saved map."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from placegraph.runtime.errors import QueryError
from placegraph.runtime.scene_graph import GraphNode, SceneGraph
from placegraph.runtime.scene_graph.json_types import rounded
from placegraph.runtime.scene_graph.route import Route, find_route
from placegraph.tools.map_files.map_folder import read_graph

LAYERS = ("room", "location", "object")  # in this order a name is looked up


def path(
    map_folder: Annotated[Path, typer.Argument(metavar="MAP", help="A map folder or graph file.")],
    start: Annotated[str, typer.Argument(metavar="FROM", help="Id or name of a room, location or object.")],
    goal: Annotated[str, typer.Argument(metavar="TO", help="The same.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Print the shortest route between two places of a map.

    Rooms, doors and stairs on the way, metres, way points. A route starts and ends in the middle of a room or in front
    of an object. Exit status 1: no route is known.
    """
    graph = read_graph(map_folder)
    a, b = find_place(graph, start), find_place(graph, goal)
    for node in (a, b):
        if node.layer == "object" and node.approach is None:
            raise QueryError(f"{node.name} {node.id}: the map knows no place to stand before it")
    route = find_route(graph, a.id, b.id)
    if route is None:
        rooms = " to ".join(_label(graph.nodes[graph.room_of(node.id)]) for node in (a, b))
        raise QueryError(f"no way is known from {_label(a)} to {_label(b)} ({rooms})")
    print(json.dumps(as_dict(graph, route, a, b), sort_keys=True) if as_json else as_text(graph, route, a, b))


def find_place(graph: SceneGraph, text: str) -> GraphNode:
    """The room, location or object with an id or a name; rooms before locations before objects.

    Raises QueryError when there is none, or several in the first layer that has the name.
    """
    wanted = " ".join(text.split()).lower()
    node = graph.nodes.get(wanted.upper())
    if node is not None:
        if node.layer not in LAYERS:
            raise QueryError(f"{text}: a {node.layer} is no place to go to; give a room, a location or an object")
        return node
    for layer in LAYERS:
        matches = [place for place in graph.layer(layer) if place.tags and place.name.lower() == wanted]
        if len(matches) > 1:
            ids = ", ".join(p.id if layer == "room" else f"{p.id} in {graph.room_of(p.id)}" for p in matches)
            raise QueryError(f"{text!r} names {len(matches)} {layer}s: {ids}; give an id")
        if matches:
            return matches[0]
    rooms = ", ".join(_label(room) for room in graph.layer("room")) or "none"
    raise QueryError(f"nothing in the map is called {text!r}; its rooms: {rooms}")


def as_dict(graph: SceneGraph, route: Route, start: GraphNode, goal: GraphNode) -> dict[str, Any]:
    """A route for JSON; lengths in metres."""
    steps = []
    for i in route.ids:
        if i in graph.connections:
            passage = graph.connections[i]
            sizes = {"width_m": rounded(passage.width_m, 3), "ends": rounded(passage.ends, 3)}
            steps.append({"id": i, "kind": passage.kind} | sizes)
        else:
            steps.append({"id": i, "kind": "room", "name": graph.nodes[i].name})
    yaw = goal.approach.yaw_rad if goal.approach else None
    return {
        "from": start.id,
        "to": goal.id,
        "length_m": rounded(route.length_m, 3),
        "steps": steps,
        "points": rounded(route.points, 3),
        "arrival_yaw_rad": None if yaw is None else rounded(yaw, 3),
        "straight": route.straight,
    }


def as_text(graph: SceneGraph, route: Route, start: GraphNode, goal: GraphNode) -> str:
    """A route as lines of text."""
    lines = [f"{_label(start)} to {_label(goal)}: {route.length_m:.2f} m{' or more' if route.straight else ''}"]
    for i in route.ids:
        if i in graph.connections:
            passage = graph.connections[i]
            x, y, z = passage.ends.mean(axis=0)
            length = f", {passage.length_m:.2f} m long" if passage.kind == "stairs" else ""
            where = f"{passage.kind} {i} at ({x:.2f}, {y:.2f}, {z:.2f})"
            lines.append(f"  through {where}, {passage.width_m:.2f} m wide{length}")
        else:
            lines.append(f"  {_label(graph.nodes[i])}")
    lines.append("way points: " + " ".join(f"({x:.2f}, {y:.2f}, {z:.2f})" for x, y, z in route.points))
    if goal.approach:
        lines.append(f"there look to {np.degrees(goal.approach.yaw_rad):.0f} degrees")
    return "\n".join(lines)


def _label(node: GraphNode) -> str:
    return f"{node.id} {node.name}" if node.tags else node.id
