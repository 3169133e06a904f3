"""Near, against, closest and farthest, by the distance between box surfaces.

Source: paper, metric edges ("object A is in 3 meters of object B"). Not as in the paper: distances between surfaces,
not centres, so that a chair beside a long table is near it.
"""

from __future__ import annotations

import numpy as np

from placegraph.nodes.grounding.box_arrays import Boxes
from placegraph.nodes.grounding.relations import (
    PairFits,
    Relation,
    RelationQuery,
    axis_gaps_m,
    decay,
    distance_m,
    horizontal_distance_m,
)
from placegraph.runtime.arrays import F64


def in_different_rooms(targets: Boxes, anchors: Boxes) -> F64:
    """(n, m) 1.0 where two things are in different rooms, else 0.0; places are in no room."""
    a, b = targets.room[:, None], anchors.room[None]
    apart = (a != b) & (a >= 0) & (b >= 0) & ~targets.is_place[:, None] & ~anchors.is_place[None]
    return np.asarray(apart.astype(float))


def _rank_by_viewer_distance(query: RelationQuery) -> PairFits:
    """Ranks without an anchor: by the distance to the viewer, else to the reference, else to the room's centre."""
    settings = query.settings.nearness
    sign = -1.0 if query.relation == "closest" else 1.0
    if query.viewpoints.explicit is None and query.reference is not None:
        by_reference = _rank_by_anchor_distance(
            RelationQuery(query.relation, query.targets, query.reference, query.layout, query.viewpoints)
        )
        return PairFits(
            by_reference.values[:, :1],
            by_reference.sentence,
            settings.margin_m,
            query.settings.viewpoint.unstated_trust,
        )
    viewpoint = query.viewpoints.overlooking(query.targets)
    center = query.targets.center[:, :2]
    low, high = query.targets.low[:, :2], query.targets.high[:, :2]
    distance = np.linalg.norm(np.maximum(np.maximum(low - viewpoint.eye, viewpoint.eye - high), 0), axis=1)
    distance = distance + settings.center_share * np.linalg.norm(center - viewpoint.eye, axis=1)
    return PairFits(
        sign * distance[:, None],
        lambda i, _: f"{query.targets.labels[i]} is {distance[i]:.2f} m from the {viewpoint.source}",
        settings.margin_m,
        viewpoint.trust,
    )


def _rank_by_anchor_distance(query: RelationQuery) -> PairFits:
    if query.anchors is None:
        return _rank_by_viewer_distance(query)
    anchors, settings = query.anchors, query.settings.nearness
    gap = distance_m(axis_gaps_m(query.targets, anchors))
    through = in_different_rooms(query.targets, anchors)
    middles = np.linalg.norm(query.targets.center[:, None] - anchors.center[None], axis=2)
    sign = -1.0 if query.relation == "closest" else 1.0

    def sentence(i: int, j: int) -> str:
        other = ", in another room" if through[i, j] else ""
        return f"{query.targets.labels[i]} is {gap[i, j]:.2f} m from {anchors.labels[j]}{other}"

    return PairFits(
        sign * (gap + settings.center_share * middles + settings.through_wall_m * through), sentence, settings.margin_m
    )


def evaluate(query: RelationQuery) -> PairFits:
    """All pairs."""
    if query.relation in ("closest", "farthest"):
        return _rank_by_anchor_distance(query)
    anchors, settings = query.anchors, query.settings.nearness
    assert anchors is not None
    gaps = axis_gaps_m(query.targets, anchors)
    gap = distance_m(gaps)
    if query.relation == "near":
        values = decay(gap, settings.half_near_m)
    else:
        shells = anchors.is_part()[None]  # the walls of a room's box
        values = np.where(
            shells, decay(horizontal_distance_m(gaps), settings.half_wall_m), decay(gap, settings.half_against_m)
        )
    return PairFits(values, lambda i, j: f"{query.targets.labels[i]} is {gap[i, j]:.2f} m from {anchors.labels[j]}")


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
    evaluate=evaluate,
)  # fmt: skip
