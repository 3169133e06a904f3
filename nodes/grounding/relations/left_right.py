"""Left and right of an anchor, as seen from the viewpoint; leftmost and rightmost.

Source: METHOD section 9 (l = normalise(z x f)). Departs: a margin, so that what is straight ahead is neither.
"""

from __future__ import annotations

import numpy as np

from placegraph.nodes.grounding.relations import (
    F64,
    UP,
    Case,
    Relation,
    Verdict,
    best_over_anchors,
    label,
    ranked,
)
from placegraph.runtime.geometry import box_distance_m
from placegraph.runtime.scene_graph import Node

MARGIN_M = 0.1  # departs: peers have no margin; about the error of a box centre from a depth camera
MARGIN_COSINE = 0.26  # departs: within 15 degrees of the line of sight nothing is left or right
FALLOFF_M = 3.0  # departs: "left of the sofa" means beside it, not anywhere in that half of the room


def left_axis(viewpoint_world: F64, toward_world: F64) -> F64 | None:
    """Horizontal unit vector (3,) to the left of the line of sight; None when the two are above one another."""
    forward = (toward_world - viewpoint_world) * (1, 1, 0)
    length = float(np.linalg.norm(forward))
    return None if length < 1e-3 else np.asarray(np.cross(UP, forward / length))


def _judge_side(case: Case) -> list[Verdict]:
    sign = 1.0 if case.relation == "left of" else -1.0

    def judge_pair(target: Node, anchors: tuple[Node, ...]) -> Verdict:
        anchor = anchors[0]
        viewpoint = case.viewpoints[anchor.id]
        left = left_axis(viewpoint.xyz_world, anchor.center)
        if left is None:
            text = f"{label(anchor)} is at the viewpoint ({viewpoint.source}), which has no left or right"
            return Verdict(0.0, False, text, (anchor.id,))
        offset = (target.center - anchor.center) * (1, 1, 0)
        aside = sign * float(offset @ left)
        share = aside / max(float(np.linalg.norm(offset)), 1e-9)
        holds = aside > MARGIN_M and share > MARGIN_COSINE
        gap = box_distance_m(target.box, anchor.box)
        score = share * float(np.exp(-gap / FALLOFF_M)) if holds else 0.0
        side = "left" if sign * aside > 0 else "right"
        text = f"{label(target)} is {abs(aside):.2f} m to the {side} of {label(anchor)}, seen from the "
        return Verdict(score, holds, text + viewpoint.source, (anchor.id,))

    return best_over_anchors(case, judge_pair)


def _judge_order(case: Case) -> list[Verdict]:
    middle = np.mean([target.center for target in case.targets], axis=0)
    viewpoint = case.viewpoints[case.targets[0].id]
    left = left_axis(viewpoint.xyz_world, middle)
    if left is None:  # the viewpoint is in their middle: look along +y, so that left is -x as on a map
        left = np.array([-1.0, 0.0, 0.0])
    sign, side = (1.0, "left") if case.relation == "leftmost" else (-1.0, "right")
    values = [sign * float((target.center - middle) @ left) for target in case.targets]
    words = [
        f"{label(target)} is {value:+.2f} m toward the {side} of their middle, seen from the {viewpoint.source}"
        for target, value in zip(case.targets, values, strict=True)
    ]
    return ranked(case, values, MARGIN_M, words)


def judge(case: Case) -> list[Verdict]:
    """One verdict a target."""
    return _judge_order(case) if case.relation in ("leftmost", "rightmost") else _judge_side(case)


RELATION = Relation(
    phrases={
        "left of": (
            "left of",
            "to the left of",
            "on the left of",
            "on the left side of",
            "left side of",
            "to the left side of",
            "at the left of",
            "on the left hand side of",
            "left from",
        ),
        "right of": (
            "right of",
            "to the right of",
            "on the right of",
            "on the right side of",
            "right side of",
            "to the right side of",
            "at the right of",
            "on the right hand side of",
            "right from",
        ),
        "leftmost": (
            "leftmost",
            "left-most",
            "furthest left",
            "farthest left",
            "on the left",
            "from the left",
            "on the far left",
            "on the left side",
            "from left",
            "to the left",
        ),
        "rightmost": (
            "rightmost",
            "right-most",
            "furthest right",
            "farthest right",
            "on the right",
            "from the right",
            "on the far right",
            "on the right side",
            "from right",
            "to the right",
        ),
    },
    anchors={"left of": (1, 1), "right of": (1, 1), "leftmost": (0, 0), "rightmost": (0, 0)},
    judge=judge,
)
