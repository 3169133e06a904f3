"""Hierarchy: each Map to a scene graph of floors, rooms, locations and objects, and names onto its places."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from placegraph.models_onnx import LocationDetector
from placegraph.models_onnx.load import load_for_node
from placegraph.nodes.hierarchy.floors import FloorConfig
from placegraph.nodes.hierarchy.graph_builder import GraphBuilder, LayerConfig
from placegraph.nodes.hierarchy.locations import LocationConfig
from placegraph.nodes.hierarchy.rooms import RoomConfig
from placegraph.nodes.hierarchy.traversability import TravelConfig
from placegraph.runtime.errors import SchemaError
from placegraph.runtime.messages import Graph, Map, Message, PlaceNames
from placegraph.runtime.node import Context, Node, NodeConfig
from placegraph.runtime.scene_graph import SceneGraph, Tag


class HierarchyConfig(NodeConfig):
    """Settings of the layers."""

    floors: FloorConfig = FloorConfig()
    rooms: RoomConfig = RoomConfig()
    locations: LocationConfig = LocationConfig()
    travel: TravelConfig = TravelConfig()


class HierarchyNode(Node):
    """Maps to Graphs without names; names of that very revision to the same Graph with names."""

    config_type = HierarchyConfig
    inputs = (Map, PlaceNames)
    outputs = (Graph,)
    feedback = (PlaceNames,)
    config: HierarchyConfig

    def __init__(self, config: HierarchyConfig, context: Context) -> None:
        super().__init__(config, context)
        layers = LayerConfig(**{name: getattr(config, name) for name in LayerConfig.model_fields})
        self._layers, self._builder = layers, GraphBuilder(layers)
        self._map: Map | None = None
        self._graph: SceneGraph | None = None  # of the newest Map, without names

    def start(self) -> None:
        """Load the network of locations, where one is named.

        Raises:
            ModelError: its weights are absent, damaged, or not of the family's layout.
            ConfigError: it does not find locations.
        """
        name = self.config.locations.model
        if name:
            self._builder = GraphBuilder(self._layers, load_for_node(LocationDetector, name, "hierarchy", self.context))

    def step(self, message: Message) -> Sequence[Message]:
        """Build or name a graph. Names of another revision are late and ignored. Raises SchemaError for unknown ids."""
        if isinstance(message, Map):
            # kept without names: those of an earlier revision would make the final graph depend on timing
            self._map, self._graph = message, self._builder.build(message)
            return [self._give(self._graph, named=False)]
        assert isinstance(message, PlaceNames)
        if self._map is None or self._graph is None or message.revision != self._map.revision:
            return []
        return [self._give(_name_places(self._graph, message), named=True)]

    def _give(self, graph: SceneGraph, named: bool) -> Graph:
        assert self._map is not None
        source = self._map
        return Graph(
            frame_id=source.frame_id,
            stamp_ns=source.stamp_ns,
            revision=source.revision,
            final=source.final,
            named=named,
            json=graph.to_json(),
        )


def _name_places(graph: SceneGraph, names: PlaceNames) -> SceneGraph:
    tags: dict[str, list[Tag]] = {}
    for node_id, name, weight in zip(names.ids, names.names, names.weights.tolist(), strict=True):
        if node_id not in graph.nodes or graph.nodes[node_id].layer not in ("room", "location"):
            raise SchemaError(f"PlaceNames of revision {names.revision}: {node_id!r} is no room or location of it")
        tags.setdefault(node_id, []).append(Tag(name, weight))
    ranked = {node_id: tuple(sorted(found, key=lambda tag: (-tag.weight, tag.name))) for node_id, found in tags.items()}
    return graph.with_nodes(
        dataclasses.replace(node, tags=ranked[node.id]) if node.id in ranked else node for node in graph.nodes.values()
    )


NODE = HierarchyNode
