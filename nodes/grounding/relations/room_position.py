"""Where in its room, or at what part of a thing, something is: in a corner, in the middle, at the end, along a wall.

Source: METHOD section 9. Departs: the room's box stands for its walls, which is right for rectangular rooms only.
"""

from __future__ import annotations

import numpy as np

from placegraph.nodes.grounding.box_arrays import Boxes
from placegraph.nodes.grounding.relations import Case, Fits, Relation, apart_m, gaps_m, halving
from placegraph.runtime.arrays import F64

CORNER_M = 0.8  # departs: from a corner, at which it is half in it
MIDDLE_SHARE = 0.35  # departs: distance from the middle as a share of the half size, at which it is half in the middle
END_M = 1.0  # departs: from the end of a thing
FACING_COSINE = 0.5  # departs: within 60 degrees of its front


def _room_boxes(case: Case) -> tuple[F64, F64]:
    rooms = case.targets.room
    return case.layout.room_low[rooms], case.layout.room_high[rooms]


def _corner(case: Case) -> Fits:
    low, high = case.targets.low[:, :2], case.targets.high[:, :2]
    if case.anchors is None:
        room_low, room_high = _room_boxes(case)
        gaps = np.minimum(np.abs(low - room_low[:, :2]), np.abs(room_high[:, :2] - high))
        away = np.linalg.norm(gaps, axis=1)[:, None]
        words = "the nearest corner of its room"
        return Fits(halving(away, CORNER_M), lambda i, _: _away(case, i, away[i, 0], words))
    a, b = case.anchors.low[None, :, :2], case.anchors.high[None, :, :2]
    gaps_low = np.maximum(np.maximum(low[:, None] - a, a - high[:, None]), 0)
    gaps_high = np.maximum(np.maximum(low[:, None] - b, b - high[:, None]), 0)
    away = np.linalg.norm(np.minimum(gaps_low, gaps_high), axis=2)
    labels = case.anchors.labels
    return Fits(halving(away, CORNER_M), lambda i, j: _away(case, i, away[i, j], f"a corner of {labels[j]}"))


def _away(case: Case, i: int, away: float, what: str) -> str:
    return f"{case.targets.labels[i]} is {away:.2f} m from {what}"


def _center(case: Case) -> Fits:
    center = case.targets.center[:, :2]
    if case.anchors is None:
        low, high = _room_boxes(case)
        middle, half = ((low + high) / 2)[:, None, :2], ((high - low) / 2)[:, None, :2]
        names = ["its room"]
    else:
        middle = case.anchors.center[None, :, :2]
        half = np.maximum(case.anchors.size[None, :, :2] / 2, 0.3)
        names = list(case.anchors.labels)
    aside = np.abs(center[:, None] - middle)
    share = np.linalg.norm(aside / np.maximum(half, 0.01), axis=2) / np.sqrt(2)
    away = np.linalg.norm(aside, axis=2)
    return Fits(halving(share, MIDDLE_SHARE), lambda i, j: _away(case, i, away[i, j], f"the middle of {names[j]}"))


def _end(case: Case) -> Fits:
    """Near the middle of one of the two short sides of the anchor."""
    anchors = case.anchors
    assert anchors is not None
    long = anchors.size[:, 0] >= anchors.size[:, 1]
    reach = np.where(long[:, None], [[1.0, 0.0]], [[0.0, 1.0]]) * anchors.size[:, :2] / 2
    ends = np.stack((anchors.center[:, :2] - reach, anchors.center[:, :2] + reach))
    low, high = case.targets.low[:, None, :2], case.targets.high[:, None, :2]
    away = np.min([np.linalg.norm(np.maximum(np.maximum(low - e, e - high), 0), axis=2) for e in ends], axis=0)
    return Fits(halving(away, END_M), lambda i, j: _away(case, i, away[i, j], f"an end of {anchors.labels[j]}"))


def _sides_of(boxes: Boxes, low: F64, high: F64) -> F64:
    """(N, 4) free metres to the walls at low x, low y, high x, high y of each one's room."""
    return np.concatenate((boxes.low[:, :2] - low[:, :2], high[:, :2] - boxes.high[:, :2]), axis=1)


def _along(case: Case) -> Fits:
    """How near to the wall that the anchor is nearest to, as a share of the room."""
    anchors = case.anchors
    assert anchors is not None
    room_low, room_high = case.layout.room_low[anchors.room], case.layout.room_high[anchors.room]
    side = np.argmin(_sides_of(anchors, room_low, room_high), axis=1)
    low, high = case.targets.low[:, None, :2], case.targets.high[:, None, :2]
    free = np.concatenate((low - room_low[None, :, :2], room_high[None, :, :2] - high), axis=2)
    gap = np.take_along_axis(free, side[None, :, None], axis=2)[..., 0]
    width = np.take_along_axis((room_high - room_low)[:, :2], (side % 2)[:, None], axis=1)[:, 0]
    share = np.clip(gap, 0, None) / np.maximum(width, 0.1)
    return Fits(
        np.clip(1 - share, 0, 1) ** 1.5,
        lambda i, j: _away(case, i, max(gap[i, j], 0), f"the wall that {anchors.labels[j]} stands at"),
    )


def _facing(case: Case) -> Fits:
    """Turned towards the anchor; of what has no known front nothing is said."""
    anchors = case.anchors
    assert anchors is not None
    way = (anchors.center[None] - case.targets.center[:, None])[..., :2]
    way = way / np.maximum(np.linalg.norm(way, axis=2, keepdims=True), 1e-9)
    cosine = np.einsum("nk,nmk->nm", case.targets.front, way)
    known = bool(np.isfinite(case.targets.front).all(axis=1).any())
    near = halving(apart_m(gaps_m(case.targets, anchors)), 4.0)
    turned = np.clip(0.5 + (cosine - FACING_COSINE), 0, 1) * (0.5 + 0.5 * near)
    values = np.where(np.isfinite(cosine), turned, 0.5 + 0.2 * near)  # not known: of several the nearest

    def sentence(i: int, j: int) -> str:
        a, b = case.targets.labels[i], anchors.labels[j]
        if not np.isfinite(cosine[i, j]):
            return f"the map does not hold where {a} faces"
        return f"{b} is {np.degrees(np.arccos(np.clip(cosine[i, j], -1, 1))):.0f} degrees off the front of {a}"

    return Fits(values, sentence, known=known)


JUDGES = {"corner": _corner, "center": _center, "end": _end, "along": _along, "facing": _facing}


def judge(case: Case) -> Fits:
    """All pairs; one column without an anchor."""
    return JUDGES[case.relation](case)


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
    judge=judge,
)  # fmt: skip
