"""On, under, above and in, and their inverses holds and with, from the footprints, tops and bottoms of boxes.

Fits are graded, because a depth camera never measures exact contact.
"""

from __future__ import annotations

import numpy as np

from placegraph.nodes.grounding.box_arrays import Boxes, RoomPart
from placegraph.nodes.grounding.relations import (
    PairFits,
    Relation,
    RelationQuery,
    axis_gaps_m,
    decay,
    distance_m,
    footprint_overlap,
    horizontal_distance_m,
)
from placegraph.runtime.arrays import F64

CONTACT_M = 0.15  # departs: gap between what lies and what carries it, at which it is half likely to lie on it
STANDS_SHARE = 0.5  # departs: what stands in the upper half of a box stands on it: a bed's box includes its headboard
HANGS_M, HANGS_SHARE = 0.1, 0.7  # departs: what touches an upright thing, off its bottom, hangs on it ("on the wall")
WITHIN_SHARE, ON_SHARE = 0.8, 0.9  # departs: how well what is inside is "on", and what is on top is "in"
FLOOR_M = 0.1  # departs: the floor of a room's box is as low as the lowest thing in it
CORNER_M = 0.8  # departs: "in the corner": a corner or middle of a room is no box that holds things
OFF_GROUND_M = 0.3
WALL_M = 0.4  # departs: room boxes end inside the wall or beyond it
ASIDE_M = 0.3  # departs: a picture hangs above the sofa that it does not overlap; half as likely at this distance
RISE_M = 3.0  # departs: of two things above the table, the closer one is meant, a little
MIX_M = 0.1  # departs: heights that differ by less are level
INSIDE_SHARE = 0.7  # departs: share of the target's volume within the anchor's box from which on it is inside
TUCKED, TUCKED_M = 0.6, 0.2  # departs: how well that is "under", and the gap that halves it
OPEN_BELOW = ("table", "desk", "chair", "bed", "bench", "stool", "sofa", "couch", "armchair", "piano", "sink")
RAISED = 0.3  # departs: what is within the box of these is in or on them only when it is off the floor by this share
GROWN_M = 0.05  # departs: the anchor's box is grown by this, for what was measured of its walls
PART_M, BESIDE_M = 0.1, 0.75  # departs: "with" also means a part that touches, and what stands right beside


def on_fit(targets: Boxes, anchors: Boxes, gaps: F64) -> F64:
    """(n, m) fit: the target rests on the anchor or hangs on it."""
    over = footprint_overlap(targets, anchors, gaps)
    gap = targets.low[:, None, 2] - anchors.high[None, :, 2]
    height = anchors.size[None, :, 2]
    raised = (targets.low[:, None, 2] - anchors.low[None, :, 2]) / (STANDS_SHARE * height)
    # a bottom below the anchor's top: for thin anchors this is noise, for thick ones its height within them counts
    sunk = np.maximum(np.clip(raised, 0, 1), decay(-gap, CONTACT_M))
    above_middle = targets.center[:, None, 2] > anchors.center[None, :, 2]
    rests = np.clip(over * 1.25, 0, 1) * np.where(gap > 0, decay(gap, CONTACT_M), sunk * above_middle)
    off = (targets.low[:, None, 2] - anchors.low[None, :, 2]) > OFF_GROUND_M
    upright = anchors.size[None, :, 2] > targets.size[:, None, 2]
    hangs = HANGS_SHARE * decay(distance_m(gaps), HANGS_M) * off * upright
    return np.maximum(rests, hangs)


def under_fit(targets: Boxes, anchors: Boxes, gaps: F64) -> F64:
    """(n, m) fit: the target is lower than the anchor and below it or nearly below it."""
    over = footprint_overlap(targets, anchors, gaps, smaller=True)
    rise = anchors.center[None, :, 2] - targets.center[:, None, 2]
    apart = anchors.low[None, :, 2] - targets.high[:, None, 2]  # negative: they overlap in height
    lower = np.clip(0.5 + rise / (2 * MIX_M), 0, 1)
    # without overlapping footprints it must be entirely lower: what stands beside a table is not under it
    aside = 0.8 * decay(horizontal_distance_m(gaps), ASIDE_M) * np.clip(0.5 + (apart + MIX_M) / (2 * MIX_M), 0, 1)
    below = lower * np.maximum(np.clip(over * 1.25, 0, 1), aside) * decay(apart, RISE_M)
    # a chair tucked under a desk is mostly before it, and its back rises above the desk's middle
    legs = np.array([label.head_noun in ("desk", "table") for label in anchors.labels], bool)[None]
    stands = (targets.low[:, None, 2] - anchors.low[None, :, 2]) < OFF_GROUND_M
    lowered = targets.center[:, None, 2] < anchors.high[None, :, 2]
    return np.maximum(below, TUCKED * legs * stands * lowered * decay(horizontal_distance_m(gaps), TUCKED_M))


def in_fit(targets: Boxes, anchors: Boxes, gaps: F64) -> F64:
    """(n, m) fit: most of the target's volume is within the anchor; for a room: the target belongs to it."""
    half = targets.size / 2
    low = np.maximum((targets.center - half)[:, None], anchors.low[None] - GROWN_M)
    high = np.minimum((targets.center + half)[:, None], anchors.high[None] + GROWN_M)
    share = np.prod(np.clip(high - low, 0, None), axis=2) / np.prod(2 * half, axis=1)[:, None]
    fit = np.clip(share * 0.5 / INSIDE_SHARE, 0, 1)
    legs = np.array([label.head_noun in OPEN_BELOW for label in anchors.labels], bool)[None]
    raised = np.clip((targets.low[:, None, 2] - anchors.low[None, :, 2]) / (RAISED * anchors.size[None, :, 2]), 0, 1)
    share = np.where(legs, share * raised, share)
    fit = np.where(legs, fit * raised, fit)
    rooms = np.array([label.layer == "room" for label in anchors.labels], bool)
    same = targets.room[:, None] == anchors.room[None]
    return np.where(rooms[None] & (anchors.room >= 0)[None], same.astype(float), np.where(share > 0.95, 1.0, fit))


def evaluate(query: RelationQuery) -> PairFits:
    """All pairs. "In" also holds for what lies on top (books in a shelf, a cup in the sink)."""
    targets, anchors = query.targets, query.anchors
    assert anchors is not None
    gaps = axis_gaps_m(targets, anchors)
    name = query.relation
    if name == "on":
        # a cup within the box of a shelf, rack or counter with a back wall is "on" it, too
        values = np.maximum(on_fit(targets, anchors, gaps), WITHIN_SHARE * in_fit(targets, anchors, gaps))
        values = _with_room_parts(targets, anchors, gaps, values)
    elif name == "in":
        values = np.maximum(in_fit(targets, anchors, gaps), ON_SHARE * on_fit(targets, anchors, gaps))
        values = _with_room_parts(targets, anchors, gaps, values)
    elif name == "under":
        values = under_fit(targets, anchors, gaps)
    elif name == "above":
        values = under_fit(anchors, targets, gaps.swapaxes(0, 1)).T
    else:
        values = _holds(targets, anchors, gaps)
        if name == "with":
            gap = distance_m(gaps)
            values = np.maximum(values, np.maximum(0.9 * decay(gap, PART_M), 0.7 * decay(gap, BESIDE_M)))
    return PairFits(values, lambda i, j: _sentence(query, i, j))


def _with_room_parts(targets: Boxes, anchors: Boxes, gaps: F64, values: F64) -> F64:
    """The fits (n, m) of "on" and "in", replaced where the anchor is a wall, floor or corner of a room."""
    is_wall = anchors.is_part(RoomPart.WALL, RoomPart.ROOM)
    is_floor = anchors.is_part(RoomPart.FLOOR, RoomPart.CEILING)
    is_spot = anchors.is_part(RoomPart.CORNER, RoomPart.CENTER)
    aside_m = horizontal_distance_m(gaps)
    off = targets.low[:, None, 2] - anchors.low[None, :, 2] > OFF_GROUND_M
    above = targets.low[:, None, 2] - anchors.high[None, :, 2] - FLOOR_M
    values = np.where(is_wall[None], HANGS_SHARE * decay(aside_m, WALL_M) * off, values)
    values = np.where(is_floor[None], decay(above, CONTACT_M) * (aside_m <= 0), values)
    return np.where(is_spot[None], decay(aside_m, CORNER_M), values)


def _holds(targets: Boxes, anchors: Boxes, gaps: F64) -> F64:
    turned = gaps.swapaxes(0, 1)
    return np.maximum(on_fit(anchors, targets, turned), in_fit(anchors, targets, turned)).T


def _sentence(query: RelationQuery, i: int, j: int) -> str:
    assert query.anchors is not None
    subject, support = query.targets.take([i]), query.anchors.take([j])
    name = query.relation
    if name in ("holds", "with"):
        subject, support = support, subject
    gaps = axis_gaps_m(subject, support)
    over = float(footprint_overlap(subject, support, gaps, smaller=name in ("under", "above"))[0, 0])
    a, b = subject.labels[0], support.labels[0]
    if name in ("under", "above"):
        rise = float(subject.center[0, 2] - support.center[0, 2])
        word = "higher" if rise > 0 else "lower"
        aside = float(horizontal_distance_m(gaps)[0, 0])
        beside = f"{over:.0%} of it {'over' if rise > 0 else 'under'} it" if over else f"{aside:.2f} m aside"
        return f"{a} is {abs(rise):.2f} m {word} than {b}, {beside}"
    inside = float(in_fit(subject, support, gaps)[0, 0])
    if name == "in" and inside >= 0.5:
        return f"{a} is within {b}"
    gap = float(subject.low[0, 2] - support.high[0, 2])
    if name == "with" and over < 0.1:
        return f"{a} is {float(distance_m(gaps)[0, 0]):.2f} m from {b}"
    level = f"{abs(gap):.2f} m {'above' if gap > 0 else 'below'}" if abs(gap) >= 0.005 else "level with"
    return f"the bottom of {a} is {level} the top of {b}, {over:.0%} of it over it"


RELATION = Relation(
    phrases={
        "on": (
            "on", "on top of", "atop", "upon", "onto", "standing on", "lying on", "sitting on", "resting on",
            "placed on", "on the top of", "supported by", "hanging on", "hung on", "mounted on",
        ),
        "under": ("under", "underneath", "beneath", "below", "lower than", "supporting", "tucked under"),
        "above": ("above", "over", "hanging over", "higher than", "on the wall above", "hanging above"),
        "in": ("in", "inside", "inside of", "within", "contained in", "into"),
        "holds": ("holding", "containing", "contains", "carrying"),
        "with": ("with", "that has", "which has", "that have"),
    },
    evaluate=evaluate,
)  # fmt: skip
