"""Whether rooms and locations of a map bear the name of the true place in which they lie."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from placegraph.runtime.language.word_forms import normal_form, synonyms
from placegraph.runtime.scene_graph import SceneGraph
from placegraph.tools.evaluate.aligned_map import AlignedMap, MapPlace
from placegraph.tools.evaluate.places import Area, Overlaps, match_floors, overlaps, share
from placegraph.tools.simulator.ground_truth import Truth

MIN_INSIDE = 0.5  # of a map place that must lie in one true place; else it is of no one kind, and not judged
MAX_NAMES = 3
UNKNOWN_FLOOR = -1


def place_name_scores(graph: SceneGraph, aligned: AlignedMap, truth: Truth) -> dict[str, Any]:
    """Of rooms and of locations: the share whose first name, and one of whose first three, is that of the true place.

    `aligned` is the graph laid onto the truth. What holds nothing named has no name, and counts as wrong.
    """
    heights = np.array([[one.z_m, one.z_m + one.height_m] for one in truth.floors]).reshape(-1, 2)
    floor_of = {i: j for i, j, _ in match_floors(aligned.floors, heights)}
    room_floor = {room.id: room.floor for room in truth.rooms}
    rooms = [(room.floor, room.polygon) for room in truth.rooms]
    locations = [(room_floor[one.room], one.outline) for one in truth.locations]

    def scores(found: Sequence[MapPlace], true: list[Area], kinds: list[str]) -> dict[str, Any]:
        mine: list[Area] = [(floor_of.get(one.floor, UNKNOWN_FLOOR), one.outline) for one in found]
        names = [[tag.name for tag in graph.nodes[one.id].tags] for one in found]
        return name_scores(names, overlaps(mine, true), kinds)

    return {
        "rooms": scores(aligned.rooms, rooms, [room.type for room in truth.rooms]),
        "locations": scores(aligned.locations, locations, [one.kind for one in truth.locations]),
    }


def name_scores(names: Sequence[Sequence[str]], met: Overlaps, kinds: Sequence[str]) -> dict[str, Any]:
    """Scores of F map places with these names, best first, that overlap T true ones of these kinds."""
    judged = [(said, kinds[i]) for said, i in zip(names, _home(met), strict=True) if i >= 0]
    first = sum(any(_is_same(name, kind) for name in said[:1]) for said, kind in judged)
    among = sum(any(_is_same(name, kind) for name in said[:MAX_NAMES]) for said, kind in judged)
    return {
        "map": len(names),
        "judged": len(judged),
        "top_1": share(first, len(judged)),
        f"top_{MAX_NAMES}": share(among, len(judged)),
    }


def _home(met: Overlaps) -> list[int]:
    """Of each map place the true one that holds most of it; -1: none holds enough."""
    if not met.shared.size:
        return [-1] * len(met.found)
    best = met.shared.argmax(axis=1)
    inside = met.shared.max(axis=1) / np.maximum(met.found, 1)
    return [int(i) if holds else -1 for i, holds in zip(best, inside >= MIN_INSIDE, strict=True)]


def _is_same(name: str, kind: str) -> bool:
    name, kind = normal_form(name), normal_form(kind)
    return name == kind or kind in synonyms().get(name, ())
