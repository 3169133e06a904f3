"""Edges between the targets and the anchors of one request, in words: how far apart they are, and how they lie.

Source: paper, "Selecting Related Objects" (metric and semantic edges); METHOD section 9. Departs: computed by the
relations that the programs use: what is neither left nor right gets no such edge.
"""

from __future__ import annotations

from collections.abc import Sequence

from placegraph.nodes.grounding.program_executor import ProgramExecutor
from placegraph.nodes.grounding.relations import HOLDS, RelationQuery, relations_by_name
from placegraph.runtime.language.textualization import plain
from placegraph.runtime.scene_graph import Node
from placegraph.runtime.vision.geometry import box_distance_m

# paper: left, right, front, back, above, below. Departs: also on, in and under, which people say of what they see.
SEMANTIC = ("left", "right", "front", "behind", "above", "under", "on", "in")
OPPOSITE = {"left": "right", "right": "left", "front": "behind", "behind": "front"}
MARGIN = 0.1  # departs: how much better than its opposite; a relation may fall back on nearness, which both then hold
WORDS = {"left": "left of", "right": "right of", "front": "in front of"}  # as they read before a noun


def edges(executor: ProgramExecutor, target: Node, anchors: Sequence[Node], most: int) -> list[str]:
    """The edges of a target, `0.40 m from bed O7, left of bed O7`: one text for each of its `most` nearest anchors."""
    others = [anchor for anchor in anchors if anchor.id != target.id]
    gaps = [box_distance_m(target.box, anchor.box) for anchor in others]
    nearest = sorted(range(len(others)), key=lambda i: (gaps[i], i))[:most]
    return [_edge(executor, target, others[i], gaps[i]) for i in nearest]


def _edge(executor: ProgramExecutor, target: Node, anchor: Node, gap_m: float) -> str:
    graph = executor.graph
    apart = ", in another room" if graph.room_of(target.id) != graph.room_of(anchor.id) else ""
    name = f"{plain(anchor.name, anchor.layer)} {anchor.id}"
    fits = {relation: _fit(executor, relation, target, anchor) for relation in SEMANTIC}
    how = [one for one in SEMANTIC if fits[one] >= HOLDS and fits[one] > fits.get(OPPOSITE.get(one, ""), 0.0) + MARGIN]
    words = [WORDS.get(one, one) for one in how if one != "in" or "on" not in how]  # "in" holds for what lies on, too
    return ", ".join([f"{gap_m:.2f} m from {name}{apart}", *(f"{one} {name}" for one in words)])


def _fit(executor: ProgramExecutor, relation: str, target: Node, anchor: Node) -> float:
    layout = executor.layout
    one, other = (layout.all.take([layout.row[node.id]]) for node in (target, anchor))
    fits = relations_by_name()[relation].evaluate(RelationQuery(relation, one, other, layout, executor.viewpoints))
    return float(fits.values[0, 0])
