"""The conditions of a thing applied to all that it may be: looks, groups, relations, then ranks; anchors the same way.

Source: METHOD section 10, steps 3 and 4. Departs: soft all the way down: the things that an anchor may be enter with
how well each fits, so that one wrong inner condition does not kill the right answer; what the map holds no evidence
for decides nothing and leaves doubt.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from placegraph.nodes.grounding.anchor_matching import Anchors, fits_without_anchor, match_anchors
from placegraph.nodes.grounding.attributes import appearance_fits
from placegraph.nodes.grounding.box_arrays import Boxes, Layout
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
from placegraph.runtime.scene_graph import Node, SceneGraph, id_key

MAX_PAIRS = 600_000  # departs: of targets and anchors judged at once; bounds memory on large maps
FAIR_TRUST = 0.5  # departs: what is only likely to be called so decides half
SPARE_TRUST = 0.3  # departs: "the cup on the table near the window" with one table: the cup near the window
HINT_TRUST = 0.5  # departs: "in the bathroom" of a map without rooms: near the toilet
SAME_PLACE = 0.9  # departs: places whose score is at least this share of the best are meant together
SURFACE_NAMES = ("wall", "floor", "ceiling")  # never meant by "something", "what is under the bed"
GENERIC_NOUNS = ("", ANYTHING, SAME_KIND, "object", "item", "something", "anything")
SAME_KIND_NOUNS = (SAME_KIND, "other", "rest")
ROOM_PARTS = {
    "floor": "floor", "ground": "floor", "wall": "wall", "ceiling": "ceiling", "corner": "corner", "room": "room",
    "middle": "center", "center": "center", "centre": "center",
}  # fmt: skip


def names_a_kind(noun: str) -> bool:
    """Whether a noun names a kind of thing."""
    return normal_form(noun) not in GENERIC_NOUNS


class ConditionScorer:
    """Weighs the things of one request on one map; what must be said of it goes into the ranking's notes."""

    def __init__(
        self, graph: SceneGraph, names: NameMatcher, layout: Layout, viewpoints: ViewpointSelector, scope: SearchScope, ranking: Ranking
    ) -> None:
        self.graph, self.names, self.layout, self.viewpoints = graph, names, layout, viewpoints
        self.scope, self.ranking = scope, ranking
        self._anchors_by_thing: dict[Thing, Anchors | None] = {}

    def clear_anchors(self) -> None:
        """Find all anchors anew."""
        self._anchors_by_thing.clear()

    def boxes(self, fits: Sequence[NameMatch]) -> Boxes:
        """The boxes of what fits."""
        return self.layout.all.take([self.layout.row[fit.node.id] for fit in fits])

    def rank_places(self, place: Thing, fits: Sequence[NameMatch]) -> list[Node]:
        """The places called so that the conditions of a place fit best; all of them without conditions."""
        if not place.conditions:
            return [fit.node for fit in fits]
        scored = self.score(place, self.boxes(fits), fits, place)
        rank_positions = sorted(range(len(fits)), key=lambda i: (-scored.scores[i], id_key(fits[i].node.id)))
        best = scored.scores[rank_positions[0]]
        return [fits[i].node for i in rank_positions if scored.scores[i] >= SAME_PLACE * best]

    def score(self, thing: Thing, boxes: Boxes, fits: Sequence[NameMatch] | None, target: Thing) -> ScoredCandidates:
        """Apply all conditions of a thing to those it may be; ranks last: "the largest near the table" is near."""
        nodes: list[Node | None] = [fit.node for fit in fits] if fits else [None] * len(boxes)
        scores = np.array([fit.score for fit in fits]) if fits else np.ones(len(boxes))
        own = [one for one in thing.conditions if one.kind not in ("view", "place", "purpose")]
        scored = ScoredCandidates(boxes, nodes, scores, narrowed=bool(own))
        rest = [one for one in own if one.kind not in ("look", "rank")]
        for condition in own:
            if condition.kind == "look":
                self._apply_appearance(scored, condition)
        reference: Boxes | None = None
        for condition in rest:
            if condition.kind == "group":
                self._apply_group(scored, condition)
            else:
                reference = self._apply_relation(scored, condition, target) or reference
        if thing is self.scope.thing:
            for condition in self.scope.hints:
                self._apply_hint(scored, condition, target, HINT_TRUST)
        for condition in own:
            if condition.kind == "rank":
                self._apply_rank(scored, condition, target, reference)
        return scored

    def _apply_appearance(self, scored: ScoredCandidates, condition: Condition) -> None:
        nodes = [node for node in scored.nodes if node is not None]
        if len(nodes) < len(scored):
            return
        seen = appearance_fits(condition.words, nodes, scored.boxes, scored.peers)
        if not seen.known:
            self.ranking.note(f"the map does not tell what is {condition.words}")
        if seen.known or not condition.negated:  # what is not known to be so is not known not to be so
            scored.apply_fits(seen.values, seen.sentences.__getitem__, negated=condition.negated)

    def _apply_group(self, scored: ScoredCandidates, condition: Condition) -> None:
        among = scored.rankable() if condition.name == "count" else scored.peers
        values, told = group_fits(scored.boxes, np.flatnonzero(among), condition)
        scored.apply_fits(values, told, negated=condition.negated)

    def _apply_relation(self, scored: ScoredCandidates, condition: Condition, target: Thing) -> Boxes | None:
        """Apply a relation; returns the best of its anchors, which say from where a row is seen."""
        anchors: list[Anchors] = []
        for inner in condition.things:
            found = self.anchors(inner, target, len(scored))
            if found is None:
                self.ranking.note(f"nothing in the map is called {inner.noun}, so {condition.name} decides nothing")
                return None
            anchors.append(found)
        outcome = match_anchors(condition, scored.boxes, anchors, self.layout, self.viewpoints)
        if not outcome.known:
            self.ranking.note(f"the map holds nothing about {format_program(Thing(noun='x', conditions=(condition,)))[3:]}")
            if condition.negated:
                return None
        scored.apply_fits(outcome.values, outcome.sentence, trust=outcome.trust, negated=condition.negated)
        for inner, found in zip(condition.things, anchors, strict=True):
            if found.is_unique and not condition.negated:
                self._apply_anchor_conditions(scored, inner, target)
        return anchors[0].best() if anchors and not condition.negated else None

    def _apply_anchor_conditions(self, scored: ScoredCandidates, anchor: Thing, target: Thing) -> None:
        """Let what is said of an anchor that needs it not (there is one such thing) speak for the target, a little."""
        for condition in (one for one in anchor.conditions if one.kind == "relation" and not one.negated):
            self._apply_hint(scored, condition, target, SPARE_TRUST)

    def _apply_hint(self, scored: ScoredCandidates, condition: Condition, target: Thing, trust: float) -> None:
        """Let a relation speak for what it fits, without force."""
        found = [self.anchors(inner, target, len(scored)) for inner in condition.things]
        things = [one for one in found if one is not None]
        if things and len(things) == len(found):
            outcome = match_anchors(condition, scored.boxes, things, self.layout, self.viewpoints)
            values = 1 - outcome.values if condition.negated else outcome.values
            scored.apply_hint(values, outcome.sentence, trust)

    def _apply_rank(self, scored: ScoredCandidates, condition: Condition, target: Thing, reference: Boxes | None) -> None:
        anchors = [self.anchors(inner, target, len(scored)) for inner in condition.things]
        if any(one is None for one in anchors):
            noun = condition.things[0].noun
            self.ranking.note(f"nothing in the map is called {noun}, so {condition.name} decides nothing")
            return
        rows = np.flatnonzero(scored.rankable())
        measure = np.full(len(scored), np.nan)
        found = [one for one in anchors if one is not None]
        peers = scored.boxes.take(rows)
        if found:
            outcome = match_anchors(condition, peers, found, self.layout, self.viewpoints)
        else:
            query = RelationQuery(condition.name, peers, None, self.layout, self.viewpoints, reference=reference)
            outcome = fits_without_anchor(query)
        measure[rows] = outcome.values
        number = condition.number or 1
        if condition.name == "middle":
            measure[rows] = -np.abs(rank_positions(outcome.values) - (len(rows) + 1) / 2)
        place = {int(row): k for k, row in enumerate(rows)}
        labels = scored.boxes.labels
        scored.apply_rank(
            measure,
            number,
            0.0 if condition.name == "middle" else outcome.margin,
            lambda i: f"{outcome.sentence(place[i])}, {condition.name} first" if i in place else labels[i],
            trust=outcome.trust,
            negated=condition.negated,
        )

    def anchors(self, thing: Thing, target: Thing, targets: int) -> Anchors | None:
        """What an anchor may be with how well each fits; None when nothing in the map is called so."""
        if thing not in self._anchors_by_thing:
            self._anchors_by_thing[thing] = self._match_anchors(thing, target)
        found = self._anchors_by_thing[thing]
        return found if found is None else found.first(max(MAX_PAIRS // max(targets, 1), 1))

    def _match_anchors(self, thing: Thing, target: Thing) -> Anchors | None:
        noun, trust = normal_form(thing.noun), 1.0
        if noun in SAME_KIND_NOUNS:
            noun = normal_form(target.noun)
        scope = self.scope
        if any(one.kind == "place" for one in thing.conditions):
            scope = narrow_scope(self.graph, thing, self.names, self.rank_places)
            thing = scope.thing
        fits: list[NameMatch] = []
        if not names_a_kind(noun):
            fits = [NameMatch(node, 1.0, node.name) for node in scope.objects if node.name not in SURFACE_NAMES]
        elif noun not in ROOM_PARTS or noun in ("wall", "ceiling"):
            fits = self.names.matches(noun, scope.objects) or self.names.matches(noun, self.graph.layer("object"))
            fits = fits or match_places(noun, scope.places, self.names)
        shell = self.layout.room_parts(ROOM_PARTS[noun]) if noun in ROOM_PARTS else None
        if not fits and shell is None:
            fits, trust = self.names.nearest_matches(noun, scope.objects), FAIR_TRUST
            if fits:
                self.ranking.note(f"nothing is called {noun}; {fits[0].tag} is the nearest name")
        parts = [self.score(thing, self.boxes(fits), fits, target)] if fits else []
        if shell is not None:
            parts.append(self.score(thing, shell, None, target))
        count = next((one.number for one in thing.conditions_named("count")), 0)
        return Anchors.of(parts, trust, count) if parts else None
