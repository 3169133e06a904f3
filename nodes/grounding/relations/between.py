"""Between two anchors: the target's place along and beside the line that joins them.

Source: METHOD section 9. Departs: along the middle part of the line and not far beside it.
"""

from __future__ import annotations

import numpy as np

from placegraph.nodes.grounding.relations import Case, Relation, Verdict, best_over_anchors, label
from placegraph.runtime.scene_graph import Node

ALONG = (0.1, 0.9)  # departs: share of the way from one centre to the other
ASIDE_SHARE = 0.5  # departs: distance beside the line, as a share of its length
ASIDE_LEAST_M = 0.4  # departs: for anchors that stand close together


def judge(case: Case) -> list[Verdict]:
    """One verdict a target, over pairs of anchors."""

    def judge_pair(target: Node, anchors: tuple[Node, ...]) -> Verdict:
        a, b = anchors[0], anchors[1]
        line, offset = (b.center - a.center)[:2], (target.center - a.center)[:2]
        length = max(float(np.linalg.norm(line)), 1e-6)
        along = float(offset @ line) / length**2
        aside = float(np.linalg.norm(offset - along * line))
        widest = max(ASIDE_SHARE * length, ASIDE_LEAST_M)
        holds = ALONG[0] <= along <= ALONG[1] and aside <= widest
        score = float((1 - abs(2 * along - 1) / 2) * (1 - aside / widest / 2)) if holds else 0.0
        text = (
            f"{label(target)} is {along:.0%} of the way from {label(a)} to {label(b)}, {aside:.2f} m beside that line"
        )
        return Verdict(score, holds, text, (a.id, b.id))

    return best_over_anchors(case, judge_pair)


RELATION = Relation(
    phrases={"between": ("between", "in between", "in the middle of", "amid")},
    anchors={"between": (2, 2)},
    judge=judge,
)
