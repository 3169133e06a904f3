"""Positions within a room or at a part of an anchor: in a corner, in the middle, at the end, along a wall, facing it.

The room's box stands for its walls, which is right for rectangular rooms only.
"""

from __future__ import annotations

import numpy as np

from placegraph.nodes.grounding.box_arrays import Boxes
from placegraph.nodes.grounding.relations import PairFits, Relation, RelationQuery, axis_gaps_m, decay, distance_m
from placegraph.runtime.arrays import F64


def _room_boxes(query: RelationQuery) -> tuple[F64, F64]:
    rooms = query.targets.room
    return query.layout.room_low[rooms], query.layout.room_high[rooms]


def _corner(query: RelationQuery) -> PairFits:
    low, high = query.targets.low[:, :2], query.targets.high[:, :2]
    if query.anchors is None:
        room_low, room_high = _room_boxes(query)
        gaps = np.minimum(np.abs(low - room_low[:, :2]), np.abs(room_high[:, :2] - high))
        away = np.linalg.norm(gaps, axis=1)[:, None]
        words = "the nearest corner of its room"
        return PairFits(
            decay(away, query.settings.room_position.half_corner_m),
            lambda i, _: _distance_sentence(query, i, away[i, 0], words),
        )
    a, b = query.anchors.low[None, :, :2], query.anchors.high[None, :, :2]
    gaps_low = np.maximum(np.maximum(low[:, None] - a, a - high[:, None]), 0)
    gaps_high = np.maximum(np.maximum(low[:, None] - b, b - high[:, None]), 0)
    away = np.linalg.norm(np.minimum(gaps_low, gaps_high), axis=2)
    labels = query.anchors.labels
    return PairFits(
        decay(away, query.settings.room_position.half_corner_m),
        lambda i, j: _distance_sentence(query, i, away[i, j], f"a corner of {labels[j]}"),
    )


def _distance_sentence(query: RelationQuery, i: int, away: float, what: str) -> str:
    return f"{query.targets.labels[i]} is {away:.2f} m from {what}"


def _center(query: RelationQuery) -> PairFits:
    center = query.targets.center[:, :2]
    if query.anchors is None:
        low, high = _room_boxes(query)
        middle, half = ((low + high) / 2)[:, None, :2], ((high - low) / 2)[:, None, :2]
        names = ["its room"]
    else:
        middle = query.anchors.center[None, :, :2]
        half = np.maximum(query.anchors.size[None, :, :2] / 2, 0.3)
        names = [str(label) for label in query.anchors.labels]
    aside = np.abs(center[:, None] - middle)
    share = np.linalg.norm(aside / np.maximum(half, 0.01), axis=2) / np.sqrt(2)
    away = np.linalg.norm(aside, axis=2)
    return PairFits(
        decay(share, query.settings.room_position.half_center_share),
        lambda i, j: _distance_sentence(query, i, away[i, j], f"the middle of {names[j]}"),
    )


def _end(query: RelationQuery) -> PairFits:
    """Near the middle of one of the anchor's two short sides."""
    anchors = query.anchors
    assert anchors is not None
    long = anchors.size[:, 0] >= anchors.size[:, 1]
    reach = np.where(long[:, None], [[1.0, 0.0]], [[0.0, 1.0]]) * anchors.size[:, :2] / 2
    ends = np.stack((anchors.center[:, :2] - reach, anchors.center[:, :2] + reach))
    low, high = query.targets.low[:, None, :2], query.targets.high[:, None, :2]
    away = np.min([np.linalg.norm(np.maximum(np.maximum(low - e, e - high), 0), axis=2) for e in ends], axis=0)
    return PairFits(
        decay(away, query.settings.room_position.half_end_m),
        lambda i, j: _distance_sentence(query, i, away[i, j], f"an end of {anchors.labels[j]}"),
    )


def _wall_gaps_m(boxes: Boxes, low: F64, high: F64) -> F64:
    """(N, 4) metres from each box to the walls of its room at low x, low y, high x and high y."""
    return np.concatenate((boxes.low[:, :2] - low[:, :2], high[:, :2] - boxes.high[:, :2]), axis=1)


def _along_wall(query: RelationQuery) -> PairFits:
    """Near the wall that the anchor stands at: the distance to it as a share of the room's width."""
    anchors = query.anchors
    assert anchors is not None
    room_low, room_high = query.layout.room_low[anchors.room], query.layout.room_high[anchors.room]
    side = np.argmin(_wall_gaps_m(anchors, room_low, room_high), axis=1)
    low, high = query.targets.low[:, None, :2], query.targets.high[:, None, :2]
    free = np.concatenate((low - room_low[None, :, :2], room_high[None, :, :2] - high), axis=2)
    gap = np.take_along_axis(free, side[None, :, None], axis=2)[..., 0]
    width = np.take_along_axis((room_high - room_low)[:, :2], (side % 2)[:, None], axis=1)[:, 0]
    share = np.clip(gap, 0, None) / np.maximum(width, 0.1)
    return PairFits(
        np.clip(1 - share, 0, 1) ** 1.5,
        lambda i, j: _distance_sentence(query, i, max(gap[i, j], 0), f"the wall that {anchors.labels[j]} stands at"),
    )


def _facing(query: RelationQuery) -> PairFits:
    """The target's front points towards the anchor; without a known front nearness decides a little."""
    anchors = query.anchors
    assert anchors is not None
    direction = (anchors.center[None] - query.targets.center[:, None])[..., :2]
    direction = direction / np.maximum(np.linalg.norm(direction, axis=2, keepdims=True), 1e-9)
    cosine = np.einsum("nk,nmk->nm", query.targets.front, direction)
    known = bool(np.isfinite(query.targets.front).all(axis=1).any())
    near = decay(distance_m(axis_gaps_m(query.targets, anchors)), 4.0)
    turned = np.clip(0.5 + (cosine - query.settings.room_position.facing_cosine), 0, 1) * (0.5 + 0.5 * near)
    values = np.where(np.isfinite(cosine), turned, 0.5 + 0.2 * near)  # not known: of several the nearest

    def sentence(i: int, j: int) -> str:
        a, b = query.targets.labels[i], anchors.labels[j]
        if not np.isfinite(cosine[i, j]):
            return f"the map does not hold where {a} faces"
        return f"{b} is {np.degrees(np.arccos(np.clip(cosine[i, j], -1, 1))):.0f} degrees off the front of {a}"

    return PairFits(values, sentence, known=known)


JUDGES = {"corner": _corner, "center": _center, "end": _end, "along": _along_wall, "facing": _facing}


def evaluate(query: RelationQuery) -> PairFits:
    """All pairs; one column without an anchor."""
    return JUDGES[query.relation](query)


RELATION = Relation(
    phrases={
        "corner": (
            "in the corner", "in a corner", "at the corner", "in the corner of the room", "in the corner of",
            "on the corner of", "at the corner of",
        ),
        "center": (
            "in the middle of the room", "in the center of the room", "in the centre of the room", "in the center",
            "in the centre", "in the middle", "in the middle of", "in the center of", "in the centre of",
        ),
        "end": ("at the end of", "at the foot of", "at the head of", "on the end of"),
        "along": (
            "along", "on the same wall as", "on the same side as", "on the same side of the room as",
            "on the side of the room with",
        ),
        "facing": ("turned towards", "turned to"),
    },
    evaluate=evaluate,
)  # fmt: skip
