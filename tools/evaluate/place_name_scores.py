"""Whether rooms and locations of a map bear the name of the true place in which they lie."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from placegraph.runtime.language.word_forms import normal_form, synonyms
from placegraph.runtime.scene_graph import SceneGraph
from placegraph.runtime.vision.area_overlap import Area, AreaOverlaps, overlaps
from placegraph.tools.evaluate.aligned_map import AlignedMap, MapPlace
from placegraph.tools.evaluate.layer_scores import UNKNOWN_FLOOR
from placegraph.tools.evaluate.place_overlap import CELL_M, match_floors, ratio
from placegraph.tools.simulator.ground_truth import Truth

MIN_INSIDE = 0.5  # of a map place that must lie in one true place; otherwise it is of no single kind and not judged
MAX_NAMES = 3


def place_name_scores(graph: SceneGraph, aligned_map: AlignedMap, truth: Truth) -> dict[str, Any]:
    """Of rooms and of locations: the share whose first name, and one of whose first three, is that of the true place.

    `aligned_map` is the graph moved onto the truth. A place without a name counts as wrong.
    """
    heights = np.array([[floor.z_m, floor.z_m + floor.height_m] for floor in truth.floors]).reshape(-1, 2)
    true_floor_of = {i: j for i, j, _ in match_floors(aligned_map.floors, heights)}
    room_floor = {room.id: room.floor for room in truth.rooms}
    rooms = [(room.floor, room.polygon) for room in truth.rooms]
    locations = [(room_floor[location.room], location.outline) for location in truth.locations]

    def scores(places: Sequence[MapPlace], true: Sequence[Area], kinds: list[str]) -> dict[str, Any]:
        areas: list[Area] = [(true_floor_of.get(place.floor, UNKNOWN_FLOOR), place.outline) for place in places]
        names = [[tag.name for tag in graph.nodes[place.id].tags] for place in places]
        return name_scores(names, overlaps(areas, true, CELL_M), kinds)

    return {
        "rooms": scores(aligned_map.rooms, rooms, [room.type for room in truth.rooms]),
        "locations": scores(aligned_map.locations, locations, [location.kind for location in truth.locations]),
    }


def name_scores(names: Sequence[Sequence[str]], areas: AreaOverlaps, kinds: Sequence[str]) -> dict[str, Any]:
    """Scores of F map places with these names, best first, that overlap T true ones of these kinds."""
    judged = [(own, kinds[i]) for own, i in zip(names, _true_place_indices(areas), strict=True) if i >= 0]

    def right(count: int) -> int:
        return sum(any(_is_same_name(name, kind) for name in own[:count]) for own, kind in judged)

    return {
        "map": len(names),
        "judged": len(judged),
        "top_1": ratio(right(1), len(judged)),
        f"top_{MAX_NAMES}": ratio(right(MAX_NAMES), len(judged)),
    }


def _true_place_indices(areas: AreaOverlaps) -> list[int]:
    """Of each map place the true one that holds most of it; -1: none holds enough."""
    if not areas.shared.size:
        return [-1] * len(areas.found)
    best = areas.shared.argmax(axis=1)
    inside = areas.shared.max(axis=1) / np.maximum(areas.found, 1)
    return [int(i) if enough else -1 for i, enough in zip(best, inside >= MIN_INSIDE, strict=True)]


def _is_same_name(name: str, kind: str) -> bool:
    name, kind = normal_form(name), normal_form(kind)
    return name == kind or kind in synonyms().get(name, ())
