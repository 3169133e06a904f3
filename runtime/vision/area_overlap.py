"""How much outlines on the same floor overlap, counted in cells of a common grid."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass

import numpy as np

from placegraph.runtime.arrays import F64, I64, Bool, Points

Area = tuple[Hashable, Points]  # floor and outline (N, 2) in metres; areas of different floors never overlap
AreaRaster = tuple[I64, Bool]  # number (2,) of the first cell along x and y, and the cells (X, Y) that lie inside


@dataclass(frozen=True, eq=False)
class AreaOverlaps:
    """Of A and B areas: what they share (A, B) and what each covers (A,), (B,), in cells."""

    shared: F64
    found: F64
    true: F64

    @property
    def iou(self) -> F64:
        """(A, B); 0 where both are empty."""
        union = self.found[:, None] + self.true[None] - self.shared
        return np.divide(self.shared, union, out=np.zeros_like(self.shared), where=union > 0)


def overlaps(found: Sequence[Area], true: Sequence[Area], cell_m: float) -> AreaOverlaps:
    """Overlaps of areas, counted in cells of a common grid whose centre lies in them."""
    a, b = ([rasterize(outline, cell_m) for _, outline in areas] for areas in (found, true))
    shared = np.zeros((len(found), len(true)))
    for i, (floor, _) in enumerate(found):
        for j in [j for j, (true_floor, _) in enumerate(true) if true_floor == floor]:
            shared[i, j] = _shared_cells(a[i], b[j])
    sizes = (np.array([mask.sum() for _, mask in rasters], float) for rasters in (a, b))
    return AreaOverlaps(shared, *sizes)


def rasterize(outline: Points, cell_m: float) -> AreaRaster:
    """The cells whose centre lies inside an outline (N, 2), by the parity of its crossings; none of N < 3."""
    if len(outline) < 3:
        return np.zeros(2, np.int64), np.zeros((0, 0), bool)
    low = np.floor(outline.min(axis=0) / cell_m).astype(np.int64)
    count = np.ceil(outline.max(axis=0) / cell_m).astype(np.int64) - low
    x, y = ((np.arange(count[axis]) + low[axis] + 0.5) * cell_m for axis in (0, 1))
    (ax, ay), (bx, by) = outline.T, np.roll(outline, -1, axis=0).T
    rows, edges = np.nonzero((ay > y[:, None]) != (by > y[:, None]))
    crossings = (bx - ax)[edges] * (y[rows] - ay[edges]) / (by - ay)[edges] + ax[edges]
    counts = np.zeros((len(x) + 1, len(y)), np.int64)  # crossings by the number of cells of their row before them
    np.add.at(counts, (np.searchsorted(x, crossings), rows), 1)
    return low, np.cumsum(counts[:0:-1], axis=0)[::-1] % 2 == 1


def _shared_cells(a: AreaRaster, b: AreaRaster) -> int:
    low = np.maximum(a[0], b[0])
    high = np.minimum(a[0] + a[1].shape, b[0] + b[1].shape)
    if (low >= high).any():
        return 0
    parts = (
        mask[tuple(slice(*ends) for ends in zip(low - first, high - first, strict=True))] for first, mask in (a, b)
    )
    return int(np.logical_and(*parts).sum())
