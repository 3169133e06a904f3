"""The scene graph as a value: its five layers, the place graph of rooms and doors, routes, object lists of others."""

from placegraph.runtime.scene_graph.graph import VERSION, Node, SceneGraph
from placegraph.runtime.scene_graph.json_types import Tag
from placegraph.runtime.scene_graph.node_ids import ID_PATTERN, LAYERS, PARENT_LAYERS, id_key

__all__ = ["ID_PATTERN", "LAYERS", "PARENT_LAYERS", "VERSION", "Node", "SceneGraph", "Tag", "id_key"]
