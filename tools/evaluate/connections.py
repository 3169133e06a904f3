"""Connections of a map against the true doors, archways and stairs of its house, and its travel distances."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.sparse.csgraph import csgraph_from_dense, dijkstra

from placegraph.runtime.arrays import F64
from placegraph.runtime.scene_graph import SceneGraph
from placegraph.runtime.scene_graph.place_graph import Connection
from placegraph.runtime.vision.geometry import transform
from placegraph.tools.evaluate.places import share
from placegraph.tools.simulator.ground_truth import TrueConnection, Truth

NEAR_M = {"doors": 0.5, "stairs": 1.0}  # a found one is right when its middle, or the worse of its ends, is so near
MIN_TRAVEL_M = 1.0  # ratios of shorter ways say more about where the door's middle was put
FAR = 1e6


def connection_scores(
    graph: SceneGraph, true_from_map: F64, truth: Truth, seen_rooms: frozenset[int]
) -> dict[str, Any]:
    """Precision and recall of doors (archways and openings included) and of stairs; errors; ratio of travel.

    true_from_map: (4, 4). Recall is of true connections between rooms that the walk saw; precision is of all found
    ones against all true ones, so that an opening between two halves of one room counts as wrong. The travel
    between two right connections of one floor is compared with the true one.
    """
    true = truth.connections or ()
    right: dict[str, TrueConnection] = {}
    found: dict[str, Any] = {}
    for what, kinds in (("doors", ("door", "opening", "archway")), ("stairs", ("stairs",))):
        mine = [one for one in graph.connections.values() if one.kind in kinds]
        theirs = [one for one in true if one.kind in kinds]
        pairs = match(mine, theirs, true_from_map, NEAR_M[what])
        right |= pairs
        seen = {one.id for one in theirs if seen_rooms >= set(one.rooms)}
        hit = {one.id for one in pairs.values()}
        found[what] = {
            "truth": len(seen),
            "of": len(theirs),
            "map": len(mine),
            "precision": share(len(pairs), len(mine)),
            "recall": share(len(hit & seen), len(seen)),
            "width_error_m": _mean([abs(graph.connections[i].width_m - one.width_m) for i, one in pairs.items()]),
        }
    return found | {"travel": _travel(graph, right)}


def match(
    found: list[Connection], true: list[TrueConnection], true_from_map: F64, near_m: float
) -> dict[str, TrueConnection]:
    """The true connection of each found one's id, each once, at most `near_m` apart, by the least total distance."""
    if not found or not true:
        return {}
    apart = np.array([[_apart(transform(true_from_map, one.ends), other.ends) for other in true] for one in found])
    cost = np.where(apart <= near_m, apart, FAR)
    rows, columns = linear_sum_assignment(cost)
    return {found[i].id: true[j] for i, j in zip(rows, columns, strict=True) if cost[i, j] < FAR}


def _apart(one: F64, other: F64) -> float:
    return float(np.linalg.norm(one - other, axis=1).max())


def _travel(graph: SceneGraph, right: Mapping[str, TrueConnection]) -> dict[str, Any]:
    found = travel_lengths(graph)
    ratios = []
    for (one, other), length in sorted(found.items()):
        if one in right and other in right:
            a, b = sorted((right[one], right[other]), key=lambda true: true.id)
            true_length = dict(a.travel_m).get(b.id, 0.0)
            if true_length >= MIN_TRAVEL_M:
                ratios.append(length / true_length)
    return {
        "pairs": len(ratios),
        "mean_ratio": _mean(ratios),
        "min_ratio": min(ratios, default=float("nan")),
        "max_ratio": max(ratios, default=float("nan")),
    }


def travel_lengths(graph: SceneGraph) -> dict[tuple[str, str], float]:
    """Metres between each two connections of one floor, through any of its rooms; without those that no way joins."""
    floor_of = {room.id: room.parent for room in graph.layer("room")}
    places = sorted({(end, floor_of[way.room]) for way in graph.ways for end in way.ends if end in graph.connections})
    number = {place: i for i, place in enumerate(places)}
    # the shortest of several ways: two rooms may be joined by the same two doors
    lengths = np.full((len(places), len(places)), np.inf)
    for way in graph.ways:
        if all(end in graph.connections for end in way.ends):
            i, j = sorted(number[(end, floor_of[way.room])] for end in way.ends)
            lengths[i, j] = min(lengths[i, j], way.length_m)
    if not len(places):
        return {}
    shortest = dijkstra(csgraph_from_dense(lengths, null_value=np.inf), directed=False)
    return {
        (places[i][0], places[j][0]): float(shortest[i, j])
        for i in range(len(places))
        for j in range(i + 1, len(places))
        if np.isfinite(shortest[i, j])
    }


def _mean(values: list[float]) -> float:
    return share(sum(values), len(values))
