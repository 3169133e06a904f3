"""The five-layer scene graph: a value with invariants and one canonical JSON form.

Building -> floors -> rooms -> locations -> objects. Ids are a letter and a number (B0 F1 R4 L12 O57) and never reused.
The edges between layers are the parent ids. Beside them the place graph is stored (place_graph.py): connections between
rooms (C3: doors, openings, stairs), route segments, approach poses. Spatial relations between objects are not stored:
they depend on the viewpoint and are computed when asked for.
Source: paper, section "Method" (G = (N, E), the boolean inter-layer edges). Not in the paper: the place graph.
"""

from __future__ import annotations

import json
import math
import re
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from placegraph.runtime.arrays import F64
from placegraph.runtime.errors import SchemaError
from placegraph.runtime.scene_graph.place_graph import (
    Approach,
    Connection,
    RouteSegment,
    approach_from_dict,
    approach_to_dict,
    check_approach,
    check_connection,
    check_route_segment,
    connection_from_dict,
    connection_key,
    connection_to_dict,
    rounded,
    route_segment_from_dict,
    route_segment_to_dict,
)

VERSION = 2  # 2: connections, ways and approaches
LAYERS = {"B": "building", "F": "floor", "R": "room", "L": "location", "O": "object"}
PARENT_LAYERS = {
    "building": (),
    "floor": ("building",),
    "room": ("floor",),
    "location": ("room",),
    "object": ("room", "location"),
}
ID_PATTERN = re.compile(r"[BFRLO](0|[1-9][0-9]*)")


@dataclass(frozen=True)
class Tag:
    """One name of a node and the weight of the evidence for it (summed votes for objects, probability for places)."""

    name: str
    weight: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Node:
    """One building, floor, room, location or object. Box (2, 3) min/max and footprint (K, 2) in metres, world frame."""

    id: str
    parent: str  # "" for the building
    tags: tuple[Tag, ...]  # strongest first
    box: F64
    footprint: F64
    first_frame: int  # -1: not tied to frames
    last_frame: int
    observations: int = 0
    oriented_box: tuple[float, ...] = ()  # objects: centre x y z, size x y z, yaw in rad about z
    color: tuple[int, ...] = ()  # objects: sRGB median
    approach: Approach | None = None  # objects: where to stand to face it; None when there is no such place
    front: tuple[float, ...] = ()  # imported objects: direction (x, y) of their front; () when unknown

    @property
    def layer(self) -> str:
        """building, floor, room, location or object."""
        return LAYERS[self.id[0]]

    @property
    def name(self) -> str:
        """The strongest tag, or the layer's name when there is none."""
        return self.tags[0].name if self.tags else self.layer

    @property
    def center(self) -> F64:
        """Middle of the box, (3,) metres, world frame."""
        return np.asarray(self.box.mean(axis=0))

    @property
    def turned_box(self) -> tuple[float, ...]:
        """The oriented box: centre x y z, size x y z, yaw; of a node without one its axis-aligned box."""
        return self.oriented_box or (*self.center.tolist(), *(self.box[1] - self.box[0]).tolist(), 0.0)


@dataclass(frozen=True, kw_only=True, eq=False)
class SceneGraph:
    """Nodes and connections by id, and route segments. Build it with `SceneGraph.of`, which checks the invariants."""

    nodes: dict[str, Node] = field(default_factory=dict)
    connections: dict[str, Connection] = field(default_factory=dict)
    route_segments: tuple[RouteSegment, ...] = ()

    @classmethod
    def of(
        cls, nodes: Iterable[Node], connections: Iterable[Connection] = (), route_segments: Iterable[RouteSegment] = ()
    ) -> SceneGraph:
        """Build and check a graph; raises SchemaError naming what breaks an invariant."""
        listed, joined = list(nodes), list(connections)
        ids = [*(node.id for node in listed), *(connection.id for connection in joined)]
        if len(set(ids)) != len(ids):
            raise SchemaError(f"scene graph: id {Counter(ids).most_common(1)[0][0]} appears more than once")
        graph = cls(
            nodes={node.id: node for node in sorted(listed, key=lambda node: id_key(node.id))},
            connections={door.id: door for door in sorted(joined, key=lambda door: connection_key(door.id))},
            route_segments=tuple(sorted(route_segments, key=lambda segment: (id_key(segment.room), segment.ends))),
        )
        graph.check()
        return graph

    def with_nodes(self, nodes: Iterable[Node]) -> SceneGraph:
        """The same connections and route segments with other nodes; raises SchemaError."""
        return SceneGraph.of(nodes, self.connections.values(), self.route_segments)

    def check(self) -> None:
        """Raise SchemaError unless there is one building, every parent is in an allowed layer, and values are valid."""
        buildings = [node.id for node in self.nodes.values() if node.layer == "building"]
        if len(buildings) != 1:
            raise SchemaError(f"scene graph: expected one building, found {len(buildings)}")
        for node in self.nodes.values():
            self._check_node(node)
        rooms = frozenset(node.id for node in self.layer("room"))
        for connection in self.connections.values():
            check_connection(connection, rooms)
        for segment in self.route_segments:
            check_route_segment(segment, self.connections, rooms)
        for node in self.nodes.values():
            if node.approach is not None:
                check_approach(f"scene graph node {node.id}", node.approach, self.room_of(node.id), self.connections)

    def _check_node(self, node: Node) -> None:
        where = f"scene graph node {node.id}"
        allowed = PARENT_LAYERS[node.layer]
        if not allowed:
            if node.parent:
                raise SchemaError(f"{where}: a building has no parent, found {node.parent}")
        elif node.parent not in self.nodes:
            raise SchemaError(f"{where}: parent {node.parent or '(none)'} is not in the graph")
        elif self.nodes[node.parent].layer not in allowed:
            raise SchemaError(
                f"{where}: a {node.layer} cannot hang from the {self.nodes[node.parent].layer} {node.parent}"
            )
        if node.box.shape != (2, 3) or not np.isfinite(node.box).all() or (node.box[0] > node.box[1]).any():
            raise SchemaError(f"{where}: box must be (2, 3), finite, min <= max, found {node.box.tolist()}")
        if node.footprint.ndim != 2 or node.footprint.shape[1] != 2 or not np.isfinite(node.footprint).all():
            raise SchemaError(f"{where}: footprint must be (K, 2) and finite")
        if node.oriented_box and (len(node.oriented_box) != 7 or not all(map(math.isfinite, node.oriented_box))):
            raise SchemaError(f"{where}: oriented_box must be 7 finite numbers")
        if node.front and (len(node.front) != 2 or not all(map(math.isfinite, node.front)) or not any(node.front)):
            raise SchemaError(f"{where}: front must be 2 finite numbers, not both 0")

    @cached_property
    def _children(self) -> dict[str, tuple[str, ...]]:
        ids_by_parent: dict[str, list[str]] = {}
        for node in self.nodes.values():
            ids_by_parent.setdefault(node.parent, []).append(node.id)
        return {parent: tuple(ids) for parent, ids in ids_by_parent.items()}

    @property
    def building(self) -> Node:
        """The root."""
        return next(node for node in self.nodes.values() if node.layer == "building")

    def layer(self, name: str) -> list[Node]:
        """All nodes of a layer, by id number."""
        return [node for node in self.nodes.values() if node.layer == name]

    def children(self, node_id: str) -> list[Node]:
        """Direct children, by layer and id number."""
        return [self.nodes[i] for i in self._children.get(node_id, ())]

    def descendants(self, node_id: str, layer: str) -> list[Node]:
        """All nodes of `layer` below a node, by id number."""
        nodes, parent_ids = [], [node_id]
        for parent_id in parent_ids:  # grows during the loop
            children = self.children(parent_id)
            parent_ids += [child.id for child in children]
            nodes += [child for child in children if child.layer == layer]
        return sorted(nodes, key=lambda node: id_key(node.id))

    def path(self, node_id: str) -> list[Node]:
        """From the building down to the node itself."""
        chain = [self.nodes[node_id]]
        while chain[-1].parent:
            chain.append(self.nodes[chain[-1].parent])
        return chain[::-1]

    def room_of(self, node_id: str) -> str:
        """The id of the room that contains a node (of a room its own); "" for a floor and the building."""
        return next((node.id for node in self.path(node_id) if node.layer == "room"), "")

    def to_json(self) -> str:
        """Canonical JSON: sorted keys, lengths to 1 mm, weights to 4 decimals; equal graphs give equal bytes."""
        document = {
            "version": VERSION,
            "nodes": [_node_to_dict(node) for node in self.nodes.values()],
            "connections": [connection_to_dict(connection) for connection in self.connections.values()],
            "ways": [route_segment_to_dict(segment) for segment in self.route_segments],
        }
        return json.dumps(document, sort_keys=True, separators=(",", ":"), ensure_ascii=False)

    @classmethod
    def from_json(cls, text: str, where: str = "scene graph") -> SceneGraph:
        """Read and check; raises SchemaError naming `where` and what is wrong."""
        try:
            data = json.loads(text)
        except json.JSONDecodeError as error:
            raise SchemaError(f"{where}: not JSON: {error}") from None
        if not isinstance(data, dict) or data.get("version") != VERSION:
            found = data.get("version") if isinstance(data, dict) else type(data).__name__
            raise SchemaError(f"{where}: expected graph version {VERSION}, found {found}")
        for name in ("nodes", "connections", "ways"):
            if not isinstance(data.get(name), list):
                raise SchemaError(f"{where}: '{name}' must be a list")
        return cls.of(
            (_node_from_dict(entry, f"{where}: nodes[{i}]") for i, entry in enumerate(data["nodes"])),
            [connection_from_dict(entry, f"{where}: connections[{i}]") for i, entry in enumerate(data["connections"])],
            [route_segment_from_dict(entry, f"{where}: ways[{i}]") for i, entry in enumerate(data["ways"])],
        )

    def save(self, path: Path) -> None:
        """Write canonical JSON to a file."""
        path.write_text(self.to_json() + "\n", encoding="utf-8")

    @classmethod
    def load(cls, path: Path) -> SceneGraph:
        """Read a file that `save` wrote; raises SchemaError."""
        try:
            return cls.from_json(path.read_text(encoding="utf-8"), str(path))
        except (OSError, UnicodeDecodeError) as error:
            raise SchemaError(f"{path}: cannot read the graph: {error}") from None


def id_key(node_id: str) -> tuple[int, int]:
    """Sort key: layer order from the building down, then number. Raises SchemaError for what is no id."""
    if not isinstance(node_id, str) or not ID_PATTERN.fullmatch(node_id):
        raise SchemaError(f"scene graph: {node_id!r} is not an id (a letter of B F R L O and a number)")
    return list(LAYERS).index(node_id[0]), int(node_id[1:])


def _node_to_dict(node: Node) -> dict[str, Any]:
    entry: dict[str, Any] = {
        "id": node.id,
        "layer": node.layer,
        "parent": node.parent,
        "tags": [[tag.name, rounded(tag.weight, 4)] for tag in node.tags],
        "box": rounded(node.box, 3),
        "footprint": rounded(node.footprint, 3),
        "first_frame": node.first_frame,
        "last_frame": node.last_frame,
    }
    if node.layer == "object":
        entry |= {
            "observations": node.observations,
            "oriented_box": rounded(node.oriented_box, 3),
            "color": list(node.color),
            "approach": approach_to_dict(node.approach),
        }
        if node.front:
            entry["front"] = rounded(node.front, 3)
    return entry


def _node_from_dict(entry: Any, where: str) -> Node:
    try:
        node_id = entry["id"]
        id_key(node_id)
        return Node(
            id=node_id,
            parent=str(entry["parent"]),
            tags=tuple(Tag(str(name), float(weight)) for name, weight in entry["tags"]),
            box=np.array(entry["box"], float).reshape(2, 3),
            footprint=np.array(entry["footprint"], float).reshape(-1, 2),
            first_frame=int(entry["first_frame"]),
            last_frame=int(entry["last_frame"]),
            observations=int(entry.get("observations", 0)),
            oriented_box=tuple(float(v) for v in entry.get("oriented_box", ())),
            color=tuple(int(v) for v in entry.get("color", ())),
            approach=approach_from_dict(entry.get("approach")),
            front=tuple(float(v) for v in entry.get("front", ())),
        )
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise SchemaError(f"{where}: {type(error).__name__}: {error}") from None
