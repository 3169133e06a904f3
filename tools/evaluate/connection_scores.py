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
from placegraph.tools.evaluate.place_overlap import ratio
from placegraph.tools.simulator.ground_truth import TrueConnection, Truth

KINDS = {"doors": ("door", "opening", "archway"), "stairs": ("stairs",)}
MAX_DISTANCE_M = {"doors": 0.5, "stairs": 1.0}  # of the worse end, for a found one to be right; chosen by hand
MIN_TRAVEL_M = 1.0  # the ratio of a shorter way mostly says where the door's middle was placed
FORBIDDEN = 1e6  # cost of a pair that is too far apart


def connection_scores(
    graph: SceneGraph, true_from_map: F64, truth: Truth, seen_rooms: frozenset[int]
) -> dict[str, Any]:
    """Precision and recall of doors (archways and openings included) and of stairs, width errors, ratio of travel.

    true_from_map: (4, 4). Recall is of true connections between rooms that the walk saw; precision is of all found
    ones against all true ones, so that an opening between two halves of one room counts as wrong. The travel distance
    between two right connections of one floor is compared with the true one.
    """
    true_connections = truth.connections or ()
    true_of: dict[str, TrueConnection] = {}
    scores: dict[str, Any] = {}
    for group, kinds in KINDS.items():
        found = [connection for connection in graph.connections.values() if connection.kind in kinds]
        true = [connection for connection in true_connections if connection.kind in kinds]
        pairs = match_connections(found, true, true_from_map, MAX_DISTANCE_M[group])
        true_of |= pairs
        seen = {connection.id for connection in true if seen_rooms >= set(connection.rooms)}
        hit = {connection.id for connection in pairs.values()}
        width_errors = [abs(graph.connections[i].width_m - connection.width_m) for i, connection in pairs.items()]
        scores[group] = {
            "truth": len(seen),
            "of": len(true),
            "map": len(found),
            "precision": ratio(len(pairs), len(found)),
            "recall": ratio(len(hit & seen), len(seen)),
            "width_error_m": _mean(width_errors),
        }
    return scores | {"travel": _travel_ratios(graph, true_of)}


def match_connections(
    found: list[Connection], true: list[TrueConnection], true_from_map: F64, max_distance_m: float
) -> dict[str, TrueConnection]:
    """The true connection of each found one by its id: one to one, none too far apart, least total distance."""
    if not found or not true:
        return {}
    distance = np.array(
        [
            [np.linalg.norm(transform(true_from_map, a.ends) - b.ends, axis=1).max() for b in true]
            for a in found
        ]
    )  # fmt: skip
    cost = np.where(distance <= max_distance_m, distance, FORBIDDEN)
    rows, columns = linear_sum_assignment(cost)
    return {found[i].id: true[j] for i, j in zip(rows, columns, strict=True) if cost[i, j] < FORBIDDEN}


def _travel_ratios(graph: SceneGraph, true_of: Mapping[str, TrueConnection]) -> dict[str, Any]:
    ratios = []
    for ids, length_m in sorted(travel_lengths(graph).items()):
        if all(connection_id in true_of for connection_id in ids):
            a, b = sorted((true_of[connection_id] for connection_id in ids), key=lambda connection: connection.id)
            true_length_m = dict(a.travel_m).get(b.id, 0.0)
            if true_length_m >= MIN_TRAVEL_M:
                ratios.append(length_m / true_length_m)
    return {
        "pairs": len(ratios),
        "mean_ratio": _mean(ratios),
        "min_ratio": min(ratios, default=float("nan")),
        "max_ratio": max(ratios, default=float("nan")),
    }


def travel_lengths(graph: SceneGraph) -> dict[tuple[str, str], float]:
    """Metres between any two connections of one floor, through any of its rooms; unconnected pairs are left out."""
    floor_of = {room.id: room.parent for room in graph.layer("room")}
    stops = sorted(
        {(end, floor_of[way.room]) for way in graph.route_segments for end in way.ends if end in graph.connections}
    )
    index = {stop: i for i, stop in enumerate(stops)}
    lengths = np.full((len(stops), len(stops)), np.inf)
    for way in graph.route_segments:
        if all(end in graph.connections for end in way.ends):
            i, j = sorted(index[(end, floor_of[way.room])] for end in way.ends)
            lengths[i, j] = min(lengths[i, j], way.length_m)  # two rooms may share two doors: the shortest way counts
    if not stops:
        return {}
    shortest = dijkstra(csgraph_from_dense(lengths, null_value=np.inf), directed=False)
    return {
        (stops[i][0], stops[j][0]): float(shortest[i, j])
        for i in range(len(stops))
        for j in range(i + 1, len(stops))
        if np.isfinite(shortest[i, j])
    }


def _mean(values: list[float]) -> float:
    return ratio(sum(values), len(values))
