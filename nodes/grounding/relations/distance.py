"""Near, closest and farthest, by the distance between box surfaces.

Source: paper, metric edges ("object A is in 3 meters of object B"). Departs: surfaces, not centres (METHOD section 9),
so that a chair beside a long table is beside it.
"""

from __future__ import annotations

import numpy as np

from placegraph.nodes.grounding.relations import Case, Relation, Verdict, best_over_anchors, label, ranked
from placegraph.runtime.geometry import box_distance_m
from placegraph.runtime.scene_graph import Node

NEAR_M = 1.5  # departs: farther than about two steps nothing is "near" in a home
FALLOFF_M = 1.0  # departs: of two near ones the nearer is meant
WALL_M = 3.0  # departs: added between rooms; what is behind a wall or a ceiling is not close for people
MARGIN_M = 0.05  # departs: distances that differ by less cannot be told apart by these boxes


def _apart_m(a: Node, b: Node, case: Case) -> float:
    """Distance in metres between the surfaces of two boxes, and the way around when they are in different rooms."""
    rooms = [case.room_boxes.get(node.id) for node in (a, b)]
    walled = rooms[0] is not None and rooms[1] is not None and rooms[0] is not rooms[1]
    return box_distance_m(a.box, b.box) + WALL_M * walled


def _judge_near(case: Case) -> list[Verdict]:
    def judge_pair(target: Node, anchors: tuple[Node, ...]) -> Verdict:
        gap = box_distance_m(target.box, anchors[0].box)
        text = f"{label(target)} is {gap:.2f} m from {label(anchors[0])}"
        return Verdict(float(np.exp(-gap / FALLOFF_M)), gap <= NEAR_M, text, (anchors[0].id,))

    return best_over_anchors(case, judge_pair)


def _nearest(target: Node, case: Case) -> tuple[float, str, tuple[str, ...]]:
    """Value in metres to the nearest anchor (the viewpoint without one), the words for it, and the anchor's id."""
    others = [anchors[0] for anchors in case.anchors if anchors and anchors[0].id != target.id]
    if not others:
        viewpoint = case.viewpoints[target.id]
        gap = box_distance_m(target.box, np.stack((viewpoint.xyz_world,) * 2))
        return gap, f"{label(target)} is {gap:.2f} m from the {viewpoint.source}", ()
    values = [_apart_m(target, other, case) for other in others]
    nearest = others[int(np.argmin(values))]
    gap = box_distance_m(target.box, nearest.box)
    walled = ", in another room" if min(values) > gap else ""
    return min(values), f"{label(target)} is {gap:.2f} m from {label(nearest)}{walled}", (nearest.id,)


def _judge_rank(case: Case) -> list[Verdict]:
    found = [_nearest(target, case) for target in case.targets]
    sign = -1.0 if case.relation == "closest" else 1.0
    words = [f"{text}, {case.relation} first" for _, text, _ in found]
    verdicts = ranked(case, [sign * value for value, _, _ in found], MARGIN_M, words)
    return [
        Verdict(verdict.score, verdict.holds, verdict.sentence, ids)
        for verdict, (_, _, ids) in zip(verdicts, found, strict=True)
    ]


def judge(case: Case) -> list[Verdict]:
    """One verdict a target."""
    return _judge_near(case) if case.relation == "near" else _judge_rank(case)


RELATION = Relation(
    phrases={
        "near": (
            "near",
            "near to",
            "next to",
            "beside",
            "by",
            "close to",
            "nearby",
            "adjacent to",
            "alongside",
            "around",
            "next",
            "at",
            "with",
            "along",
            "close by",
            "touching",
            "besides",
            "right next to",
            "right by",
        ),
        "closest": ("closest", "closest to", "nearest", "nearest to", "closest from", "nearest from"),
        "farthest": (
            "farthest",
            "furthest",
            "farthest from",
            "furthest from",
            "farthest away from",
            "furthest away from",
            "most distant from",
            "far from",
            "far away from",
            "away from",
        ),
    },
    anchors={"near": (1, 1), "closest": (0, 1), "farthest": (0, 1)},
    judge=judge,
)
