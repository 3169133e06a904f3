"""Apply a thing's conditions to its candidates: appearance, groups, relations, then ranks. Anchors are scored the same
way, recursively.

Not as in the paper: all candidates of an anchor take part, weighted by how well they fit, so that one misread inner
condition does not exclude the right answer. A condition that the map holds no evidence for has no effect and is noted.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from placegraph.nodes.grounding.anchor_matching import Anchors, fits_without_anchor, match_anchors
from placegraph.nodes.grounding.attributes import appearance_fits
from placegraph.nodes.grounding.box_arrays import Boxes, Layout, RoomPart
from placegraph.nodes.grounding.groups import group_fits
from placegraph.nodes.grounding.name_matching import NameMatch, NameMatcher
from placegraph.nodes.grounding.program import ANYTHING, SAME_KIND, Condition, Thing
from placegraph.nodes.grounding.program_syntax import format_program
from placegraph.nodes.grounding.ranking import Ranking
from placegraph.nodes.grounding.relations import RelationQuery, rank_positions
from placegraph.nodes.grounding.scoring import ScoredCandidates
from placegraph.nodes.grounding.search_scope import SearchScope, match_places, narrow_scope
from placegraph.nodes.grounding.viewpoint import ViewpointSelector
from placegraph.runtime.language.word_forms import normal_form
from placegraph.runtime.scene_graph import GraphNode, SceneGraph, id_key

MAX_PAIRS = 600_000  # pairs of targets and anchors evaluated at once; bounds memory on large maps
SURFACE_NAMES = ("wall", "floor", "ceiling")  # never meant by "something", "what is under the bed"
GENERIC_NOUNS = ("", ANYTHING, SAME_KIND, "object", "item", "something", "anything")
SAME_KIND_NOUNS = (SAME_KIND, "other", "rest")
ROOM_PARTS = {
    "floor": RoomPart.FLOOR, "ground": RoomPart.FLOOR, "wall": RoomPart.WALL, "ceiling": RoomPart.CEILING,
    "corner": RoomPart.CORNER, "room": RoomPart.ROOM, "middle": RoomPart.CENTER, "center": RoomPart.CENTER,
    "centre": RoomPart.CENTER,
}  # fmt: skip


SCORED_KINDS = ("look", "group", "relation", "rank")


def names_a_kind(noun: str) -> bool:
    """Whether a noun names a kind of thing; "something" and "thing" do not."""
    return normal_form(noun) not in GENERIC_NOUNS


class ConditionScorer:
    """Scores the candidates of one request on one map. What could not be followed goes into the ranking's notes."""

    def __init__(
        self,
        graph: SceneGraph,
        names: NameMatcher,
        layout: Layout,
        viewpoints: ViewpointSelector,
        scope: SearchScope,
        ranking: Ranking,
    ) -> None:
        self.graph, self.names, self.layout, self.viewpoints = graph, names, layout, viewpoints
        self.scope, self.ranking, self.settings = scope, ranking, viewpoints.settings
        self._anchors_by_thing: dict[Thing, Anchors | None] = {}

    def clear_anchors(self) -> None:
        """Forget the anchors found so far: with another viewpoint their scores change."""
        self._anchors_by_thing.clear()

    def boxes(self, matches: Sequence[NameMatch]) -> Boxes:
        """The boxes of matched nodes."""
        return self.layout.all.take([self.layout.row[fit.node.id] for fit in matches])

    def rank_places(self, place: Thing, matches: Sequence[NameMatch]) -> list[GraphNode]:
        """The matched places that fit the place's conditions best; all of them when it has none."""
        if not place.conditions:
            return [fit.node for fit in matches]
        scored = self.score(place, self.boxes(matches), matches, place)
        rank_positions = sorted(range(len(matches)), key=lambda i: (-scored.scores[i], id_key(matches[i].node.id)))
        best = scored.scores[rank_positions[0]]
        return [
            matches[i].node for i in rank_positions if scored.scores[i] >= self.settings.scores.same_place_share * best
        ]

    def score(self, thing: Thing, boxes: Boxes, matches: Sequence[NameMatch] | None, target: Thing) -> ScoredCandidates:
        """Apply all conditions of a thing to its candidates; ranks last: "the largest near the table" is near it.

        fits: the candidates' nodes with the scores of their names; None when boxes are parts of rooms.
        target: the request's target, whose noun "one" stands for.
        """
        nodes: list[GraphNode | None] = [fit.node for fit in matches] if matches else [None] * len(boxes)
        scores = np.array([fit.score for fit in matches]) if matches else np.ones(len(boxes))
        conditions = [condition for condition in thing.conditions if condition.kind in SCORED_KINDS]
        scored = ScoredCandidates(boxes, nodes, scores, self.settings.scores, narrowed=bool(conditions))
        for condition in conditions:
            if condition.kind == "look":
                self._apply_appearance(scored, condition)
        reference: Boxes | None = None
        for condition in conditions:
            if condition.kind == "group":
                self._apply_group(scored, condition)
            elif condition.kind == "relation":
                reference = self._apply_relation(scored, condition, target) or reference
        if thing is self.scope.thing:
            for condition in self.scope.hints:
                self._apply_hint(scored, condition, target, self.settings.scores.weak_trust)
        for condition in conditions:
            if condition.kind == "rank":
                self._apply_rank(scored, condition, target, reference)
        return scored

    def _apply_appearance(self, scored: ScoredCandidates, condition: Condition) -> None:
        nodes = [node for node in scored.nodes if node is not None]
        if len(nodes) < len(scored):
            return
        appearance = appearance_fits(condition.words, nodes, scored.boxes, scored.peers, self.settings.appearance)
        if not appearance.known:
            self.ranking.note(f"the map does not tell what is {condition.words}")
        if appearance.known or not condition.negated:  # without evidence a negation does not hold either
            scored.apply_fits(appearance.values, appearance.sentences.__getitem__, negated=condition.negated)

    def _apply_group(self, scored: ScoredCandidates, condition: Condition) -> None:
        is_compared = scored.rankable() if condition.name == "count" else scored.peers
        values, sentence = group_fits(scored.boxes, np.flatnonzero(is_compared), condition, self.settings.groups)
        scored.apply_fits(values, sentence, negated=condition.negated)

    def _apply_relation(self, scored: ScoredCandidates, condition: Condition, target: Thing) -> Boxes | None:
        """Apply a relation; returns its best anchors, from which ranks ("the left one") take their viewpoint."""
        anchors: list[Anchors] = []
        for inner in condition.things:
            candidates = self.anchors(inner, target, len(scored))
            if candidates is None:
                self.ranking.note(f"nothing in the map is called {inner.noun}, so {condition.name} decides nothing")
                return None
            anchors.append(candidates)
        outcome = match_anchors(condition, scored.boxes, anchors, self.layout, self.viewpoints)
        if not outcome.known:
            self.ranking.note(
                f"the map holds nothing about {format_program(Thing(noun='x', conditions=(condition,)))[3:]}"
            )
            if condition.negated:
                return None
        scored.apply_fits(outcome.values, outcome.sentence, trust=outcome.trust, negated=condition.negated)
        for inner, candidates in zip(condition.things, anchors, strict=True):
            if candidates.is_unique and not condition.negated:
                self._apply_anchor_conditions(scored, inner, target)
        return anchors[0].best() if anchors and not condition.negated else None

    def _apply_anchor_conditions(self, scored: ScoredCandidates, anchor: Thing, target: Thing) -> None:
        """Let an unambiguous anchor's relations count a little for the target.

        With one table in the map, "the cup on the table near the window" may well mean the cup near the window.
        """
        for condition in anchor.conditions:
            if condition.kind == "relation" and not condition.negated:
                self._apply_hint(scored, condition, target, self.settings.scores.anchor_condition_trust)

    def _apply_hint(self, scored: ScoredCandidates, condition: Condition, target: Thing, trust: float) -> None:
        """Raise the scores of what a relation fits, without demanding that it holds."""
        anchors = self._all_anchors(condition, target, len(scored))
        if anchors:
            outcome = match_anchors(condition, scored.boxes, anchors, self.layout, self.viewpoints)
            values = 1 - outcome.values if condition.negated else outcome.values
            scored.apply_hint(values, outcome.sentence, trust)

    def _apply_rank(
        self, scored: ScoredCandidates, condition: Condition, target: Thing, reference: Boxes | None
    ) -> None:
        anchors = self._all_anchors(condition, target, len(scored))
        if anchors is None:
            noun = condition.things[0].noun
            self.ranking.note(f"nothing in the map is called {noun}, so {condition.name} decides nothing")
            return
        rows = np.flatnonzero(scored.rankable())
        measure = np.full(len(scored), np.nan)
        peers = scored.boxes.take(rows)
        if anchors:
            outcome = match_anchors(condition, peers, anchors, self.layout, self.viewpoints)
        else:
            query = RelationQuery(condition.name, peers, None, self.layout, self.viewpoints, reference=reference)
            outcome = fits_without_anchor(query)
        measure[rows] = outcome.values
        number = condition.number or 1
        if condition.name == "middle":
            measure[rows] = -np.abs(rank_positions(outcome.values) - (len(rows) + 1) / 2)
        peer_of_row = {int(row): k for k, row in enumerate(rows)}
        labels = scored.boxes.labels
        scored.apply_rank(
            measure,
            number,
            0.0 if condition.name == "middle" else outcome.margin,
            lambda i: (
                f"{outcome.sentence(peer_of_row[i])}, {condition.name} first" if i in peer_of_row else str(labels[i])
            ),
            trust=outcome.trust,
            negated=condition.negated,
        )

    def _all_anchors(self, condition: Condition, target: Thing, target_count: int) -> list[Anchors] | None:
        """The candidates of each of a condition's anchors; None when one of them has none."""
        anchors = [self.anchors(inner, target, target_count) for inner in condition.things]
        found = [candidates for candidates in anchors if candidates is not None]
        return found if len(found) == len(anchors) else None

    def anchors(self, thing: Thing, target: Thing, target_count: int) -> Anchors | None:
        """The scored candidates of an anchor; None when nothing in the map has its name."""
        if thing not in self._anchors_by_thing:
            self._anchors_by_thing[thing] = self._match_anchors(thing, target)
        anchors = self._anchors_by_thing[thing]
        return anchors and anchors.top(max(MAX_PAIRS // max(target_count, 1), 1))

    def _match_anchors(self, thing: Thing, target: Thing) -> Anchors | None:
        noun, trust = normal_form(thing.noun), 1.0
        if noun in SAME_KIND_NOUNS:
            noun = normal_form(target.noun)
        scope = self.scope
        if any(condition.kind == "place" for condition in thing.conditions):
            scope = narrow_scope(self.graph, thing, self.names, self.rank_places)
            thing = scope.thing
        matches: list[NameMatch] = []
        if not names_a_kind(noun):
            matches = [NameMatch(node, 1.0, node.name) for node in scope.objects if node.name not in SURFACE_NAMES]
        elif noun not in ROOM_PARTS or noun in ("wall", "ceiling"):
            matches = self.names.matches(noun, scope.objects) or self.names.matches(noun, self.graph.layer("object"))
            matches = matches or match_places(noun, scope.places, self.names)
        room_parts = self.layout.room_parts(ROOM_PARTS[noun]) if noun in ROOM_PARTS else None
        if not matches and room_parts is None:
            matches, trust = self.names.nearest_matches(noun, scope.objects), self.settings.scores.weak_trust
            if matches:
                self.ranking.note(f"nothing is called {noun}; {matches[0].tag} is the nearest name")
        parts = [self.score(thing, self.boxes(matches), matches, target)] if matches else []
        if room_parts is not None:
            parts.append(self.score(thing, room_parts, None, target))
        count = next((condition.number for condition in thing.conditions_named("count")), 0)
        return Anchors.from_scores(parts, trust, count) if parts else None
