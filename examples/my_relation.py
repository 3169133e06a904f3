"""A relation of your own, complete: "the picture level with the lamp". Copy it to nodes/grounding/relations/.

It also needs its row in CONDITIONS of nodes/grounding/program.py:

    "level": ConditionForm("relation", (1, 1), "at the same height as it"),

Requests are then understood by rules. The language model needs examples of it first: see docs/design.md.
"""

from __future__ import annotations

import numpy as np

from placegraph.nodes.grounding.relations import PairFits, Relation, RelationQuery, decay

HALF_M = 0.2  # difference in height at which the fit is one half, from which on a relation holds


def evaluate(query: RelationQuery) -> PairFits:
    """The fit 0..1 of all n targets with all m anchors, (n, m), and a sentence with numbers for each pair."""
    targets, anchors = query.targets, query.anchors
    assert anchors is not None  # its row in CONDITIONS asks for exactly one thing
    offset_m = np.abs(targets.center[:, None, 2] - anchors.center[None, :, 2])

    def sentence(i: int, j: int) -> str:
        return f"the heights of {targets.labels[i]} and {anchors.labels[j]} differ by {offset_m[i, j]:.2f} m"

    return PairFits(decay(offset_m, HALF_M), sentence)


# each name of CONDITIONS that this module computes, with the phrases by which the rules know it
RELATION = Relation(phrases={"level": ("level with", "at the same height as", "as high as")}, evaluate=evaluate)
