"""Largest, smallest, tallest, shortest, longest, highest and lowest of the targets.

Size counts the two longer sides first, because the third side of flat things is mostly measurement noise.
"""

from __future__ import annotations

import numpy as np

from placegraph.nodes.grounding.box_arrays import Boxes
from placegraph.nodes.grounding.relations import PairFits, Relation, RelationQuery
from placegraph.runtime.arrays import F64


def log_size(boxes: Boxes, short_side: float) -> F64:
    """(N,) logarithm of how large things look."""
    sides = np.sort(np.maximum(boxes.size, 0.02), axis=1)
    return np.asarray(np.log(sides[:, 2]) + np.log(sides[:, 1]) + short_side * np.log(sides[:, 0]))


def length_m(boxes: Boxes) -> F64:
    """(N,) the longer horizontal side."""
    return np.asarray(boxes.size[:, :2].max(axis=1))


def evaluate(query: RelationQuery) -> PairFits:
    """One value a target, greatest first."""
    boxes, name = query.targets, query.relation
    sign = -1.0 if name in ("smallest", "shortest", "lowest") else 1.0
    if name in ("largest", "smallest"):
        volume = np.prod(boxes.size, axis=1)
        return PairFits(
            sign * log_size(boxes, query.settings.appearance.short_side_weight)[:, None],
            lambda i, _: f"{boxes.labels[i]} fills a box of {volume[i]:.3f} m3",
            query.settings.nearness.margin_m,
        )
    if name in ("tallest", "shortest"):
        values, words = boxes.size[:, 2], "{} is {:.2f} m tall"
    elif name == "longest":
        values, words = length_m(boxes), "{} is {:.2f} m long"
    else:
        values, words = boxes.center[:, 2], "the middle of {} is at a height of {:.2f} m"
    return PairFits(
        sign * values[:, None], lambda i, _: words.format(boxes.labels[i], values[i]), query.settings.nearness.margin_m
    )


RELATION = Relation(
    phrases={
        "largest": ("largest", "biggest", "most spacious", "bigger", "larger"),
        "smallest": ("smallest", "tiniest", "littlest", "narrowest", "smaller"),
        "tallest": ("tallest", "taller"),
        "shortest": ("shortest", "shorter"),
        "longest": ("longest", "longer", "widest", "wider"),
        "highest": ("highest", "topmost", "uppermost", "higher"),
        "lowest": ("lowest", "bottommost", "lower"),
    },
    evaluate=evaluate,
)
