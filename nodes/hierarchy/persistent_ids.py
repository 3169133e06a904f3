"""Keep the ids of places across rebuilds by the overlap of their footprints; no id is ever given to another place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from scipy.optimize import linear_sum_assignment

from placegraph.runtime.arrays import F64, Points

MIN_IOU = 0.1  # chosen by hand: a room doubles and doubles again while it is explored, and is still that room
RASTER_M = 0.1  # of the images in which footprints are compared: the positions of rooms are uncertain by as much


@dataclass(frozen=True, eq=False)
class PlaceFootprint:
    """What identifies a place: its outline (K, 2) m, world, and the group (a floor's id) that it cannot leave."""

    footprint: Points
    group: str = ""


class PersistentIds:
    """Ids of one layer. A place that was gone and comes back gets its old id back."""

    def __init__(self, letter: str) -> None:
        self._letter = letter
        self._known: list[PlaceFootprint] = []  # by number

    def assign(self, places: Sequence[PlaceFootprint]) -> list[str]:
        """Ids for places: those of known places by the best total overlap, and new ids in the order given."""
        numbers = [-1] * len(places)
        if places and self._known:
            iou = self._overlaps(places)
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

    def _overlaps(self, places: Sequence[PlaceFootprint]) -> F64:
        """IoU (places, known places); only pairs of one group whose boxes overlap are drawn."""
        a, b = (np.array([_box(place) for place in group]) for group in (places, self._known))
        overlapping = ((a[:, None, 0] < b[None, :, 1]) & (b[None, :, 0] < a[:, None, 1])).all(axis=2)
        same_group = np.array([place.group for place in places])[:, None] == [known.group for known in self._known]
        iou = np.zeros(overlapping.shape)
        for i, j in np.argwhere(overlapping & same_group).tolist():
            iou[i, j] = footprint_iou(places[i], self._known[j])
        return iou


def _box(place: PlaceFootprint) -> F64:
    """(2, 2) lowest and highest x, y; the box of an outline without area overlaps nothing."""
    if len(place.footprint) < 3:
        return np.array([[np.inf, np.inf], [-np.inf, -np.inf]])
    return np.array([place.footprint.min(axis=0), place.footprint.max(axis=0)], float)


def footprint_iou(a: PlaceFootprint, b: PlaceFootprint) -> float:
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


def height_footprint(low_m: float, high_m: float) -> Points:
    """A floor's heights as a footprint one metre wide, so that floors are told apart by height and not by plan."""
    return np.array([[low_m, 0], [high_m, 0], [high_m, 1], [low_m, 1]])
