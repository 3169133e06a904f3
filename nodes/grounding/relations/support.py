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
from placegraph.nodes.grounding.settings import SupportSettings
from placegraph.nodes.grounding.word_lists import word_list
from placegraph.runtime.arrays import F64

OPEN_BELOW = word_list("open_below")


def on_fit(targets: Boxes, anchors: Boxes, gaps: F64, settings: SupportSettings) -> F64:
    """(n, m) fit: the target rests on the anchor or hangs on it."""
    over = footprint_overlap(targets, anchors, gaps)
    gap = targets.low[:, None, 2] - anchors.high[None, :, 2]
    height = anchors.size[None, :, 2]
    raised = (targets.low[:, None, 2] - anchors.low[None, :, 2]) / (settings.stands_share * height)
    # a bottom below the anchor's top: for thin anchors this is noise, for thick ones its height within them counts
    sunk = np.maximum(np.clip(raised, 0, 1), decay(-gap, settings.half_contact_m))
    above_middle = targets.center[:, None, 2] > anchors.center[None, :, 2]
    rests = np.clip(over * 1.25, 0, 1) * np.where(gap > 0, decay(gap, settings.half_contact_m), sunk * above_middle)
    off = (targets.low[:, None, 2] - anchors.low[None, :, 2]) > settings.off_floor_m
    upright = anchors.size[None, :, 2] > targets.size[:, None, 2]
    hangs = settings.hanging_fit * decay(distance_m(gaps), settings.half_touch_m) * off * upright
    return np.maximum(rests, hangs)


def under_fit(targets: Boxes, anchors: Boxes, gaps: F64, settings: SupportSettings) -> F64:
    """(n, m) fit: the target is lower than the anchor and below it or nearly below it."""
    over = footprint_overlap(targets, anchors, gaps, smaller=True)
    rise = anchors.center[None, :, 2] - targets.center[:, None, 2]
    apart = anchors.low[None, :, 2] - targets.high[:, None, 2]  # negative: they overlap in height
    lower = np.clip(0.5 + rise / (2 * settings.same_height_m), 0, 1)
    # without overlapping footprints it must be entirely lower: what stands beside a table is not under it
    aside = (
        0.8
        * decay(horizontal_distance_m(gaps), settings.half_aside_m)
        * np.clip(0.5 + (apart + settings.same_height_m) / (2 * settings.same_height_m), 0, 1)
    )
    below = lower * np.maximum(np.clip(over * 1.25, 0, 1), aside) * decay(apart, settings.half_rise_m)
    # a chair tucked under a desk is mostly before it, and its back rises above the desk's middle
    legs = np.array([label.head_noun in ("desk", "table") for label in anchors.labels], bool)[None]
    stands = (targets.low[:, None, 2] - anchors.low[None, :, 2]) < settings.off_floor_m
    lowered = targets.center[:, None, 2] < anchors.high[None, :, 2]
    return np.maximum(
        below,
        settings.tucked_fit * legs * stands * lowered * decay(horizontal_distance_m(gaps), settings.half_tucked_m),
    )


def in_fit(targets: Boxes, anchors: Boxes, gaps: F64, settings: SupportSettings) -> F64:
    """(n, m) fit: most of the target's volume is within the anchor; for a room: the target belongs to it."""
    half = targets.size / 2
    low = np.maximum((targets.center - half)[:, None], anchors.low[None] - settings.box_error_m)
    high = np.minimum((targets.center + half)[:, None], anchors.high[None] + settings.box_error_m)
    share = np.prod(np.clip(high - low, 0, None), axis=2) / np.prod(2 * half, axis=1)[:, None]
    fit = np.clip(share * 0.5 / settings.inside_share, 0, 1)
    legs = np.array([label.head_noun in OPEN_BELOW for label in anchors.labels], bool)[None]
    raised = np.clip(
        (targets.low[:, None, 2] - anchors.low[None, :, 2]) / (settings.raised_share * anchors.size[None, :, 2]), 0, 1
    )
    share = np.where(legs, share * raised, share)
    fit = np.where(legs, fit * raised, fit)
    rooms = np.array([label.layer == "room" for label in anchors.labels], bool)
    same = targets.room[:, None] == anchors.room[None]
    return np.where(rooms[None] & (anchors.room >= 0)[None], same.astype(float), np.where(share > 0.95, 1.0, fit))


def evaluate(query: RelationQuery) -> PairFits:
    """All pairs. "In" also holds for what lies on top (books in a shelf, a cup in the sink)."""
    targets, anchors, settings = query.targets, query.anchors, query.settings.support
    assert anchors is not None
    gaps = axis_gaps_m(targets, anchors)
    name = query.relation
    if name == "on":
        # a cup within the box of a shelf, rack or counter with a back wall is "on" it, too
        values = np.maximum(
            on_fit(targets, anchors, gaps, settings),
            settings.inside_or_on_fit * in_fit(targets, anchors, gaps, settings),
        )
        values = _with_room_parts(query, anchors, gaps, values)
    elif name == "in":
        values = np.maximum(
            in_fit(targets, anchors, gaps, settings),
            settings.inside_or_on_fit * on_fit(targets, anchors, gaps, settings),
        )
        values = _with_room_parts(query, anchors, gaps, values)
    elif name == "under":
        values = under_fit(targets, anchors, gaps, settings)
    elif name == "above":
        values = under_fit(anchors, targets, gaps.swapaxes(0, 1), settings).T
    else:
        values = _holds(targets, anchors, gaps, settings)
        if name == "with":
            gap = distance_m(gaps)
            values = np.maximum(
                values, np.maximum(0.9 * decay(gap, settings.half_touch_m), 0.7 * decay(gap, settings.half_beside_m))
            )
    return PairFits(values, lambda i, j: _sentence(query, i, j))


def _with_room_parts(query: RelationQuery, anchors: Boxes, gaps: F64, values: F64) -> F64:
    """The fits (n, m) of "on" and "in", replaced where the anchor is a wall, floor or corner of a room."""
    targets, settings = query.targets, query.settings.support
    is_wall = anchors.is_part(RoomPart.WALL, RoomPart.ROOM)
    is_floor = anchors.is_part(RoomPart.FLOOR, RoomPart.CEILING)
    is_spot = anchors.is_part(RoomPart.CORNER, RoomPart.CENTER)
    aside_m = horizontal_distance_m(gaps)
    off = targets.low[:, None, 2] - anchors.low[None, :, 2] > settings.off_floor_m
    above = targets.low[:, None, 2] - anchors.high[None, :, 2] - settings.floor_m
    values = np.where(
        is_wall[None], settings.hanging_fit * decay(aside_m, query.settings.nearness.half_wall_m) * off, values
    )
    values = np.where(is_floor[None], decay(above, settings.half_contact_m) * (aside_m <= 0), values)
    return np.where(is_spot[None], decay(aside_m, query.settings.room_position.half_corner_m), values)


def _holds(targets: Boxes, anchors: Boxes, gaps: F64, settings: SupportSettings) -> F64:
    turned = gaps.swapaxes(0, 1)
    return np.maximum(on_fit(anchors, targets, turned, settings), in_fit(anchors, targets, turned, settings)).T


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
    inside = float(in_fit(subject, support, gaps, query.settings.support)[0, 0])
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
