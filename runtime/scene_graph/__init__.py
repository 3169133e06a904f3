"""The scene graph as a value: its five layers, the place graph of rooms and doors, routes, object lists of others."""

from placegraph.runtime.scene_graph.graph import VERSION, GraphNode, SceneGraph
from placegraph.runtime.scene_graph.json_types import Tag
from placegraph.runtime.scene_graph.node_ids import ID_PATTERN, LAYERS, PARENT_LAYERS, id_key

__all__ = ["ID_PATTERN", "LAYERS", "PARENT_LAYERS", "VERSION", "GraphNode", "SceneGraph", "Tag", "id_key"]
