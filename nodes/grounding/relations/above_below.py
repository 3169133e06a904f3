"""Above and below an anchor: vertical order, with horizontal overlap or nearness.

Source: METHOD section 9. Departs: overlap of footprints or a small horizontal gap is required, with a margin in height.
"""

from __future__ import annotations

import numpy as np

from placegraph.nodes.grounding.relations import Case, Relation, Verdict, best_over_anchors, label, overlap_xy
from placegraph.runtime.scene_graph import Node

MARGIN_M = 0.05  # departs: height difference of centres below which nothing is above anything
MOST_GAP_M = 0.5  # departs: a picture hangs above the sofa it does not overlap
FALLOFF_M = 1.0  # departs: of two things above the table, the one closer over it is meant


def judge(case: Case) -> list[Verdict]:
    """One verdict a target."""
    sign = 1.0 if case.relation == "above" else -1.0

    def judge_pair(target: Node, anchors: tuple[Node, ...]) -> Verdict:
        anchor = anchors[0]
        rise = sign * float(target.center[2] - anchor.center[2])
        low, high = (anchor, target) if case.relation == "above" else (target, anchor)
        apart = float(high.box[0, 2] - low.box[1, 2])  # negative: the boxes overlap in height
        aside = np.maximum(np.maximum(target.box[0] - anchor.box[1], anchor.box[0] - target.box[1]), 0)[:2]
        gap, over = float(np.linalg.norm(aside)), overlap_xy(target.box, anchor.box)
        thinner = min(float(np.ptp(target.box[:, 2])), float(np.ptp(anchor.box[:, 2])))
        holds = rise > MARGIN_M and gap <= MOST_GAP_M and apart > -0.5 * thinner - MARGIN_M
        score = (0.6 + 0.4 * over) * float(np.exp(-max(apart, 0) / (2 * FALLOFF_M) - gap / FALLOFF_M))
        word = "higher" if sign * rise > 0 else "lower"
        text = f"{label(target)} is {abs(rise):.2f} m {word} than {label(anchor)} and {gap:.2f} m aside of it"
        return Verdict(score if holds else 0.0, holds, text, (anchor.id,))

    return best_over_anchors(case, judge_pair)


RELATION = Relation(
    phrases={
        "above": ("above", "over", "hanging over", "higher than", "on the wall above"),
        "below": ("below", "lower than"),
    },
    anchors={"above": (1, 1), "below": (1, 1)},
    judge=judge,
)
