"""The scene graph of a perfect map of a house: each item with its class, box, colour and parent."""

from __future__ import annotations

import numpy as np

from placegraph.runtime.arrays import F64
from placegraph.runtime.scene_graph import GraphNode, SceneGraph, Tag
from placegraph.tools.simulator.color_palette import COLORS, WOODS
from placegraph.tools.simulator.house_model import NOWHERE, House, PlacedItem


def ground_truth_graph(house: House) -> SceneGraph:
    """The graph of a furnished house. Objects are O<item id>, rooms R<room id>, locations L<id>, floors F<index>.

    The colour of an object is that of its colour word; items without one have none.
    """
    nodes = [_place("F", floor.index, "B0", f"floor {floor.index + 1}", floor.outline, floor.z_m, floor.height_m)
             for floor in house.floors]  # fmt: skip
    for room in house.rooms:
        floor = house.floors[room.floor]
        nodes.append(_place("R", room.id, f"F{room.floor}", room.type, room.polygon, floor.z_m, floor.height_m))
    for place in house.locations:
        boxes = np.array([house.items[item_id].box for item_id in place.members])
        low, high = boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)
        nodes.append(_node(f"L{place.id}", f"R{place.room}", place.kind, np.stack((low, high)), place.outline))
    nodes += [_object(placed) for placed in house.items]
    boxes = np.array([node.box for node in nodes])
    box = np.stack((boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)))
    return SceneGraph.of([_node("B0", "", "building", box, house.floors[0].outline), *nodes])


def _place(letter: str, number: int, parent: str, name: str, outline: F64, z_m: float, height_m: float) -> GraphNode:
    low, high = outline.min(axis=0), outline.max(axis=0)
    box = np.array([[*low, z_m], [*high, z_m + height_m]])
    return _node(f"{letter}{number}", parent, name, box, outline)


def _node(id: str, parent: str, name: str, box: F64, outline: F64) -> GraphNode:
    return GraphNode(
        id=id, parent=parent, tags=(Tag(name, 1.0),), box=box, footprint=outline, first_frame=-1, last_frame=-1
    )


def _object(placed: PlacedItem) -> GraphNode:
    item = placed.item
    center, size, yaw = placed.oriented_box
    return GraphNode(
        id=f"O{placed.id}",
        parent=f"R{placed.room}" if placed.location == NOWHERE else f"L{placed.location}",
        tags=(Tag(item.name, 1.0),),
        box=placed.box,
        footprint=placed.footprint,
        first_frame=-1,
        last_frame=-1,
        oriented_box=(*center.tolist(), *size.tolist(), yaw),
        color=(WOODS | COLORS).get(item.color_name, ()) if item.color_name else (),
    )
