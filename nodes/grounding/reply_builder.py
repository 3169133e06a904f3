"""Build the reply: the object found with its evidence and the route to it, or why there is none.

Source: paper, "Object Grounding". Not as in the paper: evidence, candidates, route and approach beside the object.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from placegraph.nodes.grounding.program import Thing
from placegraph.nodes.grounding.program_executor import ProgramExecutor
from placegraph.nodes.grounding.ranking import Ranking
from placegraph.runtime.messages import Question
from placegraph.runtime.query.reply import (
    ApproachPose,
    LayerSelection,
    PathStep,
    ProgramParse,
    RankedObject,
    Reply,
    ReplyViewpoint,
    error_reply,
)
from placegraph.runtime.scene_graph import GraphNode
from placegraph.runtime.scene_graph.route import find_route

MAX_ELSEWHERE = 5  # objects of that name in other places that are listed; chosen by hand


@dataclass(frozen=True, eq=False)
class ReplyBuilder:
    """Builds the reply to one question from a ranking of its graph."""

    question: Question
    revision: int
    executor: ProgramExecutor
    parse: ProgramParse | LayerSelection | None
    llm_calls: int

    def found(self, ranking: Ranking, *, sure: bool) -> Reply:
        """The reply with the best candidate; the ranking holds at least one."""
        best = ranking.candidates[0]
        node = best.node
        route, travel_m = self._route(node)
        approach = node.approach
        return Reply(
            status="found",
            object_id=node.id,
            name=node.name,
            box=_rounded(node.box),
            center=_rounded(node.center),
            path=[PathStep(id=step.id, layer=step.layer, name=step.name) for step in self.executor.graph.path(node.id)],
            approach=ApproachPose(position=_rounded(approach.position), yaw_rad=_rounded(approach.yaw_rad))
            if approach
            else None,
            route=route,
            travel_m=travel_m,
            evidence=[*ranking.notes, *best.evidence],
            candidates=[
                RankedObject(
                    id=candidate.node.id,
                    name=candidate.node.name,
                    score=round(candidate.score, 4),
                    evidence=candidate.evidence,
                )
                for candidate in ranking.candidates[: self.question.k]
            ],
            sure=sure,
            **self._common(node),
        )

    def not_in_map(self, ranking: Ranking, target: Thing) -> Reply:
        """The reply that nothing fits the target, and what is there instead."""
        graph, names = self.executor.graph, self.executor.names
        noun = "" if target.noun == "thing" else target.noun
        objects = graph.layer("object")
        where = " there" if any(condition.kind == "place" for condition in target.conditions) else " in the map"
        missing = f"is called {noun}" if noun else "fits the question"
        elsewhere = names.best_matches(noun, objects) if noun else []
        if elsewhere:
            listed = [f"{match.node.name} {match.node.id} in {self._place(match.node)}" for match in elsewhere]
            instead = f"elsewhere: {'; '.join(listed[:MAX_ELSEWHERE])}"
        else:
            nearest = names.nearest_names(noun, objects)
            instead = f"the nearest names in the map: {', '.join(nearest) or 'none'}"
        return Reply(
            status="not_in_map",
            evidence=[*ranking.notes, f"nothing{where} {missing}", instead],
            sure=ranking.sure and not elsewhere,
            **self._common(graph.building),
        )

    def _common(self, seen: GraphNode) -> dict[str, Any]:
        viewpoint = self.executor.viewpoint(seen)
        return {
            "question": self.question.text,
            "question_id": self.question.question_id,
            "parse": self.parse,
            "revision": self.revision,
            "llm_calls": self.llm_calls,
            "viewpoint": ReplyViewpoint(source=str(viewpoint.source), xyz=_rounded(viewpoint.xyz_world)),
        }

    def _route(self, node: GraphNode) -> tuple[list[str], float | None]:
        """The asker's route to a node: ids of rooms and connections in turn, and its length in metres.

        When the object itself cannot be reached, the route leads to the centre of its room. Empty, None: no route.
        """
        graph, start = self.executor.graph, self.executor.asker_world
        if not np.isfinite(start).all():
            return [], None
        room = graph.room_of(node.id)
        route = find_route(graph, start, node.id) or (find_route(graph, start, room) if room else None)
        return ([], None) if route is None else (list(route.ids), _rounded(route.length_m))

    def _place(self, node: GraphNode) -> str:
        parent = self.executor.graph.nodes[node.parent]
        return f"{parent.name} {parent.id}"


def failed_reply(question: Question, revision: int, reason: str) -> Reply:
    """The reply to a question that could not be answered, with the asker's position when it was given."""
    asker = question.viewpoint_world
    viewpoint = ReplyViewpoint(source="asker", xyz=_rounded(asker)) if np.isfinite(asker).all() else None
    reply = error_reply(reason, question.question_id, question.text, revision)
    return reply.model_copy(update={"viewpoint": viewpoint})


def _rounded(values: Any) -> Any:
    """Plain numbers rounded to 1 mm."""
    # adding 0.0 turns -0.0 into 0.0, so that equal answers print alike
    return (np.round(np.asarray(values, float), 3) + 0.0).tolist()
