"""The conditions of a thing applied to all that it may be: looks, groups, relations, then ranks; anchors the same way.

Source: METHOD section 10, steps 3 and 4. Departs: soft all the way down: the things that an anchor may be enter with
how well each fits, so that one wrong inner condition does not kill the right answer; what the map holds no evidence
for decides nothing and leaves doubt.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from placegraph.nodes.grounding.anchor_matching import Anchors, related, related_without
from placegraph.nodes.grounding.attributes import look
from placegraph.nodes.grounding.box_arrays import Boxes, Layout
from placegraph.nodes.grounding.groups import group_fits
from placegraph.nodes.grounding.name_matching import Fit, Names
from placegraph.nodes.grounding.program import ANYTHING, SAME_KIND, Condition, Thing
from placegraph.nodes.grounding.program_syntax import write
from placegraph.nodes.grounding.ranking import Ranking
from placegraph.nodes.grounding.relations import Case, order
from placegraph.nodes.grounding.scoring import Weighing
from placegraph.nodes.grounding.search_scope import Scope, narrow, places_called
from placegraph.nodes.grounding.viewpoint import Views
from placegraph.runtime.language.word_forms import normal_form
from placegraph.runtime.scene_graph import Node, SceneGraph, id_key

MAX_PAIRS = 600_000  # departs: of targets and anchors judged at once; bounds memory on large maps
FAIR_TRUST = 0.5  # departs: what is only likely to be called so decides half
SPARE_TRUST = 0.3  # departs: "the cup on the table near the window" with one table: the cup near the window
HINT_TRUST = 0.5  # departs: "in the bathroom" of a map without rooms: near the toilet
SAME_PLACE = 0.9  # departs: places whose score is at least this share of the best are meant together
NOT_THINGS = ("wall", "floor", "ceiling")  # never meant by "something", "what is under the bed"
ANY_NOUN = ("", ANYTHING, SAME_KIND, "object", "item", "something", "anything")
OWN_NOUN = (SAME_KIND, "other", "rest")
SHELLS = {
    "floor": "floor", "ground": "floor", "wall": "wall", "ceiling": "ceiling", "corner": "corner", "room": "room",
    "middle": "center", "center": "center", "centre": "center",
}  # fmt: skip


def says(noun: str) -> bool:
    """Whether a noun names a kind of thing."""
    return normal_form(noun) not in ANY_NOUN


class Conditions:
    """Weighs the things of one request on one map; what must be said of it goes into the ranking's notes."""

    def __init__(
        self, graph: SceneGraph, names: Names, layout: Layout, views: Views, scope: Scope, ranking: Ranking
    ) -> None:
        self.graph, self.names, self.layout, self.views = graph, names, layout, views
        self.scope, self.ranking = scope, ranking
        self._known: dict[Thing, Anchors | None] = {}

    def forget(self) -> None:
        """Find all anchors anew."""
        self._known.clear()

    def boxes(self, fits: Sequence[Fit]) -> Boxes:
        """The boxes of what fits."""
        return self.layout.all.take([self.layout.row[fit.node.id] for fit in fits])

    def rank_places(self, place: Thing, fits: Sequence[Fit]) -> list[Node]:
        """The places called so that the conditions of a place fit best; all of them without conditions."""
        if not place.conditions:
            return [fit.node for fit in fits]
        weighing = self.weigh(place, self.boxes(fits), fits, place)
        order = sorted(range(len(fits)), key=lambda i: (-weighing.scores[i], id_key(fits[i].node.id)))
        best = weighing.scores[order[0]]
        return [fits[i].node for i in order if weighing.scores[i] >= SAME_PLACE * best]

    def weigh(self, thing: Thing, boxes: Boxes, fits: Sequence[Fit] | None, target: Thing) -> Weighing:
        """Apply all conditions of a thing to those it may be; ranks last: "the largest near the table" is near."""
        nodes: list[Node | None] = [fit.node for fit in fits] if fits else [None] * len(boxes)
        scores = np.array([fit.score for fit in fits]) if fits else np.ones(len(boxes))
        own = [one for one in thing.conditions if one.kind not in ("view", "place", "purpose")]
        weighing = Weighing(boxes, nodes, scores, narrowed=bool(own))
        rest = [one for one in own if one.kind not in ("look", "rank")]
        for condition in own:
            if condition.kind == "look":
                self._apply_look(weighing, condition)
        hint: Boxes | None = None
        for condition in rest:
            if condition.kind == "group":
                self._apply_group(weighing, condition)
            else:
                hint = self._apply_relation(weighing, condition, target) or hint
        if thing is self.scope.thing:
            for condition in self.scope.hints:
                self._apply_hint(weighing, condition, target, HINT_TRUST)
        for condition in own:
            if condition.kind == "rank":
                self._apply_rank(weighing, condition, target, hint)
        return weighing

    def _apply_look(self, weighing: Weighing, condition: Condition) -> None:
        nodes = [node for node in weighing.nodes if node is not None]
        if len(nodes) < len(weighing):
            return
        seen = look(condition.words, nodes, weighing.boxes, weighing.peers)
        if not seen.known:
            self.ranking.note(f"the map does not tell what is {condition.words}")
        if seen.known or not condition.negated:  # what is not known to be so is not known not to be so
            weighing.judged(seen.values, seen.sentences.__getitem__, negated=condition.negated)

    def _apply_group(self, weighing: Weighing, condition: Condition) -> None:
        among = weighing.among() if condition.name == "count" else weighing.peers
        values, told = group_fits(weighing.boxes, np.flatnonzero(among), condition)
        weighing.judged(values, told, negated=condition.negated)

    def _apply_relation(self, weighing: Weighing, condition: Condition, target: Thing) -> Boxes | None:
        """Apply a relation; returns the best of its anchors, which say from where a row is seen."""
        anchors: list[Anchors] = []
        for inner in condition.things:
            found = self.anchors(inner, target, len(weighing))
            if found is None:
                self.ranking.note(f"nothing in the map is called {inner.noun}, so {condition.name} decides nothing")
                return None
            anchors.append(found)
        outcome = related(condition, weighing.boxes, anchors, self.layout, self.views)
        if not outcome.known:
            self.ranking.note(f"the map holds nothing about {write(Thing(noun='x', conditions=(condition,)))[3:]}")
            if condition.negated:
                return None
        weighing.judged(outcome.values, outcome.sentence, trust=outcome.trust, negated=condition.negated)
        for inner, found in zip(condition.things, anchors, strict=True):
            if found.single and not condition.negated:
                self._apply_spare(weighing, inner, target)
        return anchors[0].best() if anchors and not condition.negated else None

    def _apply_spare(self, weighing: Weighing, anchor: Thing, target: Thing) -> None:
        """Let what is said of an anchor that needs it not (there is one such thing) speak for the target, a little."""
        for condition in (one for one in anchor.conditions if one.kind == "relation" and not one.negated):
            self._apply_hint(weighing, condition, target, SPARE_TRUST)

    def _apply_hint(self, weighing: Weighing, condition: Condition, target: Thing, trust: float) -> None:
        """Let a relation speak for what it fits, without force."""
        found = [self.anchors(inner, target, len(weighing)) for inner in condition.things]
        things = [one for one in found if one is not None]
        if things and len(things) == len(found):
            outcome = related(condition, weighing.boxes, things, self.layout, self.views)
            values = 1 - outcome.values if condition.negated else outcome.values
            weighing.hinted(values, outcome.sentence, trust)

    def _apply_rank(self, weighing: Weighing, condition: Condition, target: Thing, hint: Boxes | None) -> None:
        anchors = [self.anchors(inner, target, len(weighing)) for inner in condition.things]
        if any(one is None for one in anchors):
            noun = condition.things[0].noun
            self.ranking.note(f"nothing in the map is called {noun}, so {condition.name} decides nothing")
            return
        rows = np.flatnonzero(weighing.among())
        measure = np.full(len(weighing), np.nan)
        found = [one for one in anchors if one is not None]
        peers = weighing.boxes.take(rows)
        if found:
            outcome = related(condition, peers, found, self.layout, self.views)
        else:
            case = Case(condition.name, peers, None, self.layout, self.views, hint=hint)
            outcome = related_without(case)
        measure[rows] = outcome.values
        number = condition.number or 1
        if condition.name == "middle":
            measure[rows] = -np.abs(order(outcome.values) - (len(rows) + 1) / 2)
        place = {int(row): k for k, row in enumerate(rows)}
        labels = weighing.boxes.labels
        weighing.ranked(
            measure,
            number,
            0.0 if condition.name == "middle" else outcome.margin,
            lambda i: f"{outcome.sentence(place[i])}, {condition.name} first" if i in place else labels[i],
            trust=outcome.trust,
            negated=condition.negated,
        )

    def anchors(self, thing: Thing, target: Thing, targets: int) -> Anchors | None:
        """What an anchor may be with how well each fits; None when nothing in the map is called so."""
        if thing not in self._known:
            self._known[thing] = self._found(thing, target)
        found = self._known[thing]
        return found if found is None else found.first(max(MAX_PAIRS // max(targets, 1), 1))

    def _found(self, thing: Thing, target: Thing) -> Anchors | None:
        noun, trust = normal_form(thing.noun), 1.0
        if noun in OWN_NOUN:
            noun = normal_form(target.noun)
        scope = self.scope
        if any(one.kind == "place" for one in thing.conditions):
            scope = narrow(self.graph, thing, self.names, self.rank_places)
            thing = scope.thing
        fits: list[Fit] = []
        if not says(noun):
            fits = [Fit(node, 1.0, node.name) for node in scope.objects if node.name not in NOT_THINGS]
        elif noun not in SHELLS or noun in ("wall", "ceiling"):
            fits = self.names.called(noun, scope.objects) or self.names.called(noun, self.graph.layer("object"))
            fits = fits or places_called(noun, scope.places, self.names)
        shell = self.layout.shell(SHELLS[noun]) if noun in SHELLS else None
        if not fits and shell is None:
            fits, trust = self.names.fair(noun, scope.objects), FAIR_TRUST
            if fits:
                self.ranking.note(f"nothing is called {noun}; {fits[0].tag} is the nearest name")
        parts = [self.weigh(thing, self.boxes(fits), fits, target)] if fits else []
        if shell is not None:
            parts.append(self.weigh(thing, shell, None, target))
        count = next((one.number for one in thing.said("count")), 0)
        return Anchors.of(parts, trust, count) if parts else None
