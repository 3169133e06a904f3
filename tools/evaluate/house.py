"""A map of a procedural house against the house's truth, layer by layer, as numbers and as a table."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from placegraph.runtime.errors import SourceError
from placegraph.runtime.scene_graph import SceneGraph
from placegraph.tools.evaluate.aligned_map import AlignedMap, MapPlace, read_aligned
from placegraph.tools.evaluate.connections import connection_scores
from placegraph.tools.evaluate.grounding import ask_all, grounding_scores, read_questions
from placegraph.tools.evaluate.objects import object_scores, seen_well
from placegraph.tools.evaluate.places import (
    BOUNDARY_M,
    Area,
    f1_curve,
    hydra,
    match_floors,
    matched,
    overlaps,
    share,
)
from placegraph.tools.evaluate.trajectory import level_alignment, paired
from placegraph.tools.house.space import inside
from placegraph.tools.house.truth import TrueLocation, TrueRoom, Truth, read_truth
from placegraph.tools.map_folder import TRAJECTORY, find_graph, read_trajectory

F64 = NDArray[np.float64]

LEAST_SHARE = 0.5  # of a location's members must have been seen well
UNKNOWN_FLOOR = -1  # of a map floor that no true one is paired with; areas on it overlap nothing


def house_scores(folder: Path, source: Path, given: dict[int, F64] | None, questions: bool) -> dict[str, Any]:
    """Scores of a map folder against SOURCE/truth; `given` are the source's poses (4, 4) by stamp_ns.

    Raises SourceError when the questions are asked for and there are none, SchemaError for a damaged map.
    """
    truth = read_truth(source)
    estimated, true = paired(read_trajectory(folder / TRAJECTORY), given)
    true_from_map = level_alignment(estimated, true)
    aligned = read_aligned(folder, true_from_map)
    floors = np.array([[one.z_m, one.z_m + one.height_m] for one in truth.floors]).reshape(-1, 2)
    pairs = match_floors(aligned.floors, floors)
    found: dict[str, Any] = {
        "floors": _floors(len(aligned.floors), len(floors), pairs),
        "rooms": _rooms(aligned, truth, true, _floor_of(aligned, pairs)),
        "locations": _locations(aligned, truth, _floor_of(aligned, pairs)),
        "objects": object_scores(aligned.objects, truth.objects, truth.seen),
    }
    if truth.connections is not None:
        graph = SceneGraph.load(find_graph(folder))
        seen = frozenset(one.id for one in _seen_rooms(truth, true))
        found["connections"] = connection_scores(graph, true_from_map, truth, seen)
    if questions:
        asked = read_questions(source)
        if not asked:
            raise SourceError(f"{source}: no questions in truth/questions.json")
        replies = ask_all(folder, asked, true_from_map)
        found["questions"] = grounding_scores(asked, replies, {one.id: one.box for one in aligned.objects})
    return found


def _floor_of(aligned: AlignedMap, pairs: Sequence[tuple[int, int, float]]) -> list[int]:
    """The true floor of each map floor, UNKNOWN_FLOOR without one."""
    true = {i: j for i, j, _ in pairs}
    return [true.get(i, UNKNOWN_FLOOR) for i in range(len(aligned.floors))]


def _floors(found: int, true: int, pairs: Sequence[tuple[int, int, float]]) -> dict[str, Any]:
    return {
        "truth": true,
        "map": found,
        "count_equal": found == true,
        "right": sum(error < BOUNDARY_M for _, _, error in pairs),
        "boundary_error_m": share(sum(error for _, _, error in pairs), len(pairs)),
    }


def _rooms(aligned: AlignedMap, truth: Truth, positions: F64, floor_of: list[int]) -> dict[str, Any]:
    """Rooms that the walk entered, or of which it saw an object well."""
    true = _seen_rooms(truth, positions)
    met = overlaps(_areas(aligned.rooms, floor_of), [(one.floor, one.polygon) for one in true])
    scores, (hydra_precision, hydra_recall) = matched(met.iou, 0.5), hydra(met)
    return {
        "truth": len(true),
        "of": len(truth.rooms),
        "map": len(aligned.rooms),
        "precision": scores.precision,
        "recall": scores.recall,
        "f1": scores.f1,
        "hydra_precision": hydra_precision,
        "hydra_recall": hydra_recall,
    }


def _seen_rooms(truth: Truth, positions: F64) -> list[TrueRoom]:
    looked_into = {one.room for one, seen in zip(truth.objects, truth.seen, strict=True) if seen_well(seen)}
    return [one for one in truth.rooms if one.id in looked_into or _entered(one, truth, positions)]


def _entered(room: TrueRoom, truth: Truth, positions: F64) -> bool:
    floor = truth.floors[room.floor]
    height = positions[:, 2] - floor.z_m
    here = positions[(height > 0) & (height < floor.height_m)]
    return bool(inside(room.polygon, here[:, :2]).any())


def _locations(aligned: AlignedMap, truth: Truth, floor_of: list[int]) -> dict[str, Any]:
    """Locations of which the walk saw at least LEAST_SHARE of the members well."""
    floor_of_room = {room.id: room.floor for room in truth.rooms}

    def is_seen(place: TrueLocation) -> bool:
        well = sum(seen_well(truth.seen[member]) for member in place.members)
        return well > 0 and well >= LEAST_SHARE * len(place.members)

    true = [one for one in truth.locations if is_seen(one)]
    areas = [(floor_of_room[one.room], one.outline) for one in true]
    iou = overlaps(_areas(aligned.locations, floor_of), areas).iou
    return {
        "truth": len(true),
        "of": len(truth.locations),
        "map": len(aligned.locations),
        "f1_at": {f"{delta:g}": f1 for delta, f1 in f1_curve(iou).items()},
    }


def _areas(places: Sequence[MapPlace], floor_of: list[int]) -> list[Area]:
    return [(floor_of[place.floor], place.outline) for place in places]
