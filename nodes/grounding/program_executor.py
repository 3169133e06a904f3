"""Run a program on a scene graph: the target's candidates, ranked, each with the sentences that say why.

Source: paper, "Object Grounding". Not as in the paper: geometry computed in code ranks the candidates, not the language
model.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from placegraph.nodes.grounding.box_arrays import Boxes, Layout, layout_of
from placegraph.nodes.grounding.conditions import SURFACE_NAMES, ConditionScorer, names_a_kind
from placegraph.nodes.grounding.name_matching import NameMatch, NameMatcher
from placegraph.nodes.grounding.program import SAME_KIND, Program, Thing
from placegraph.nodes.grounding.ranking import Candidate, Ranking
from placegraph.nodes.grounding.scoring import ScoredCandidates
from placegraph.nodes.grounding.search_scope import SearchScope, match_places, narrow_scope
from placegraph.nodes.grounding.settings import DEFAULTS, GroundingSettings
from placegraph.nodes.grounding.viewpoint import ASKER, ROOM_CENTER, ViewpointSelector, ViewpointSource
from placegraph.nodes.grounding.word_lists import word_list
from placegraph.runtime.arrays import F64
from placegraph.runtime.language.word_forms import normal_form
from placegraph.runtime.scene_graph import GraphNode, SceneGraph, id_key

MAX_LISTED = (
    50  # candidates with evidence; as many as a request may ask for (MAX_CANDIDATES of runtime/query/request.py)
)
ENTRANCE_WORDS = frozenset(word_list("entrance"))


@dataclass(frozen=True)
class ReportedViewpoint:
    """The point (3,) in metres, world frame, from which left, right, front and behind were judged, and what it is."""

    source: ViewpointSource
    xyz_world: F64


class ProgramExecutor:
    """Executes programs on one graph for one asker."""

    def __init__(
        self,
        graph: SceneGraph,
        names: NameMatcher,
        asker_world: F64,
        heading_rad: float = np.nan,
        layout: Layout | None = None,
        settings: GroundingSettings = DEFAULTS,
    ) -> None:
        """asker_world: (3,) metres, world frame; heading_rad: about z from +x; NaN when not given.

        layout: the graph's, when it is already computed.
        """
        self.graph, self.names, self.settings = graph, names, settings
        self.asker_world = asker_world
        self.layout = layout or layout_of(graph)
        self.viewpoints = ViewpointSelector(
            self.layout, self.layout.from_world(asker_world), heading_rad - self.layout.yaw, settings
        )

    def viewpoint(self, node: GraphNode) -> ReportedViewpoint:
        """From where a node is seen: what the request names, else the asker, else the centre of the node's room."""
        viewpoint = self.viewpoints.explicit
        height = float(node.center[2])
        if viewpoint is self.viewpoints.asker and viewpoint is not None:
            return ReportedViewpoint(ASKER, self.asker_world)
        if viewpoint is not None:
            return ReportedViewpoint(viewpoint.source, self.layout.to_world(np.array([*viewpoint.eye, height])))
        room = self.graph.room_of(node.id)
        center = (self.graph.nodes[room] if room else self.graph.building).center
        return ReportedViewpoint(ROOM_CENTER, center)

    def scope(self, target: Thing) -> SearchScope:
        """The part of the graph that the target's place words restrict the search to."""
        everywhere = SearchScope(self.graph.layer("object"), [])
        return narrow_scope(self.graph, target, self.names, self._conditions(everywhere, Ranking()).rank_places)

    def rank(self, program: Program, scope: SearchScope | None = None) -> Ranking:
        """Rank the candidates for the program's target; empty when nothing has its name or nothing fits."""
        scope = scope or self.scope(program.target)
        ranking = Ranking(notes=list(scope.notes), sure=scope.sure)
        conditions, target = self._conditions(scope, ranking), scope.thing
        self._choose_viewpoint(target, conditions)
        matches = self._match_targets(target.noun, scope, ranking)
        if matches:
            scored = conditions.score(target, conditions.boxes(matches), matches, target)
            self._fill_ranking(ranking, target, scored, matches)
        return ranking

    def _nearest_to_asker(self, things: Boxes) -> Boxes:
        """Of several things to stand at, those that the asker stands at; all of them when there is none such."""
        distances_m = np.linalg.norm(things.center[:, :2] - self.asker_world[:2], axis=1)
        same_storey = np.abs(things.low[:, 2] - self.asker_world[2]) <= self.settings.viewpoint.storey_m
        rows = np.flatnonzero((distances_m <= self.settings.viewpoint.at_door_m) & same_storey)
        return things.take(rows) if len(rows) else things

    def _conditions(self, scope: SearchScope, ranking: Ranking) -> ConditionScorer:
        return ConditionScorer(self.graph, self.names, self.layout, self.viewpoints, scope, ranking)

    def _fill_ranking(
        self, ranking: Ranking, target: Thing, scored: ScoredCandidates, matches: Sequence[NameMatch]
    ) -> None:
        """Put the best candidates into the ranking, those that hold before the others."""
        scores = scored.scores
        keys = [(not scored.holds[i], -scores[i], id_key(matches[i].node.id)) for i in range(len(matches))]
        listed = sorted(range(len(matches)), key=keys.__getitem__)
        if scores.max() > self.settings.scores.much_better_ratio * scores[listed[0]]:
            listed = sorted(listed, key=lambda i: (-scores[i], keys[i]))
        for i in listed[:MAX_LISTED]:
            naming = [f"{scored.boxes.labels[i]} is called {matches[i].tag}"] if names_a_kind(target.noun) else []
            evidence = [*naming, *scored.evidence(i)]
            ranking.candidates.append(Candidate(matches[i].node, float(scores[i]), evidence, bool(scored.holds[i])))
        best = ranking.candidates[0]
        ranking.sure &= best.holds
        if names_a_kind(target.noun):
            return
        has_relation = any(c.kind == "relation" and not c.negated for c in target.conditions)
        if not best.holds and has_relation and target.noun != SAME_KIND:
            # "what is under the bed?": without a name, only what really is there is an answer
            ranking.notes += best.evidence
            ranking.candidates.clear()
        elif len(matches) > 1 and scores.max() - scores.min() < self.settings.scores.tie_margin:
            ranking.note("nothing that is said tells one thing from another")
            ranking.candidates.clear()

    def _match_targets(self, noun: str, scope: SearchScope, ranking: Ranking) -> list[NameMatch]:
        """What the noun names in the scope: objects, or places when those have the better-fitting name."""
        if not names_a_kind(noun):
            return [NameMatch(node, 1.0, node.name) for node in scope.objects if node.name not in SURFACE_NAMES]
        objects = self.names.matches(noun, scope.objects)
        places = match_places(noun, scope.places, self.names)
        best = max((match.score for match in objects), default=0.0)
        if any(match.score > best for match in places):
            return places
        if not objects and not self.names.is_known(noun, self.graph.layer("object")):
            objects = self.names.nearest_matches(noun, scope.objects)
            if objects:
                ranking.note(f"nothing is called {noun}; {objects[0].tag} is the nearest name")
        return objects

    def _choose_viewpoint(self, target: Thing, conditions: ConditionScorer) -> None:
        """Set the viewpoint that the request names ("standing at the door", "facing the window")."""
        self.viewpoints.requested = None
        choices = {
            "from": self.viewpoints.at,
            "back": self.viewpoints.with_back_to,
            "looking": self.viewpoints.in_front_of_most,
        }
        for condition in target.conditions:
            if condition.kind != "view":
                continue
            thing = condition.things[0]
            words = set(normal_form(thing.noun).split())
            if words and words <= ENTRANCE_WORDS:
                thing = thing.model_copy(update={"noun": "door"})
            anchors = conditions.anchors(thing, target, 1)
            if anchors is None:
                conditions.ranking.note(f"nothing in the map is called {thing.noun}, so nobody looks from there")
                continue
            self.viewpoints.requested = choices[condition.name](
                self._nearest_to_asker(anchors.best(min_weight=self.settings.viewpoint.min_faced_share))
            )
            conditions.clear_anchors()  # they were scored from another viewpoint
