"""How to get from one place of a saved map to another."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from placegraph.runtime.errors import QueryError
from placegraph.runtime.scene_graph import Node, SceneGraph
from placegraph.runtime.scene_graph.json_types import rounded
from placegraph.runtime.scene_graph.route import Route, find_route
from placegraph.tools.map_folder import find_graph

LAYERS = ("room", "location", "object")  # a name is looked for in this order


def path(
    map_folder: Annotated[Path, typer.Argument(metavar="MAP", help="A map folder or graph file.")],
    start: Annotated[str, typer.Argument(metavar="FROM", help="Id or name of a room, location or object.")],
    goal: Annotated[str, typer.Argument(metavar="TO", help="The same.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Print the shortest way between two places of a map: rooms, doors and stairs, metres, way points.

    A room is its middle, an object the place to stand before it. Exit status 1 where no way is known.
    """
    graph = SceneGraph.load(find_graph(map_folder))
    a, b = place_called(graph, start), place_called(graph, goal)
    for node in (a, b):
        if node.layer == "object" and node.approach is None:
            raise QueryError(f"{node.name} {node.id}: the map knows no place to stand before it")
    route = find_route(graph, a.id, b.id)
    if route is None:
        rooms = " to ".join(_label(graph.nodes[graph.room_of(node.id)]) for node in (a, b))
        raise QueryError(f"no way is known from {_label(a)} to {_label(b)} ({rooms})")
    print(json.dumps(as_dict(graph, route, a, b), sort_keys=True) if as_json else in_words(graph, route, a, b))


def place_called(graph: SceneGraph, text: str) -> Node:
    """The room, location or object of an id or a name; rooms before locations before objects.

    Raises QueryError when there is none, or more than one of the first layer that has the name.
    """
    wanted = " ".join(text.split()).lower()
    node = graph.nodes.get(wanted.upper())
    if node is not None:
        if node.layer not in LAYERS:
            raise QueryError(f"{text}: a {node.layer} is no place to go to; give a room, a location or an object")
        return node
    for layer in LAYERS:
        named = [one for one in graph.layer(layer) if one.tags and one.name.lower() == wanted]
        if len(named) > 1:
            ids = ", ".join(f"{one.id} in {graph.room_of(one.id)}" if layer != "room" else one.id for one in named)
            raise QueryError(f"{text!r} names {len(named)} {layer}s: {ids}; give an id")
        if named:
            return named[0]
    rooms = ", ".join(_label(room) for room in graph.layer("room")) or "none"
    raise QueryError(f"nothing in the map is called {text!r}; its rooms: {rooms}")


def as_dict(graph: SceneGraph, route: Route, start: Node, goal: Node) -> dict[str, Any]:
    """A route as JSON has it; lengths in metres."""
    steps = []
    for i in route.ids:
        if i in graph.connections:
            one = graph.connections[i]
            steps.append({"id": i, "kind": one.kind, "width_m": rounded(one.width_m, 3), "ends": rounded(one.ends, 3)})
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


def in_words(graph: SceneGraph, route: Route, start: Node, goal: Node) -> str:
    """A route as lines of text."""
    lines = [f"{_label(start)} to {_label(goal)}: {route.length_m:.2f} m{' or more' if route.straight else ''}"]
    for i in route.ids:
        if i in graph.connections:
            one = graph.connections[i]
            x, y, z = one.ends.mean(axis=0)
            up = f", {one.length_m:.2f} m long" if one.kind == "stairs" else ""
            lines.append(f"  through {one.kind} {i} at ({x:.2f}, {y:.2f}, {z:.2f}), {one.width_m:.2f} m wide{up}")
        else:
            lines.append(f"  {_label(graph.nodes[i])}")
    lines.append("way points: " + " ".join(f"({x:.2f}, {y:.2f}, {z:.2f})" for x, y, z in route.points))
    if goal.approach:
        lines.append(f"there look to {np.degrees(goal.approach.yaw_rad):.0f} degrees")
    return "\n".join(lines)


def _label(node: Node) -> str:
    return f"{node.id} {node.name}" if node.tags else node.id
