"""Which objects may be near a box, and how much two boxes or clouds share."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from placegraph.runtime.arrays import F32, F64, Bool


class Grid:
    """Numbers of objects by plan cell of 1 m, so that a search does not visit them all."""

    def __init__(self) -> None:
        self._cells: dict[tuple[int, int], set[int]] = {}
        self._spans: dict[int, list[tuple[int, int]]] = {}

    def put(self, number: int, box: F32) -> None:
        """Note where an object's box (2, 3) is now."""
        span = self._covered(box, 0.0)
        if self._spans.get(number) != span:
            self.remove(number)
            self._spans[number] = span
            for cell in span:
                self._cells.setdefault(cell, set()).add(number)

    def remove(self, number: int) -> None:
        """Forget an object."""
        for cell in self._spans.pop(number, ()):
            self._cells[cell].discard(number)
            if not self._cells[cell]:
                del self._cells[cell]

    def near(self, box: F32, reach_m: float) -> list[int]:
        """Numbers of objects that may be within reach of a box (2, 3), ascending."""
        found: set[int] = set()
        for cell in self._covered(box, reach_m):
            found |= self._cells.get(cell, set())
        return sorted(found)

    @staticmethod
    def _covered(box: F32, reach_m: float) -> list[tuple[int, int]]:
        (x0, y0), (x1, y1) = np.floor(box[0, :2] - reach_m).tolist(), np.floor(box[1, :2] + reach_m).tolist()
        return [(x, y) for x in range(int(x0), int(x1) + 1) for y in range(int(y0), int(y1) + 1)]


def share_near(points: F64, tree: cKDTree, reach_m: float) -> float:
    """Share of points (N, 3) that have one of the tree's within reach; 0 of none."""
    if not len(points):
        return 0.0
    distance, _ = tree.query(points, distance_upper_bound=reach_m)
    return float(np.isfinite(distance).mean())


def spans(points: F64, sides: tuple[F64, F64], reach_m: float) -> bool:
    """Whether points (N, 3) lie on both of two clouds."""
    tree = cKDTree(points)
    return all(share_near(side, tree, reach_m) > 0 for side in sides)


def nearer(points: F64, sides: tuple[F64, F64]) -> Bool:
    """Which of points (N, 3) are nearer to the second cloud than to the first."""
    return np.asarray(cKDTree(sides[1]).query(points)[0] < cKDTree(sides[0]).query(points)[0])


def boxes_meet(a: F32, b: F32, reach_m: float) -> bool:
    """Whether two (2, 3) boxes are within reach of each other, along each axis."""
    return bool((a[0] <= b[1] + reach_m).all() and (b[0] <= a[1] + reach_m).all())


def inside(a: F32, b: F32, reach_m: float) -> float:
    """Share of the smaller box inside the other; both grown, as one view of a thing may be a thin sheet."""
    sizes = [box[1] - box[0] + reach_m for box in (a, b)]
    shared = np.clip(np.minimum(a[1], b[1]) - np.maximum(a[0], b[0]) + reach_m, 0, None)
    return float(np.prod(shared) / min(np.prod(sizes[0]), np.prod(sizes[1])))
