"""Conditions about things of one name: one that stands alone, or is one of a group of so many.

Not in the paper. A group is a connected component of things whose gaps are small; two gap limits are tried.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components

from placegraph.nodes.grounding.box_arrays import Boxes
from placegraph.nodes.grounding.program import Condition
from placegraph.nodes.grounding.relations import HOLDS, axis_gaps_m, distance_m
from placegraph.nodes.grounding.settings import GroupSettings
from placegraph.runtime.arrays import F64, I64

MAX_PEERS = 1500  # things whose gaps are held at once; bounds memory


def group_fits(
    boxes: Boxes, rows: I64, condition: Condition, settings: GroupSettings
) -> tuple[F64, Callable[[int], str]]:
    """(n,) fits 0..1 of `alone` or `count` among the boxes of some rows, and a sentence for each box."""
    values = np.full(len(boxes), HOLDS)
    if len(rows) > MAX_PEERS:
        return values, lambda i: ""
    peers = boxes.take(rows)
    gap = distance_m(axis_gaps_m(peers, peers))
    if condition.name == "alone":
        np.fill_diagonal(gap, np.inf)
        measured = gap.min(axis=1) if len(rows) > 1 else np.full(len(rows), settings.alone_m)
        farthest = max(float(measured.max(initial=0.0)), 1e-6)
        values[rows] = np.maximum(np.clip(measured / settings.alone_m, 0, 1), measured / farthest)
        text = "{}: the nearest of its kind is {:.2f} m away"
    else:
        sizes = [_group_sizes(gap, limit) for limit in (settings.gap_m, settings.large_gap_m)]
        fitting = np.any([size == condition.number for size in sizes], axis=0) | (len(rows) == condition.number)
        values[rows] = np.where(fitting, 1.0, HOLDS)
        text, measured = "{} is in a group of {:.0f}", sizes[0]
    words = {int(row): text.format(boxes.labels[row], value) for row, value in zip(rows, measured, strict=True)}
    return values, lambda i: words.get(i, "")


def _group_sizes(gap: F64, limit: float) -> F64:
    """(n,) sizes of the connected components of each box, where boxes with a gap (n, n) up to limit are joined."""
    _, group = connected_components(csr_matrix(gap <= limit), directed=False)
    return np.asarray(np.bincount(group)[group], float)
