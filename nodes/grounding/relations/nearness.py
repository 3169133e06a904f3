"""Near and against, closest and farthest, alone: by the distance between box surfaces.

Source: paper, metric edges ("object A is in 3 meters of object B"). Departs: surfaces, not centres (METHOD section 9),
so that a chair beside a long table is beside it; of several near ones the nearest is meant most.
"""

from __future__ import annotations

import numpy as np

from placegraph.nodes.grounding.box_arrays import Boxes
from placegraph.nodes.grounding.relations import Case, Fits, Relation, apart_m, flat_m, gaps_m, halving
from placegraph.nodes.grounding.viewpoint import MIDDLE_TRUST
from placegraph.runtime.arrays import F64

NEAR_M = 1.5  # departs: farther than about two steps nothing is "near" in a home
AGAINST_M = 0.3  # departs: "touching" of boxes whose surfaces are some centimetres off
WALL_M = 0.4  # departs: furniture stands off a wall a little, and room boxes end inside the wall
THROUGH_WALL_M = 3.0  # departs: added between rooms; what is behind a wall or a ceiling is not close for people
MARGIN_M = 0.05  # departs: distances that differ by less cannot be told apart by these boxes
MIDDLES = 0.1  # departs: share of the distance of middles that tells apart what touches the same thing


def walled(targets: Boxes, anchors: Boxes) -> F64:
    """(n, m) 1 where two things are in different rooms; a place is in none."""
    a, b = targets.room[:, None], anchors.room[None]
    apart = (a != b) & (a >= 0) & (b >= 0) & ~targets.is_place[:, None] & ~anchors.is_place[None]
    return np.asarray(apart.astype(float))


def _to_viewer(case: Case) -> Fits:
    """Ranks without a thing: by the distance to who looks, else to what else was said, else to the room's middle."""
    sign = -1.0 if case.relation == "closest" else 1.0
    if case.views.named is None and case.hint is not None:
        hinted = _judge_rank(Case(case.relation, case.targets, case.hint, case.layout, case.views))
        return Fits(hinted.values[:, :1], hinted.sentence, MARGIN_M, MIDDLE_TRUST)
    view = case.views.over(case.targets)
    center = case.targets.center[:, :2]
    low, high = case.targets.low[:, :2], case.targets.high[:, :2]
    away = np.linalg.norm(np.maximum(np.maximum(low - view.eye, view.eye - high), 0), axis=1)
    away = away + MIDDLES * np.linalg.norm(center - view.eye, axis=1)
    return Fits(
        sign * away[:, None],
        lambda i, _: f"{case.targets.labels[i]} is {away[i]:.2f} m from the {view.source}",
        MARGIN_M,
        view.trust,
    )


def _judge_rank(case: Case) -> Fits:
    if case.anchors is None:
        return _to_viewer(case)
    anchors = case.anchors
    gap = apart_m(gaps_m(case.targets, anchors))
    through = walled(case.targets, anchors)
    middles = np.linalg.norm(case.targets.center[:, None] - anchors.center[None], axis=2)
    sign = -1.0 if case.relation == "closest" else 1.0

    def sentence(i: int, j: int) -> str:
        other = ", in another room" if through[i, j] else ""
        return f"{case.targets.labels[i]} is {gap[i, j]:.2f} m from {anchors.labels[j]}{other}"

    return Fits(sign * (gap + MIDDLES * middles + THROUGH_WALL_M * through), sentence, MARGIN_M)


def judge(case: Case) -> Fits:
    """All pairs."""
    if case.relation in ("closest", "farthest"):
        return _judge_rank(case)
    anchors = case.anchors
    assert anchors is not None
    gaps = gaps_m(case.targets, anchors)
    gap = apart_m(gaps)
    if case.relation == "near":
        values = halving(gap, NEAR_M)
    else:
        shells = np.array([not one for one in anchors.ids], bool)[None]  # the walls of a room's box
        values = np.where(shells, halving(flat_m(gaps), WALL_M), halving(gap, AGAINST_M))
    return Fits(values, lambda i, j: f"{case.targets.labels[i]} is {gap[i, j]:.2f} m from {anchors.labels[j]}")


RELATION = Relation(
    phrases={
        "near": (
            "near", "near to", "next to", "beside", "by", "close to", "nearby", "adjacent to", "alongside", "around",
            "next", "at", "close by", "besides", "right next to", "right by", "directly next to", "not far from",
        ),
        "against": ("against", "touching", "pushed up against", "up against"),
        "closest": (
            "closest", "closest to", "nearest", "nearest to", "closest from", "nearest from", "closer to", "nearer to",
            "closer", "nearer",
        ),
        "farthest": (
            "farthest", "furthest", "farthest from", "furthest from", "farthest away from", "furthest away from",
            "most distant from", "far from", "far away from", "away from", "farther from", "further from",
            "farther away from", "further away from",
        ),
    },
    judge=judge,
)  # fmt: skip
