"""A map, laid onto what is known to be true, as numbers, layer by layer: the one way in which any truth is scored."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from placegraph.tools.evaluate.aligned_map import AlignedMap, MapPlace
from placegraph.tools.evaluate.ground_truth import Known, KnownPlace
from placegraph.tools.evaluate.objects import object_scores
from placegraph.tools.evaluate.places import (
    BOUNDARY_M,
    Area,
    Overlaps,
    f1_curve,
    hydra,
    match_floors,
    matched,
    overlaps,
    share,
)

UNKNOWN_FLOOR = -1  # of a map floor that no true one is paired with; areas on it overlap nothing
ROOM_IOU = 0.5  # METHOD.md, section 11

Pairs = Sequence[tuple[int, int, float]]  # map floor, true floor, error of the worse boundary in m


def map_scores(aligned: AlignedMap, known: Known) -> dict[str, Any]:
    """Scores of each layer that is known; what is not known has no entry."""
    found: dict[str, Any] = {}
    floor_of = [0] * len(aligned.floors)
    if known.floors is not None:
        heights = np.array([[one.bottom_m, one.top_m] for one in known.floors]).reshape(-1, 2)
        pairs = match_floors(aligned.floors, heights)
        true = {i: j for i, j, _ in pairs}
        floor_of = [true.get(i, UNKNOWN_FLOOR) for i in range(len(aligned.floors))]
        found["floors"] = _floors(len(aligned.floors), [one.seen for one in known.floors], pairs)
    if known.rooms is not None:
        found["rooms"] = _rooms(aligned.rooms, known.rooms, floor_of)
    if known.locations is not None:
        met = _overlaps(aligned.locations, known.locations, floor_of)
        curve = {f"{delta:g}": f1 for delta, f1 in f1_curve(met.iou).items()}
        found["locations"] = _counts(aligned.locations, known.locations) | {"f1_at": curve}
    if known.objects is not None:
        found["objects"] = object_scores(aligned.objects, known.objects, known.words)
    return found


def _floors(found: int, seen: Sequence[bool], pairs: Pairs) -> dict[str, Any]:
    """A map floor that is paired with one which the walk was not on is neither right nor wrong."""
    asked = [error for _, j, error in pairs if seen[j]]
    judged = found - sum(not seen[j] for _, j, _ in pairs)
    right, true = sum(error < BOUNDARY_M for error in asked), sum(seen)
    return {
        "truth": true,
        "of": len(seen),
        "map": found,
        "count_equal": judged == true,
        "right": right,
        "precision": share(right, judged),
        "recall": share(right, true),
        "boundary_error_m": share(sum(asked), len(asked)),
    }


def _rooms(found: Sequence[MapPlace], true: Sequence[KnownPlace], floor_of: Sequence[int]) -> dict[str, Any]:
    met = _overlaps(found, true, floor_of)
    scores, (hydra_precision, hydra_recall) = matched(met.iou, ROOM_IOU), hydra(met)
    return _counts(found, true) | {
        "precision": scores.precision,
        "recall": scores.recall,
        "f1": scores.f1,
        "hydra_precision": hydra_precision,
        "hydra_recall": hydra_recall,
    }


def _counts(found: Sequence[MapPlace], true: Sequence[KnownPlace]) -> dict[str, Any]:
    return {"truth": sum(one.seen for one in true), "of": len(true), "map": len(found)}


def _overlaps(found: Sequence[MapPlace], true: Sequence[KnownPlace], floor_of: Sequence[int]) -> Overlaps:
    mine: list[Area] = [(floor_of[place.floor], place.outline) for place in found]
    return overlaps(mine, [(place.floor, place.outline) for place in true if place.seen])
