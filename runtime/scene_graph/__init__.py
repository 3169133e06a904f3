"""The scene graph as a value: its five layers, the place graph of rooms and doors, routes, object lists of others."""

from placegraph.runtime.scene_graph.graph import (
    ID_PATTERN,
    LAYERS,
    PARENT_LAYERS,
    VERSION,
    Node,
    SceneGraph,
    Tag,
    id_key,
)

__all__ = ["ID_PATTERN", "LAYERS", "PARENT_LAYERS", "VERSION", "Node", "SceneGraph", "Tag", "id_key"]
