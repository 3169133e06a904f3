"""Keep the ids of places across rebuilds by the overlap of their outlines; no id is ever given to another place."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import linear_sum_assignment

from placegraph.runtime.arrays import Points
from placegraph.runtime.vision.area_overlap import Area, overlaps

MIN_IOU = 0.1  # chosen by hand: a room doubles and doubles again while it is explored, and is still that room
CELL_M = 0.1  # in which outlines are compared: the positions of rooms are uncertain by as much


class PersistentIds:
    """Ids of one layer. A place that was gone and comes back gets its old id back."""

    def __init__(self, letter: str) -> None:
        self._letter = letter
        self._known: list[Area] = []  # by number

    def assign(self, places: Sequence[Area]) -> list[str]:
        """Ids for places (floor id, outline): those of known places by the best total overlap, else new ones in order.

        A place never gets the id of a place on another floor.
        """
        numbers = [-1] * len(places)
        iou = overlaps(places, self._known, CELL_M).iou
        rows, columns = np.flatnonzero(iou.any(axis=1)), np.flatnonzero(iou.any(axis=0))
        iou = iou[np.ix_(rows, columns)]  # a small part of a large building
        for row, column in zip(*linear_sum_assignment(-iou), strict=True):
            if iou[row, column] >= MIN_IOU:
                numbers[rows[row]] = int(columns[column])
        for i, place in enumerate(places):
            if numbers[i] < 0:
                numbers[i] = len(self._known)
                self._known.append(place)
            else:
                self._known[numbers[i]] = place
        return [f"{self._letter}{number}" for number in numbers]


def height_outline(low_m: float, high_m: float) -> Points:
    """A floor's heights as an outline one metre wide, so that floors are told apart by height and not by plan."""
    return np.array([[low_m, 0], [high_m, 0], [high_m, 1], [low_m, 1]])
