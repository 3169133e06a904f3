"""Edges between the targets and the anchors of one request, in words: how far apart they are, and how they lie.

Source: paper, "Selecting Related Objects" (metric and semantic edges); METHOD section 9. Departs: computed by the
relations that the programs use, with their margins: what is neither left nor right gets no such edge.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from placegraph.nodes.grounding.relations import F64, Case, Viewpoint, families
from placegraph.nodes.grounding.textualise import plain
from placegraph.runtime.geometry import box_distance_m
from placegraph.runtime.scene_graph import Node, SceneGraph

# paper: left, right, front, back, above, below. Departs: also on, in and under, which people say of what they see.
SEMANTIC = ("left", "right", "front", "behind", "above", "under", "on", "in")
WORDS = {"left": "left of", "right": "right of", "front": "in front of"}  # as they read before a noun


def viewpoint_of(graph: SceneGraph, node: Node, asker_world: F64) -> Viewpoint:
    """From where a node is seen: the asker's place (3,), else (NaN) the centre of its room, of the building."""
    if np.isfinite(asker_world).all():
        return Viewpoint("asker", asker_world)
    return Viewpoint("room centre", graph.nodes[graph.room_of(node.id) or graph.building.id].center)


def edges(graph: SceneGraph, target: Node, anchors: Sequence[Node], asker_world: F64, most: int) -> list[str]:
    """The edges of a target, `0.40 m from bed O7, left of bed O7`: one text for each of its `most` nearest anchors."""
    others = [anchor for anchor in anchors if anchor.id != target.id]
    gaps = [box_distance_m(target.box, anchor.box) for anchor in others]
    nearest = sorted(range(len(others)), key=lambda i: (gaps[i], i))[:most]
    return [_edge(graph, target, others[i], gaps[i], asker_world) for i in nearest]


def _edge(graph: SceneGraph, target: Node, anchor: Node, gap_m: float, asker_world: F64) -> str:
    apart = ", in another room" if graph.room_of(target.id) != graph.room_of(anchor.id) else ""
    name = f"{plain(anchor.name, anchor.layer)} {anchor.id}"
    metric = f"{gap_m:.2f} m from {name}{apart}"
    how = [name for name in SEMANTIC if _holds(graph, name, target, anchor, asker_world)]
    words = [WORDS.get(one, one) for one in how if one != "in" or "on" not in how]  # "in" holds for what lies on, too
    return ", ".join([metric, *(f"{one} {name}" for one in words)])


def _holds(graph: SceneGraph, name: str, target: Node, anchor: Node, asker_world: F64) -> bool:
    relation = _relation(name)
    rooms = {node.id: graph.room_of(node.id) for node in (target, anchor)}
    case = Case(
        relation=relation,
        targets=[target],
        anchors=[(anchor,)],
        viewpoints={node.id: viewpoint_of(graph, node, asker_world) for node in (target, anchor)},
        room_boxes={node_id: graph.nodes[room].box for node_id, room in rooms.items() if room},
    )
    return families()[relation].judge(case)[0].holds


def _relation(name: str) -> str:
    """What the relations call a condition of schema.CONDITIONS."""
    today = {"left": "left of", "right": "right of", "front": "in front of", "in": "inside"}
    return name if name in families() else today[name]
