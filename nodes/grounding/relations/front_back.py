"""In front of and behind an anchor, as seen from the viewpoint.

Source: METHOD section 9: (t - a) . f, with f from the viewpoint to the anchor. Departs: a margin, and nearness counts:
people say "in front of" for what is close by (of 2,206 human sentences, nearest fits best).
"""

from __future__ import annotations

import numpy as np

from placegraph.nodes.grounding.relations import Case, Relation, Verdict, Viewpoint, best_over_anchors, label
from placegraph.runtime.geometry import box_distance_m
from placegraph.runtime.scene_graph import Node

MARGIN_M = 0.1  # departs: as for left and right
MARGIN_COSINE = 0.26  # departs: within 15 degrees of sideways nothing is in front or behind
FALLOFF_M = 1.5  # departs: nearness matters more here than for left and right (METHOD section 9)
OPPOSITE_COSINE, OPPOSITE_M = 0.7, 0.8  # departs: within 45 degrees of straight across, and not close by
AMBIGUOUS_SCORE = 0.3  # departs: a close target on no clear side; below any target that is clearly on the side


def _opposite(target: Node, anchor: Node, viewpoint: Viewpoint) -> Verdict:
    """Across the viewpoint: straight over from the anchor, on the side that it is seen from, however far."""
    toward = (viewpoint.xyz_world - anchor.center)[:2]
    offset = (target.center - anchor.center)[:2]
    cosine = float(offset @ toward) / max(float(np.linalg.norm(offset) * np.linalg.norm(toward)), 1e-9)
    gap = box_distance_m(target.box, anchor.box)
    angle = float(np.degrees(np.arccos(np.clip(cosine, -1, 1))))
    text = f"{label(target)} is {angle:.0f} degrees off straight across from {label(anchor)}, {gap:.2f} m away"
    return Verdict(max(cosine, 0.0), cosine >= OPPOSITE_COSINE and gap >= OPPOSITE_M, text, (anchor.id,))


def judge(case: Case) -> list[Verdict]:
    """One verdict a target."""
    sign = 1.0 if case.relation == "behind" else -1.0

    def judge_pair(target: Node, anchors: tuple[Node, ...]) -> Verdict:
        anchor = anchors[0]
        viewpoint = case.viewpoints[anchor.id]
        forward = (anchor.center - viewpoint.xyz_world) * (1, 1, 0)
        offset = (target.center - anchor.center) * (1, 1, 0)
        gap = box_distance_m(target.box, anchor.box)
        nearness = float(np.exp(-gap / FALLOFF_M))
        length = float(np.linalg.norm(forward))
        along = float(offset @ forward) / length if length > 1e-3 else 0.0
        if case.relation == "opposite":
            return _opposite(target, anchor, viewpoint)
        share = sign * along / max(float(np.linalg.norm(offset)), 1e-9)
        holds = sign * along > MARGIN_M and share > MARGIN_COSINE
        score = (0.5 + 0.5 * share) * nearness if holds else AMBIGUOUS_SCORE * nearness * (share > -MARGIN_COSINE)
        side = "farther than" if along > 0 else "nearer than"
        text = f"{label(target)} is {abs(along):.2f} m {side} {label(anchor)} seen from the {viewpoint.source}"
        return Verdict(score, holds, f"{text} and {gap:.2f} m from it", (anchor.id,))

    return best_over_anchors(case, judge_pair)


RELATION = Relation(
    phrases={
        "in front of": ("in front of", "in the front of", "before"),
        "opposite": ("facing", "opposite", "opposite to", "across from", "opposite of", "across the room from"),
        "behind": ("behind", "in back of", "at the back of", "in the back of", "to the rear of"),
    },
    anchors={"in front of": (1, 1), "opposite": (1, 1), "behind": (1, 1)},
    judge=judge,
)
