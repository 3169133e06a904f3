"""Floors, rooms and locations of a map against the true ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from placegraph.runtime.arrays import F64
from placegraph.runtime.vision.area_overlap import AreaOverlaps

CELL_M = 0.05
BOUNDARY_M = 0.5  # within which both heights of a floor must lie, as in HOV-SG
DELTAS = tuple(round(0.1 * k, 1) for k in range(1, 10))


@dataclass(frozen=True)
class MatchScores:
    """Shares of the found areas that are right and of the true ones that were found; NaN where there are none."""

    precision: float
    recall: float
    f1: float


def ratio(part: float, whole: float) -> float:
    """A part of a whole as a number; NaN when there is no whole."""
    return part / whole if whole else float("nan")


def hydra_scores(overlaps: AreaOverlaps) -> tuple[float, float]:
    """Precision and recall: the mean share of a found (true) area that lies in the true (found) area it fits best.

    Source: Hughes et al., "Hydra", RSS 2022 and IJRR 2024.
    """
    best_found = overlaps.shared.max(axis=1, initial=0) / np.maximum(overlaps.found, 1)
    best_true = overlaps.shared.max(axis=0, initial=0) / np.maximum(overlaps.true, 1)
    return ratio(float(best_found.sum()), len(best_found)), ratio(float(best_true.sum()), len(best_true))


def match_scores(iou: F64, delta: float) -> MatchScores:
    """Scores of IoUs (found, true): each found one in turn takes the free true one it fits best, if by more than delta.

    Source: paper, "Metrics" of its location detector: F1@delta.
    """
    free, right = iou.copy(), 0
    for row in free:
        best = int(row.argmax()) if row.size else -1
        if best >= 0 and row[best] > delta:
            right += 1
            free[:, best] = -1.0
    found, true = iou.shape
    return MatchScores(ratio(right, found), ratio(right, true), ratio(2 * right, found + true))


def f1_curve(iou: F64, deltas: Sequence[float] = DELTAS) -> dict[float, float]:
    """F1 by delta."""
    return {delta: match_scores(iou, delta).f1 for delta in deltas}


def match_floors(found: F64, true: F64) -> list[tuple[int, int, float]]:
    """Pairs (found, true, error) of floors given by their lowest and highest height (F, 2), (T, 2) in metres.

    Floors whose surfaces are nearest are paired first, each floor once: a map floor that covers two true ones is the
    lower of them. Floors without a height in common are never a pair. The error is that of the worse boundary.
    """
    error = np.abs(found[:, None] - true[None])
    apart = np.maximum(found[:, None, 0], true[None, :, 0]) > np.minimum(found[:, None, 1], true[None, :, 1])
    free = np.where(apart, np.inf, error[..., 0])
    pairs = []
    while np.isfinite(free).any():
        i, j = (int(k) for k in np.unravel_index(free.argmin(), free.shape))
        pairs.append((i, j, float(error[i, j].max())))
        free[i], free[:, j] = np.inf, np.inf
    return pairs
