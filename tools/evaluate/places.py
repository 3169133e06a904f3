"""Floors, rooms and locations of a map against the true ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from placegraph.tools.house.space import inside

F64 = NDArray[np.float64]

CELL_M = 0.05
BOUNDARY_M = 0.5  # METHOD.md, section 11
DELTAS = tuple(round(0.1 * k, 1) for k in range(1, 10))

Area = tuple[int, F64]  # floor and outline (N, 2) in metres; areas of different floors never overlap


@dataclass(frozen=True, eq=False)
class Overlaps:
    """Of F found and T true areas: what they share (F, T) and what each covers (F,), (T,), in cells."""

    shared: F64
    found: F64
    true: F64

    @property
    def iou(self) -> F64:
        """(F, T); 0 where both are empty."""
        union = self.found[:, None] + self.true[None] - self.shared
        return np.divide(self.shared, union, out=np.zeros_like(self.shared), where=union > 0)


@dataclass(frozen=True)
class Scores:
    """Shares of the found that are right and of the true that are found; NaN where there are none."""

    precision: float
    recall: float
    f1: float


def share(part: float, whole: float) -> float:
    """A part of a whole as a number; NaN when there is no whole."""
    return part / whole if whole else float("nan")


def overlaps(found: Sequence[Area], true: Sequence[Area], cell_m: float = CELL_M) -> Overlaps:
    """Overlaps of areas, by the cells of a common grid whose middle lies in them."""
    areas = [*found, *true]
    outlines = [outline for _, outline in areas if len(outline)]
    if not outlines:
        return Overlaps(np.zeros((len(found), len(true))), np.zeros(len(found)), np.zeros(len(true)))
    corners = np.concatenate(outlines)
    low = np.floor(corners.min(axis=0) / cell_m)
    columns, rows = (np.ceil(corners.max(axis=0) / cell_m) - low).astype(int).tolist()
    grid = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), axis=-1)
    middles = (grid + low + 0.5) * cell_m
    masks = np.array([_mask(outline, middles) for _, outline in areas], np.float32)
    a, b = masks[: len(found)], masks[len(found) :]
    floors = [floor for floor, _ in areas]
    same = np.equal.outer(floors[: len(found)], floors[len(found) :]).reshape(len(found), len(true))
    # sums of ones in float32 are exact up to 2^24 cells, 40 000 square metres
    return Overlaps((a @ b.T).astype(np.float64) * same, a.sum(axis=1, dtype=float), b.sum(axis=1, dtype=float))


def _mask(outline: F64, middles: F64) -> NDArray[np.bool_]:
    """(cells,) which cells of a grid (R, C, 2) lie in an outline; only those within its extent are asked."""
    found = np.zeros(middles.shape[:2], bool)
    if len(outline) >= 3:
        x, y = middles[0, :, 0], middles[:, 0, 1]
        columns = slice(*np.searchsorted(x, (outline[:, 0].min(), outline[:, 0].max())).tolist())
        rows = slice(*np.searchsorted(y, (outline[:, 1].min(), outline[:, 1].max())).tolist())
        found[rows, columns] = inside(outline, middles[rows, columns])
    return found.ravel()


def hydra(overlaps: Overlaps) -> tuple[float, float]:
    """Precision and recall: the mean share of a found (true) area that lies in the one true (found) area it fits best.

    Source: Hughes et al., "Hydra", RSS 2022 and IJRR 2024.
    """
    best_found = overlaps.shared.max(axis=1, initial=0) / np.maximum(overlaps.found, 1)
    best_true = overlaps.shared.max(axis=0, initial=0) / np.maximum(overlaps.true, 1)
    return share(float(best_found.sum()), len(best_found)), share(float(best_true.sum()), len(best_true))


def matched(iou: F64, delta: float) -> Scores:
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
    return Scores(share(right, found), share(right, true), share(2 * right, found + true))


def f1_curve(iou: F64, deltas: Sequence[float] = DELTAS) -> dict[float, float]:
    """F1 by delta."""
    return {delta: matched(iou, delta).f1 for delta in deltas}


def match_floors(found: F64, true: F64) -> list[tuple[int, int, float]]:
    """Pairs (found, true, error) of floors given by their lowest and highest height (F, 2), (T, 2) in metres.

    Floors whose surfaces are nearest come first, each floor once: two floors taken for one are the lower of them. The
    error is that of the worse boundary.
    """
    error = np.abs(found[:, None] - true[None])
    free = error[..., 0].copy()
    pairs = []
    for _ in range(min(free.shape)):
        i, j = (int(k) for k in np.unravel_index(free.argmin(), free.shape))
        pairs.append((i, j, float(error[i, j].max())))
        free[i], free[:, j] = np.inf, np.inf
    return pairs
