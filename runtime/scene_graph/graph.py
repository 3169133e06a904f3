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
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import (
    BaseModel,
    ConfigDict,
    GetJsonSchemaHandler,
    PlainValidator,
    SerializerFunctionWrapHandler,
    ValidationError,
    WithJsonSchema,
    model_serializer,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from placegraph.runtime.arrays import F64
from placegraph.runtime.errors import SchemaError
from placegraph.runtime.scene_graph.json_types import Box, Numbers, Outline, Tag
from placegraph.runtime.scene_graph.node_ids import LAYERS, PARENT_LAYERS, NodeId, id_key
from placegraph.runtime.scene_graph.place_graph import (
    Approach,
    Connection,
    RouteSegment,
    check_approach,
    check_connection,
    check_route_segment,
    connection_key,
)
from placegraph.runtime.validation import first_error

VERSION = 2  # 2: connections, ways and approaches
OBJECT_FIELDS = ("observations", "oriented_box", "color", "approach", "front")  # only objects have them in JSON


@dataclass(frozen=True, kw_only=True, eq=False)
class GraphNode:
    """One building, floor, room, location or object. Box (2, 3) min/max and footprint (K, 2) in metres, world frame."""

    id: NodeId
    parent: str  # "" for the building
    tags: tuple[Tag, ...]  # strongest first
    box: Box
    footprint: Outline
    first_frame: int  # -1: not tied to frames
    last_frame: int
    observations: int = 0
    oriented_box: Numbers = ()  # objects: centre x y z, size x y z, yaw in rad about z
    color: tuple[int, ...] = ()  # objects: sRGB median
    approach: Approach | None = None  # objects: where to stand to face it; None when there is no such place
    front: Numbers = ()  # imported objects: direction (x, y) of their front; () when unknown

    @model_serializer(mode="wrap")
    def _write(self, write_fields: SerializerFunctionWrapHandler) -> dict[str, Any]:
        entry: dict[str, Any] = write_fields(self) | {"layer": self.layer}
        if self.layer != "object":
            return {name: value for name, value in entry.items() if name not in OBJECT_FIELDS}
        if not self.front:
            del entry["front"]
        return entry

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        json_schema = handler.resolve_ref_schema(handler(schema))
        json_schema["properties"]["layer"] = {"enum": list(PARENT_LAYERS), "description": "follows from the id"}
        return json_schema

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

    nodes: dict[str, GraphNode] = field(default_factory=dict)
    connections: dict[str, Connection] = field(default_factory=dict)
    route_segments: tuple[RouteSegment, ...] = ()

    @classmethod
    def of(
        cls,
        nodes: Iterable[GraphNode],
        connections: Iterable[Connection] = (),
        route_segments: Iterable[RouteSegment] = (),
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

    def with_nodes(self, nodes: Iterable[GraphNode]) -> SceneGraph:
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

    def _check_node(self, node: GraphNode) -> None:
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
    def building(self) -> GraphNode:
        """The root."""
        return next(node for node in self.nodes.values() if node.layer == "building")

    def layer(self, name: str) -> list[GraphNode]:
        """All nodes of a layer, by id number."""
        return [node for node in self.nodes.values() if node.layer == name]

    def children(self, node_id: str) -> list[GraphNode]:
        """Direct children, by layer and id number."""
        return [self.nodes[i] for i in self._children.get(node_id, ())]

    def descendants(self, node_id: str, layer: str) -> list[GraphNode]:
        """All nodes of `layer` below a node, by id number."""
        nodes, parent_ids = [], [node_id]
        for parent_id in parent_ids:  # grows during the loop
            children = self.children(parent_id)
            parent_ids += [child.id for child in children]
            nodes += [child for child in children if child.layer == layer]
        return sorted(nodes, key=lambda node: id_key(node.id))

    def path(self, node_id: str) -> list[GraphNode]:
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
        document = _GraphDocument.model_construct(
            version=VERSION,
            nodes=list(self.nodes.values()),
            connections=list(self.connections.values()),
            ways=list(self.route_segments),
        )
        return json.dumps(document.model_dump(), sort_keys=True, separators=(",", ":"), ensure_ascii=False)

    @classmethod
    def from_json(cls, text: str, where: str = "") -> SceneGraph:
        """Read and check; raises SchemaError naming `where`, the node and the field that is wrong."""
        prefix = f"{where}: " if where else ""
        try:
            document = _GraphDocument.model_validate_json(text)
            return cls.of(document.nodes, document.connections, document.ways)
        except ValidationError as error:
            raise SchemaError(f"{prefix}{first_error(error)}") from None
        except SchemaError as error:
            raise SchemaError(f"{prefix}{error}") from None

    @staticmethod
    def json_schema() -> dict[str, Any]:
        """The JSON Schema of the canonical JSON."""
        return _GraphDocument.model_json_schema()

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


def _check_version(version: Any) -> int:
    if version != VERSION:
        raise ValueError(f"expected graph version {VERSION}, found {version}")
    return VERSION


class _GraphDocument(BaseModel):
    """The scene graph as it stands in graph.json; metres and radians, world frame."""

    model_config = ConfigDict(title="SceneGraph")

    version: Annotated[int, PlainValidator(_check_version), WithJsonSchema({"const": VERSION})]
    nodes: list[GraphNode]
    connections: list[Connection]
    ways: list[RouteSegment]
