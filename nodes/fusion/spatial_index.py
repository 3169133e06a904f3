"""Which objects may be near a box, and how much two boxes or point clouds share."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from placegraph.runtime.arrays import F32, F64, Bool


class SpatialIndex:
    """Object ids by cells of 1 m in plan, so that a search does not visit all objects."""

    def __init__(self) -> None:
        self._ids: dict[tuple[int, int], set[int]] = {}
        self._cells: dict[int, list[tuple[int, int]]] = {}

    def update(self, object_id: int, box: F32) -> None:
        """Note where an object's box (2, 3) is now."""
        cells = self._covered(box, 0.0)
        if self._cells.get(object_id) != cells:
            self.remove(object_id)
            self._cells[object_id] = cells
            for cell in cells:
                self._ids.setdefault(cell, set()).add(object_id)

    def remove(self, object_id: int) -> None:
        """Forget an object."""
        for cell in self._cells.pop(object_id, ()):
            self._ids[cell].discard(object_id)
            if not self._ids[cell]:
                del self._ids[cell]

    def ids_near(self, box: F32, reach_m: float) -> list[int]:
        """Ids of objects that may be within reach of a box (2, 3), ascending."""
        ids: set[int] = set()
        for cell in self._covered(box, reach_m):
            ids |= self._ids.get(cell, set())
        return sorted(ids)

    @staticmethod
    def _covered(box: F32, reach_m: float) -> list[tuple[int, int]]:
        (x0, y0), (x1, y1) = np.floor(box[0, :2] - reach_m).tolist(), np.floor(box[1, :2] + reach_m).tolist()
        return [(x, y) for x in range(int(x0), int(x1) + 1) for y in range(int(y0), int(y1) + 1)]


def share_near(points: F64, tree: cKDTree, reach_m: float) -> float:
    """Share of points (N, 3) within reach of one of the tree's points; 0 when there are none."""
    if not len(points):
        return 0.0
    distance, _ = tree.query(points, distance_upper_bound=reach_m)
    return float(np.isfinite(distance).mean())


def touches_both(points: F64, clouds: tuple[F64, F64], reach_m: float) -> bool:
    """Whether points (N, 3) come within reach of both clouds."""
    tree = cKDTree(points)
    return all(share_near(cloud, tree, reach_m) > 0 for cloud in clouds)


def is_nearer_to_second(points: F64, clouds: tuple[F64, F64]) -> Bool:
    """Mask (N,) of the points (N, 3) that are nearer to the second cloud than to the first."""
    return np.asarray(cKDTree(clouds[1]).query(points)[0] < cKDTree(clouds[0]).query(points)[0])


def boxes_within(a: F32, b: F32, reach_m: float) -> bool:
    """Whether two (2, 3) boxes are within reach of each other along each axis."""
    return bool((a[0] <= b[1] + reach_m).all() and (b[0] <= a[1] + reach_m).all())


def containment(a: F32, b: F32, reach_m: float) -> float:
    """Share of the smaller box's volume inside the other; both are grown, since one view of a thing may be flat."""
    sizes = [box[1] - box[0] + reach_m for box in (a, b)]
    shared = np.clip(np.minimum(a[1], b[1]) - np.maximum(a[0], b[0]) + reach_m, 0, None)
    return float(np.prod(shared) / min(np.prod(sizes[0]), np.prod(sizes[1])))
