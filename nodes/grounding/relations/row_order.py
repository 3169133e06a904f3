"""The order of things in a row as seen by a viewer: leftmost, rightmost, frontmost, backmost, the middle, the n-th.

Things are ordered by their bearing from the viewer, or across the line of sight when the viewer faces a wall.
"""

from __future__ import annotations

import numpy as np

from placegraph.nodes.grounding.relations import PairFits, Relation, RelationQuery, axis_gaps_m, distance_m
from placegraph.nodes.grounding.viewpoint import ROOM_CENTER, Viewpoint, ViewpointKind, ViewpointSource
from placegraph.nodes.grounding.word_lists import word_list
from placegraph.runtime.arrays import F64

DOOR_NAMES = word_list("doors")


def _lateral_order(query: RelationQuery, viewpoint: Viewpoint) -> F64:
    """(n,) position of each target to the left of the line of sight, m."""
    assert viewpoint.forward is not None
    offset = query.targets.center[:, :2] - viewpoint.eye
    ahead, left = offset @ viewpoint.forward, offset @ np.array([-viewpoint.forward[1], viewpoint.forward[0]])
    # before a wall or a row the order is that across the line of sight, from a point it is that of the bearings
    if not len(left) or viewpoint.source.kind is ViewpointKind.BEFORE or not (ahead > 0.3).all():
        return np.asarray(left)
    return np.asarray(np.arctan2(left, ahead) * float(np.linalg.norm(offset, axis=1).mean()))


def _viewpoint_at_door(query: RelationQuery) -> Viewpoint | None:
    """The view into the room from its only door: "the back of the room" without a viewpoint is meant from there."""
    doors = [i for i, label in enumerate(query.layout.all.labels) if label.name in DOOR_NAMES]
    rooms = set(query.targets.room.tolist())
    doors = [i for i in doors if int(query.layout.all.room[i]) in rooms]
    if len(doors) != 1 or len(rooms) != 1:
        return None
    door = query.layout.all.take(doors)
    forward = -query.viewpoints.facing_direction(door, 0)
    return (
        Viewpoint(
            ViewpointSource(ViewpointKind.AT, door.labels),
            door.center[0, :2],
            forward,
            query.settings.viewpoint.unstated_trust,
        )
        if forward.any()
        else None
    )


def evaluate(query: RelationQuery) -> PairFits:
    """One value per target, greatest first; for `middle` and `nth` the position along the row from the left."""
    targets, margin_m = query.targets, query.settings.directions.margin_m
    if query.relation == "nth" and bool(targets.is_place.all()):  # the second bedroom: in the order of their ids
        values = -np.arange(len(targets), dtype=float)
        return PairFits(values[:, None], lambda i, _: f"{targets.labels[i]} by its id", 0.0)
    if query.relation == "nth" and query.viewpoints.explicit is None and query.reference is not None:
        gap = distance_m(axis_gaps_m(targets, query.reference)).min(axis=1)
        return PairFits(
            -gap[:, None],
            lambda i, _: f"{targets.labels[i]} is {gap[i]:.2f} m from there",
            margin_m,
        )
    viewpoint = query.viewpoints.overlooking(targets, query.reference)
    if (
        query.relation == "nth"
        and query.viewpoints.requested is not None
        and query.viewpoints.requested.forward is None
    ):
        # "the first bed as you come in": from a place, the nearest comes first
        away = np.linalg.norm(targets.center[:, :2] - viewpoint.eye, axis=1)
        words = f"m from the {viewpoint.source}"
        return PairFits(
            -away[:, None],
            lambda i, _: f"{targets.labels[i]} is {away[i]:.2f} {words}",
            margin_m,
        )
    if query.relation in ("frontmost", "backmost"):
        if viewpoint.source is ROOM_CENTER:
            viewpoint = _viewpoint_at_door(query) or viewpoint
        assert viewpoint.forward is not None
        ahead = (targets.center[:, :2] - viewpoint.eye) @ viewpoint.forward
        sign = 1.0 if query.relation == "backmost" else -1.0
        words, values = "m along the line of sight", sign * ahead
    else:
        left = _lateral_order(query, viewpoint)
        if query.relation == "middle":
            left = _along_row(query, left)
        ahead = left - left.mean() if len(left) else left
        values = -left if query.relation == "rightmost" else left
        words = "m to the left of their middle"
    sentence = f"{words}, seen from the {viewpoint.source}"
    return PairFits(
        values[:, None], lambda i, _: f"{targets.labels[i]} is {ahead[i]:+.2f} {sentence}", margin_m, viewpoint.trust
    )


def _along_row(query: RelationQuery, left: F64) -> F64:
    """The order along the row's own direction when three or more things have no explicit viewpoint."""
    if len(left) < 3 or query.viewpoints.explicit is not None:
        return left
    flat = query.targets.center - query.targets.center.mean(axis=0)
    axis = int(np.argmax(np.ptp(flat, axis=0)))
    return np.asarray(flat[:, axis])


RELATION = Relation(
    phrases={
        "leftmost": (
            "leftmost", "left-most", "furthest left", "farthest left", "on the left", "from the left",
            "on the far left", "on the left side", "from left", "to the left",
        ),
        "rightmost": (
            "rightmost", "right-most", "furthest right", "farthest right", "on the right", "from the right",
            "on the far right", "on the right side", "from right", "to the right",
        ),
        "frontmost": ("frontmost", "foremost", "in the front", "at the front"),
        "backmost": ("backmost", "rearmost", "in the back", "at the back", "at the very back"),
        "middle": (),
        "nth": (),
    },
    evaluate=evaluate,
)  # fmt: skip
