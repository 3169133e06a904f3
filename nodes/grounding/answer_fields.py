"""Build the answer: the object found with its evidence and the route to it, or why there is none.

Source: paper, "Object Grounding". Not as in the paper: evidence, candidates, route and approach beside the object.
"""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from placegraph.nodes.grounding.name_matching import NameMatcher
from placegraph.nodes.grounding.program import Thing
from placegraph.nodes.grounding.program_executor import ProgramExecutor
from placegraph.nodes.grounding.ranking import Candidate, Ranking
from placegraph.runtime.arrays import F64
from placegraph.runtime.messages import Question
from placegraph.runtime.scene_graph import Node, SceneGraph
from placegraph.runtime.scene_graph.route import find_route

NO_ROUTE: dict[str, Any] = {"approach": None, "route": [], "travel_m": None}


def found(graph: SceneGraph, ranking: Ranking, executor: ProgramExecutor, k: int, sure: bool) -> dict[str, Any]:
    """The fields that say what the best candidate is; the ranking holds at least one."""
    best = ranking.candidates[0]
    view = executor.viewpoint(best.node)
    return {
        "status": "found",
        "object_id": best.node.id,
        "name": best.node.name,
        "box": numbers(best.node.box),
        "center": numbers(best.node.center),
        "path": [{"id": step.id, "layer": step.layer, "name": step.name} for step in graph.path(best.node.id)],
        "evidence": [*ranking.notes, *best.evidence],
        "candidates": [_candidate(candidate) for candidate in ranking.candidates[:k]],
        "sure": sure,
        **_route_fields(graph, best.node, executor.asker_world),
        "viewpoint": {"source": view.source, "xyz": numbers(view.xyz_world)},
    }


def not_in_map(
    graph: SceneGraph, target: Thing, ranking: Ranking, executor: ProgramExecutor, names: NameMatcher
) -> dict[str, Any]:
    """The fields that say that nothing fits, and what is there instead."""
    noun = "" if target.noun == "thing" else target.noun
    objects = graph.layer("object")
    where = " there" if any(condition.kind == "place" for condition in target.conditions) else " in the map"
    missing = f"is called {noun}" if noun else "fits the question"
    evidence = [*ranking.notes, f"nothing{where} {missing}"]
    elsewhere = names.best_matches(noun, objects) if noun else []
    if elsewhere:
        listed = [f"{fit.node.name} {fit.node.id} in {_place(graph, fit.node)}" for fit in elsewhere[:5]]
        evidence.append(f"elsewhere: {'; '.join(listed)}")
    else:
        nearest = names.nearest_names(noun, objects)
        evidence.append(f"the nearest names in the map: {', '.join(nearest) or 'none'}")
    view = executor.viewpoint(graph.building)
    return {
        "status": "not_in_map",
        "object_id": None,
        "name": None,
        "box": None,
        "center": None,
        "path": [],
        "evidence": evidence,
        "candidates": [],
        "sure": ranking.sure and not elsewhere,
        **NO_ROUTE,
        "viewpoint": {"source": view.source, "xyz": numbers(view.xyz_world)},
    }


def error_answer(question: Question, revision: int, reason: str) -> dict[str, Any]:
    """The fields of an answer that says why there is none."""
    asker = question.viewpoint_world
    has_position = bool(np.isfinite(asker).all())
    return {
        "status": "error",
        "error": reason,
        "question": question.text,
        "question_id": question.question_id,
        "object_id": None,
        "name": None,
        "box": None,
        "center": None,
        "path": [],
        "evidence": [],
        "candidates": [],
        "sure": False,
        **NO_ROUTE,
        "viewpoint": {"source": "asker", "xyz": numbers(asker)} if has_position else None,
        "parse": None,
        "revision": revision,
        "llm_calls": 0,
    }


def to_json(fields: dict[str, Any]) -> str:
    """Canonical JSON: sorted keys, no spaces; equal answers give equal bytes."""
    return json.dumps(fields, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False)


def _route_fields(graph: SceneGraph, node: Node, asker_world: F64) -> dict[str, Any]:
    """Where to stand before a node, and the route there: rooms and connections in turn, its length in m.

    When the object itself cannot be reached, the route leads to the centre of its room.
    """
    fields = dict(NO_ROUTE)
    if (approach := node.approach) is not None:
        fields["approach"] = {"position": numbers(approach.position), "yaw_rad": numbers(approach.yaw_rad)}
    if not np.isfinite(asker_world).all():
        return fields
    room = graph.room_of(node.id)
    route = find_route(graph, asker_world, node.id) or (find_route(graph, asker_world, room) if room else None)
    if route is None:
        return fields
    return fields | {"route": list(route.ids), "travel_m": numbers(route.length_m)}


def _candidate(candidate: Candidate) -> dict[str, Any]:
    return {
        "id": candidate.node.id,
        "name": candidate.node.name,
        "score": round(candidate.score, 4),
        "evidence": candidate.evidence,
    }


def numbers(values: Any) -> Any:
    """Plain numbers to 1 mm."""
    # adding 0.0 turns -0.0 into 0.0, so that equal answers print alike
    return (np.round(np.asarray(values, float), 3) + 0.0).tolist()


def _place(graph: SceneGraph, node: Node) -> str:
    parent = graph.nodes[node.parent]
    return f"{parent.name} {parent.id}"
