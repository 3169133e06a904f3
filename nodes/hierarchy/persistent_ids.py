"""Keep the ids of places across rebuilds by the overlap of their footprints; an id is never given to another place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from scipy.optimize import linear_sum_assignment

from placegraph.runtime.arrays import F64, Points

MIN_IOU = 0.1  # departs: a room doubles and doubles again while it is explored, and is still that room
RASTER_M = 0.1


@dataclass(frozen=True, eq=False)
class Place:
    """What identifies a place: its footprint (K, 2) m, world, and the group (a floor's id) that it cannot leave."""

    footprint: Points
    group: str = ""


class Identities:
    """Ids of one layer. A place that was gone and comes back gets its old id back."""

    def __init__(self, letter: str) -> None:
        self._letter = letter
        self._known: list[Place] = []  # by number

    def assign(self, places: Sequence[Place]) -> list[str]:
        """Ids for places, the best total overlap with known ones winning, new ids in the order given."""
        numbers = [-1] * len(places)
        if places and self._known:
            iou = self._overlaps(places)
            rows, columns = np.flatnonzero(iou.any(axis=1)), np.flatnonzero(iou.any(axis=0))
            iou = iou[np.ix_(rows, columns)]  # of a large building a small part
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

    def _overlaps(self, places: Sequence[Place]) -> F64:
        """IoU (places, known); only pairs of one group whose boxes meet are drawn."""
        a, b = (np.array([_box(place) for place in some]) for some in (places, self._known))
        meet = ((a[:, None, 0] < b[None, :, 1]) & (b[None, :, 0] < a[:, None, 1])).all(axis=2)
        groups = np.array([place.group for place in places])[:, None] == [known.group for known in self._known]
        iou = np.zeros(meet.shape)
        for i, j in np.argwhere(meet & groups).tolist():
            iou[i, j] = overlap(places[i], self._known[j])
        return iou


def _box(place: Place) -> F64:
    """(2, 2) lowest and highest x, y; an outline without area meets nothing."""
    if len(place.footprint) < 3:
        return np.array([[np.inf, np.inf], [-np.inf, -np.inf]])
    return np.array([place.footprint.min(axis=0), place.footprint.max(axis=0)], float)


def overlap(a: Place, b: Place) -> float:
    """Intersection over union of two footprints, 0..1; 0 across groups and for outlines without area."""
    if a.group != b.group or len(a.footprint) < 3 or len(b.footprint) < 3:
        return 0.0
    corners = np.array([_box(a), _box(b)])
    low, high = corners[:, 0].min(axis=0), corners[:, 1].max(axis=0)
    if (corners[:, 0].max(axis=0) >= corners[:, 1].min(axis=0)).any():
        return 0.0
    columns, rows = (np.ceil((high - low) / RASTER_M).astype(int) + 1).tolist()
    masks = []
    for place in (a, b):
        mask = np.zeros((rows, columns), np.uint8)
        cv2.fillPoly(mask, [np.rint((place.footprint - low) / RASTER_M).astype(np.int32)], 1)
        masks.append(mask > 0)
    return float((masks[0] & masks[1]).sum() / (masks[0] | masks[1]).sum())


def span_footprint(low_m: float, high_m: float) -> Points:
    """A floor's heights as a footprint one metre wide, so that floors are told apart by height and not by plan."""
    return np.array([[low_m, 0], [high_m, 0], [high_m, 1], [low_m, 1]])
