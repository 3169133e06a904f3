"""Hierarchy: each Map to a scene graph of floors, rooms, locations and objects."""

from __future__ import annotations

from collections.abc import Sequence

from placegraph.models_onnx import LocationDetector
from placegraph.models_onnx.load import load_for_node
from placegraph.nodes.hierarchy.floors import FloorConfig
from placegraph.nodes.hierarchy.graph_builder import GraphBuilder, LayerConfig
from placegraph.nodes.hierarchy.locations import LocationConfig
from placegraph.nodes.hierarchy.rooms import RoomConfig
from placegraph.nodes.hierarchy.traversability import TraversabilityConfig
from placegraph.runtime.messages import Graph, Map, Message
from placegraph.runtime.node import Context, Node, NodeConfig


class HierarchyConfig(NodeConfig):
    """Settings of the layers."""

    floors: FloorConfig = FloorConfig()
    rooms: RoomConfig = RoomConfig()
    locations: LocationConfig = LocationConfig()
    traversability: TraversabilityConfig = TraversabilityConfig()


class HierarchyNode(Node):
    """Maps to Graphs; rooms and locations are named by the next node, naming."""

    config_type = HierarchyConfig
    inputs = (Map,)
    outputs = (Graph,)
    config: HierarchyConfig

    def __init__(self, config: HierarchyConfig, context: Context) -> None:
        super().__init__(config, context)
        layers = LayerConfig(**{name: getattr(config, name) for name in LayerConfig.model_fields})
        self._layers, self._builder = layers, GraphBuilder(layers)

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
        """The Graph of a Map, with the Map's frame and revision."""
        assert isinstance(message, Map)
        graph = Graph(
            frame_id=message.frame_id,
            stamp_ns=message.stamp_ns,
            revision=message.revision,
            final=message.final,
            json=self._builder.build(message).to_json(),
        )
        return [graph]


NODE = HierarchyNode
