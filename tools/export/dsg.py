"""Scene graph as the JSON of spark_dsg (MIT-SPARK), which Hydra and its tools read.

Layers: OBJECTS 2, PLACES 3 (our locations), ROOMS 4, FLOORS 5, BUILDINGS 6; a node's symbol is the letter and number
of its id. Rooms that a door, an opening or stairs join have an edge. Names of objects are a labelspace of their layer.
Source: files that spark_dsg 1.1.3 wrote.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from placegraph.runtime.scene_graph import GraphNode, SceneGraph
from placegraph.runtime.scene_graph.route import find_route

LAYERS = {"object": 2, "location": 3, "room": 4, "floor": 5, "building": 6}
NAMES = {"object": "OBJECTS", "location": "PLACES", "room": "ROOMS", "floor": "FLOORS", "building": "BUILDINGS"}
HEADER = {"project_name": "main", "version": {"major": 1, "minor": 1, "patch": 3}}
NO_LABEL = 2**32 - 1


def write(_: Path, graph: SceneGraph, out: Path) -> list[Path]:
    """Write the file; equal graphs give equal bytes."""
    out.write_text(json.dumps(document(graph), sort_keys=True) + "\n", encoding="utf-8")
    return [out]


def document(graph: SceneGraph) -> dict[str, Any]:
    """The JSON that spark_dsg's DynamicSceneGraph.load reads."""
    nodes = list(graph.nodes.values())
    labels = {name: k for k, name in enumerate(sorted({node.name for node in graph.layer("object")}))}
    keys = {layer: {"layer": key, "partition": 0} for layer, key in LAYERS.items()}
    return {
        "SPARK_DSG_header": HEADER,
        "directed": False,
        "multigraph": False,
        "layer_keys": list(keys.values()),
        "layer_names": {NAMES[layer]: key for layer, key in keys.items()},
        "metadata": {"labelspaces": {f"_l{LAYERS['object']}p0": [[k, name] for name, k in labels.items()]}},
        "nodes": [keys[n.layer] | {"id": symbol(n.id), "attributes": _attributes(n, labels)} for n in nodes],
        "edges": [{"source": symbol(n.parent), "target": symbol(n.id), "info": _edge()} for n in nodes if n.parent]
        + _passages(graph),
    }


def _passages(graph: SceneGraph) -> list[dict[str, Any]]:
    """An edge between each two rooms that connections join; its weight: the metres from middle to middle."""
    joined: dict[tuple[str, str], list[str]] = {}
    for connection in graph.connections.values():
        joined.setdefault((connection.rooms[0], connection.rooms[1]), []).append(connection.id)
    edges = []
    for (a, b), ids in joined.items():
        route = find_route(graph, a, b)
        length = None if route is None else round(route.length_m, 3)
        info = _edge() | {"weighted": length is not None, "metadata": {"connections": ids}}
        edges.append({"source": symbol(a), "target": symbol(b), "info": info | ({"weight": length} if length else {})})
    return edges


def symbol(node_id: str) -> int:
    """spark_dsg's NodeSymbol of an id: the letter in the highest byte, the number below."""
    return ord(node_id[0]) << 56 | int(node_id[1:])


def _edge() -> dict[str, Any]:
    return {"type": "EdgeAttributes", "weight": 1.0, "weighted": False, "metadata": {}}


def _attributes(node: GraphNode, labels: dict[str, int]) -> dict[str, Any]:
    red, green, blue = node.color or (128, 128, 128)
    attributes: dict[str, Any] = {
        "type": "SemanticNodeAttributes",
        "name": node.name,
        "position": _numbers(node.center),
        "bounding_box": _box(node),
        "color": {"r": red, "g": green, "b": blue, "a": 255},
        "semantic_label": NO_LABEL,
        "semantic_feature": {"rows": 0, "cols": 0, "data": None},
        "is_active": False,
        "is_predicted": False,
        "last_update_time_ns": 0,
        "metadata": {
            "id": node.id,
            "tags": [[tag.name, round(tag.weight, 4)] for tag in node.tags],
            "footprint": [_numbers(point) for point in node.footprint],
            "first_frame": node.first_frame,
            "last_frame": node.last_frame,
        },
    }
    if node.layer == "room":
        attributes |= {"type": "RoomNodeAttributes", "semantic_class_probabilities": {}}
    elif node.layer == "object":
        attributes |= {
            "type": "ObjectNodeAttributes",
            "semantic_label": labels[node.name],
            "mesh_connections": [],
            "registered": False,
            "world_R_object": _rotation(node.turned_box[6]),
        }
    return attributes


def _box(node: GraphNode) -> dict[str, Any]:
    return {
        "type": "RAABB" if node.oriented_box else "AABB",
        "world_P_center": _numbers(node.turned_box[:3]),
        "dimensions": _numbers(node.turned_box[3:6]),
        "world_R_center": _rotation(node.turned_box[6]),
    }


def _rotation(yaw: float) -> dict[str, float]:
    return {"w": round(math.cos(yaw / 2), 6), "x": 0.0, "y": 0.0, "z": round(math.sin(yaw / 2), 6)}


def _numbers(values: Any) -> list[float]:
    return [round(float(value), 3) + 0.0 for value in values]
