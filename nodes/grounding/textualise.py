"""The small graph of a question as text for the language model.

Source: paper, "Object Grounding" (the textualised graph of targets and anchors with their edges).
"""

from __future__ import annotations

from collections.abc import Sequence

from placegraph.nodes.grounding.ranking import Candidate
from placegraph.runtime.scene_graph import SceneGraph


def small_graph(graph: SceneGraph, candidates: Sequence[Candidate]) -> str:
    """One line a candidate: id, name, its place, its other tags and the evidence found for it."""
    lines = []
    for candidate in candidates:
        node = candidate.node
        place = ", ".join(step.name for step in reversed(graph.path(node.id)[1:-1]))
        others = ", ".join(tag.name for tag in node.tags[1:4])
        line = f"{node.id}: {node.name}{f' (or {others})' if others else ''} in {place or 'the building'}"
        lines.append("; ".join([line, *candidate.evidence]))
    return "\n".join(lines)
