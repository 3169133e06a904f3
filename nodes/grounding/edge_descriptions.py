"""Edges between targets and anchors in words, for the deductive mode: distance, and the relations that hold.

Source: paper, "Selecting Related Objects" (metric and semantic edges). Not as in the paper: edges come from the same
relations that programs use, so what is neither left nor right of an anchor gets neither edge.
"""

from __future__ import annotations

from collections.abc import Sequence

from placegraph.nodes.grounding.program_executor import ProgramExecutor
from placegraph.nodes.grounding.relations import HOLDS, RelationQuery, relations_by_name
from placegraph.runtime.language.prompts import safe_name
from placegraph.runtime.scene_graph import GraphNode
from placegraph.runtime.vision.geometry import box_distance_m

# The paper has left, right, front, back, above and below; "on", "in" and "under" are added because people use them.
SEMANTIC = ("left", "right", "front", "behind", "above", "under", "on", "in")
OPPOSITE = {"left": "right", "right": "left", "front": "behind", "behind": "front"}
MARGIN = 0.1  # by which a relation must fit better than its opposite; both may hold by nearness. Chosen by hand
WORDS = {"left": "left of", "right": "right of", "front": "in front of"}  # as they read before a noun


def edges(executor: ProgramExecutor, target: GraphNode, anchors: Sequence[GraphNode], max_count: int) -> list[str]:
    """Texts like `0.40 m from bed O7, left of bed O7`, one for each of the target's max_count nearest anchors."""
    anchors_left = [anchor for anchor in anchors if anchor.id != target.id]
    gaps = [box_distance_m(target.box, anchor.box) for anchor in anchors_left]
    nearest = sorted(range(len(anchors_left)), key=lambda i: (gaps[i], i))[:max_count]
    return [_edge(executor, target, anchors_left[i], gaps[i]) for i in nearest]


def _edge(executor: ProgramExecutor, target: GraphNode, anchor: GraphNode, gap_m: float) -> str:
    graph = executor.graph
    apart = ", in another room" if graph.room_of(target.id) != graph.room_of(anchor.id) else ""
    name = f"{safe_name(anchor.name, anchor.layer)} {anchor.id}"
    fits = {relation: _fit(executor, relation, target, anchor) for relation in SEMANTIC}
    holding = [
        relation
        for relation in SEMANTIC
        if fits[relation] >= HOLDS and fits[relation] > fits.get(OPPOSITE.get(relation, ""), 0.0) + MARGIN
    ]
    # "in" also holds for what lies on something; then "on" alone is said
    words = [WORDS.get(relation, relation) for relation in holding if relation != "in" or "on" not in holding]
    return ", ".join([f"{gap_m:.2f} m from {name}{apart}", *(f"{word} {name}" for word in words)])


def _fit(executor: ProgramExecutor, relation: str, target: GraphNode, anchor: GraphNode) -> float:
    layout = executor.layout
    target_box, anchor_box = (layout.all.take([layout.row[node.id]]) for node in (target, anchor))
    fits = relations_by_name()[relation].evaluate(
        RelationQuery(relation, target_box, anchor_box, layout, executor.viewpoints)
    )
    return float(fits.values[0, 0])
