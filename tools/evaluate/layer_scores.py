"""Scores of an aligned map against its ground truth, layer by layer; every kind of truth is scored here."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from placegraph.runtime.vision.area_overlap import Area, AreaOverlaps, overlaps
from placegraph.tools.evaluate.aligned_map import AlignedMap, MapPlace
from placegraph.tools.evaluate.ground_truth import GroundTruth, GroundTruthPlace
from placegraph.tools.evaluate.object_scores import object_scores
from placegraph.tools.evaluate.place_overlap import (
    BOUNDARY_M,
    CELL_M,
    f1_curve,
    hydra_scores,
    match_floors,
    match_scores,
    ratio,
)

UNKNOWN_FLOOR = -1  # of a map floor without a true one; areas on it overlap nothing
ROOM_IOU = 0.5  # at which a room is right; the usual threshold, chosen by hand

FloorPairs = Sequence[tuple[int, int, float]]  # map floor, true floor, error of the worse boundary in m


def map_scores(aligned_map: AlignedMap, ground_truth: GroundTruth) -> dict[str, Any]:
    """Scores by layer; a layer that is not known has no entry."""
    scores: dict[str, Any] = {}
    true_floors = [0] * len(aligned_map.floors)
    if ground_truth.floors is not None:
        heights = np.array([[floor.bottom_m, floor.top_m] for floor in ground_truth.floors]).reshape(-1, 2)
        pairs = match_floors(aligned_map.floors, heights)
        true_floor_of = {i: j for i, j, _ in pairs}
        true_floors = [true_floor_of.get(i, UNKNOWN_FLOOR) for i in range(len(aligned_map.floors))]
        scores["floors"] = _floors(len(aligned_map.floors), [floor.seen for floor in ground_truth.floors], pairs)
    if ground_truth.rooms is not None:
        scores["rooms"] = _rooms(aligned_map.rooms, ground_truth.rooms, true_floors)
    if ground_truth.locations is not None:
        iou = _overlaps(aligned_map.locations, ground_truth.locations, true_floors).iou
        curve = {f"{delta:g}": f1 for delta, f1 in f1_curve(iou).items()}
        scores["locations"] = _counts(aligned_map.locations, ground_truth.locations) | {"f1_at": curve}
    if ground_truth.objects is not None:
        scores["objects"] = object_scores(aligned_map.objects, ground_truth.objects, ground_truth.vocabulary)
    return scores


def _floors(map_floors: int, seen: Sequence[bool], pairs: FloorPairs) -> dict[str, Any]:
    """A map floor whose true floor the walk was not on is neither right nor wrong."""
    errors = [error for _, j, error in pairs if seen[j]]
    judged = map_floors - sum(not seen[j] for _, j, _ in pairs)
    right, true = sum(error < BOUNDARY_M for error in errors), sum(seen)
    return {
        "truth": true,
        "of": len(seen),
        "map": map_floors,
        "count_equal": judged == true,
        "right": right,
        "precision": ratio(right, judged),
        "recall": ratio(right, true),
        "boundary_error_m": ratio(sum(errors), len(errors)),
    }


def _rooms(places: Sequence[MapPlace], true: Sequence[GroundTruthPlace], true_floors: Sequence[int]) -> dict[str, Any]:
    room_overlaps = _overlaps(places, true, true_floors)
    scores = match_scores(room_overlaps.iou, ROOM_IOU)
    hydra_precision, hydra_recall = hydra_scores(room_overlaps)
    return _counts(places, true) | {
        "precision": scores.precision,
        "recall": scores.recall,
        "f1": scores.f1,
        "hydra_precision": hydra_precision,
        "hydra_recall": hydra_recall,
    }


def _counts(places: Sequence[MapPlace], true: Sequence[GroundTruthPlace]) -> dict[str, Any]:
    return {"truth": sum(place.seen for place in true), "of": len(true), "map": len(places)}


def _overlaps(places: Sequence[MapPlace], true: Sequence[GroundTruthPlace], true_floors: Sequence[int]) -> AreaOverlaps:
    areas: list[Area] = [(true_floors[place.floor], place.outline) for place in places]
    return overlaps(areas, [(place.floor, place.outline) for place in true if place.seen], CELL_M)
