"""On, under and inside, by contact and containment of boxes.

Source: METHOD section 9. Departs: margins for what a depth camera measures; 1 mm contact is never seen.
"""

from __future__ import annotations

import numpy as np

from placegraph.nodes.grounding.relations import Case, Relation, Verdict, best_over_anchors, label, overlap_xy
from placegraph.runtime.scene_graph import Node

CONTACT_M = 0.15  # departs: largest gap between the bottom of what lies and the top of what carries
SINK_SHARE = (
    0.6  # departs: a cushion sinks into a sofa whose box includes the back: bottom inside, top above the middle
)
LEAST_OVERLAP = 0.5  # departs: share of the smaller footprint over the other
INSIDE_SHARE = 0.7  # departs: share of the target's volume within the anchor's box
HANGS_M, HANGS_FIT = 0.5, 0.5  # departs: sideways gap to what hangs over something, and how well that is "under"
GROWN_M = 0.05  # departs: the anchor's box is grown by this, for what was measured of its walls


def _on(target: Node, anchor: Node) -> Verdict:
    gap = float(target.box[0, 2] - anchor.box[1, 2])
    over = overlap_xy(target.box, anchor.box)
    height = float(np.ptp(anchor.box[:, 2]))
    sunk = -SINK_SHARE * height <= gap < 0 and target.center[2] > anchor.center[2]
    smaller = np.prod(np.ptp(target.box, axis=0)[:2]) <= 1.5 * np.prod(np.ptp(anchor.box, axis=0)[:2])
    holds = bool((abs(gap) <= CONTACT_M or sunk) and over >= LEAST_OVERLAP and smaller)
    score = over * float(np.exp(-abs(gap) / (CONTACT_M if gap > 0 else 1.0)))
    height_words = f"{abs(gap):.2f} m {'above' if gap > 0 else 'below'}" if abs(gap) >= 0.005 else "level with"
    text = f"the bottom of {label(target)} is {height_words} the top of {label(anchor)}, {over:.0%} of it over it"
    return Verdict(score if holds else 0.0, holds, text, (anchor.id,))


def _under(target: Node, anchor: Node) -> Verdict:
    over = overlap_xy(target.box, anchor.box)
    rise = float(anchor.center[2] - target.center[2])
    lower = rise > 0 and target.box[0, 2] < anchor.box[1, 2] - 0.05 and target.box[1, 2] <= anchor.box[1, 2] + 0.05
    aside = np.maximum(np.maximum(target.box[0] - anchor.box[1], anchor.box[0] - target.box[1]), 0)[:2]
    # "under the picture" is said of the sofa before the wall: wholly lower, and close
    hangs_over = target.box[1, 2] <= anchor.box[0, 2] + 0.05 and float(np.linalg.norm(aside)) <= HANGS_M
    holds = bool((lower and over >= LEAST_OVERLAP) or hangs_over)
    text = f"{label(target)} is {rise:.2f} m lower than {label(anchor)}, {over:.0%} of it under it"
    fit = max(over, HANGS_FIT) * float(np.exp(-max(rise, 0) / 2))
    return Verdict(fit if holds else 0.0, holds, text, (anchor.id,))


def _inside(target: Node, anchor: Node) -> Verdict:
    # what is flatter than 1 cm counts as 1 cm, so that a sheet of paper has a volume
    middle, half = target.box.mean(axis=0), np.maximum(np.ptp(target.box, axis=0), 0.01) / 2
    low = np.maximum(middle - half, anchor.box[0] - GROWN_M)
    high = np.minimum(middle + half, anchor.box[1] + GROWN_M)
    share = float(np.prod(np.clip(high - low, 0, None) / (2 * half)))
    holds = share >= INSIDE_SHARE
    text = f"{share:.0%} of {label(target)} is within {label(anchor)}"
    return Verdict(share if holds else 0.0, holds, text, (anchor.id,))


def judge(case: Case) -> list[Verdict]:
    """One verdict a target. "In" also holds for what lies on top (books in a shelf, a cup in the sink)."""

    def judge_pair(target: Node, anchors: tuple[Node, ...]) -> Verdict:
        if case.relation == "on":
            return _on(target, anchors[0])
        if case.relation == "under":
            return _under(target, anchors[0])
        inside = _inside(target, anchors[0])
        return inside if inside.holds else _on(target, anchors[0])

    return best_over_anchors(case, judge_pair)


RELATION = Relation(
    phrases={
        "on": (
            "on",
            "on top of",
            "atop",
            "upon",
            "onto",
            "standing on",
            "lying on",
            "sitting on",
            "resting on",
            "placed on",
            "on the top of",
            "supported by",
        ),
        "under": ("under", "underneath", "beneath", "supporting", "holding"),
        "inside": ("in", "inside", "inside of", "within", "contained in", "into"),
    },
    anchors={"on": (1, 1), "under": (1, 1), "inside": (1, 1)},
    judge=judge,
)
