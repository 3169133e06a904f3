"""Rank the targets of a program by names, attributes and relations, with the sentences that say why.

Source: paper, "Object Grounding"; METHOD section 10, steps 3 and 4. Departs: geometry in code ranks, and the language
model decides only what the evidence leaves level.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np

from placegraph.nodes.grounding.attributes import color_fit, size_fit
from placegraph.nodes.grounding.names import STEP, Fit, Names
from placegraph.nodes.grounding.program import Clause, Program, Thing
from placegraph.nodes.grounding.relations import F64, Case, Verdict, Viewpoint, families, is_rank, label
from placegraph.nodes.grounding.select import Scope, places_called
from placegraph.runtime.scene_graph import Node, SceneGraph, id_key

TIE = 0.03  # departs: scores that differ by less do not tell two objects apart
OTHER_ROOM = 0.5  # departs: what is said of two things is meant within one room; through a wall it counts half
MISSED = 0.1  # departs: a target for which a condition does not hold stays listed, below those for which it does
FITS_COLOR = 0.6  # departs: colour fit above which an object is called by that colour
MOST_ANCHORS = 12  # departs: bounds pairs; more anchors of one kind than this are beyond any one question


@dataclass
class Candidate:
    """One target with its score 0..1, its evidence, and whether every condition holds."""

    node: Node
    score: float
    evidence: list[str] = field(default_factory=list)
    holds: bool = True


@dataclass
class Ranking:
    """The candidates, best first, what else there is to say, and whether the evidence alone decides."""

    candidates: list[Candidate] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    sure: bool = True

    def tied(self) -> list[Candidate]:
        """The candidates that the evidence does not tell from the best one (that one included)."""
        return [
            candidate
            for candidate in self.candidates
            if candidate.score >= self.candidates[0].score - TIE and candidate.holds == self.candidates[0].holds
        ]


class Grounder:
    """Ranks targets in one graph, seen from one place."""

    def __init__(self, graph: SceneGraph, names: Names, asker_world: F64) -> None:
        """asker_world: (3,) metres, world frame; NaN when the asker's position is not given."""
        self.graph = graph
        self.names = names
        self.asker_world = asker_world
        self.room_of = {
            node.id: next((step for step in graph.path(node.id) if step.layer == "room"), None)
            for node in graph.nodes.values()
        }

    def viewpoint(self, node: Node) -> Viewpoint:
        """From where a node is seen: the asker's place, else the centre of its room (of the building without one)."""
        if np.isfinite(self.asker_world).all():
            return Viewpoint("asker", self.asker_world)
        room = self.room_of[node.id]
        return Viewpoint("room centre", (room or self.graph.building).center)

    def rank(self, program: Program, scope: Scope) -> Ranking:
        """Candidates of the scope for the program's target; empty when nothing has its name."""
        ranking = self._rank(program, scope, self._targets(program.target.noun, scope, STEP))
        if ranking.candidates and not ranking.candidates[0].holds and program.target.noun:
            # no best-named one fits the conditions: what is less well named may
            wider = self._rank(program, scope, self._targets(program.target.noun, scope, 1.0))
            if len(wider.candidates) > len(ranking.candidates):
                wider.sure = False
                return wider
        return ranking

    def _targets(self, noun: str, scope: Scope, step: float) -> list[Fit]:
        """What the noun names in the scope: objects, or places where those bear the name better."""
        objects = self.names.named(noun, scope.objects, step)
        places = places_called(noun, scope.places, self.names) if noun else []
        best = max((fit.score for fit in objects), default=0.0)
        return places if any(fit.score > best for fit in places) else objects

    def _rank(self, program: Program, scope: Scope, fits: Sequence[Fit]) -> Ranking:
        ranking = Ranking(notes=list(scope.notes), sure=scope.sure)
        candidates = [Candidate(fit.node, fit.score) for fit in fits]
        for fit, candidate in zip(fits, candidates, strict=True):
            if program.target.noun:
                candidate.evidence.append(f"{label(fit.node)} is called {fit.tag}")
        self._attributes(candidates, program.target)
        own = [i for i, clause in enumerate(program.clauses) if clause.of == 0]
        # superlatives last: "the largest chair near the table" is the largest of those that are near
        own.sort(key=lambda i: is_rank(program.clauses[i].relation))
        for i in own:
            self._apply(program, i, candidates, scope, ranking)
        for i, clause in enumerate(program.clauses):
            if clause.of > 0 and not is_rank(clause.relation):
                self._hint(program, i, candidates, scope)
        candidates.sort(key=lambda candidate: (not candidate.holds, -candidate.score, id_key(candidate.node.id)))
        if candidates and not candidates[0].holds:
            ranking.sure = False
            if not program.target.noun:  # "what is under the bed?": of anything, only what is there is an answer
                ranking.notes += candidates[0].evidence
                candidates = []
        ranking.candidates = candidates
        return ranking

    def _hint(self, program: Program, index: int, candidates: list[Candidate], scope: Scope) -> None:
        """Let a clause of an anchor that needs none (there is one such thing) speak for the target, without force."""
        clause = program.clauses[index]
        anchors = self._anchor_tuples(program, index, scope, Ranking())
        qualified = self._anchor_tuples(program, clause.of - 1, scope, Ranking())
        if not anchors or len(qualified) != 1 or not candidates:
            return
        verdicts = self._judge(clause, [candidate.node for candidate in candidates], anchors)
        for candidate, verdict in zip(candidates, verdicts, strict=True):
            candidate.score *= 0.5 + 0.5 * verdict.score
            candidate.evidence.append(verdict.sentence)

    def _attributes(self, candidates: list[Candidate], thing: Thing) -> None:
        if thing.color:
            for candidate in candidates:
                fit = color_fit(candidate.node, thing.color)
                candidate.score *= 0.05 + 0.95 * fit
                seen = f"sRGB {candidate.node.color}" if candidate.node.color else "a colour that was not seen"
                candidate.evidence.append(f"{label(candidate.node)} has {seen}: {thing.color} fits {fit:.2f}")
                candidate.holds &= fit >= FITS_COLOR
        if thing.size:
            fits = size_fit([candidate.node for candidate in candidates], thing.size)
            for candidate, fit in zip(candidates, fits, strict=True):
                candidate.score *= fit
                candidate.evidence.append(f"{label(candidate.node)} among {len(fits)}: {thing.size} fits {fit:.2f}")

    def _apply(self, program: Program, index: int, candidates: list[Candidate], scope: Scope, ranking: Ranking) -> None:
        """Score the candidates by one clause of the target."""
        clause = program.clauses[index]
        anchors = self._anchor_tuples(program, index, scope, ranking)
        if clause.anchors and not anchors:
            missing = " and ".join(anchor.noun for anchor in clause.anchors)
            ranking.notes.append(f"nothing in the map is called {missing}, so {clause.relation} decides nothing")
            ranking.sure = False
            return
        judged = [c for c in candidates if c.holds] if is_rank(clause.relation) else candidates
        if not judged:
            return
        verdicts = self._judge(clause, [candidate.node for candidate in judged], anchors)
        for candidate, verdict in zip(judged, verdicts, strict=True):
            holds = verdict.holds != clause.negated
            score = verdict.score if not clause.negated else 1.0 - verdict.score * verdict.holds
            candidate.score *= score if holds else MISSED * score
            candidate.holds &= holds
            candidate.evidence.append(verdict.sentence if holds else f"not {clause.relation}: {verdict.sentence}")

    def _judge(self, clause: Clause, targets: Sequence[Node], anchors: Sequence[tuple[Node, ...]]) -> list[Verdict]:
        nodes = [*targets, *(node for group in anchors for node in group)]
        rooms = {node.id: self.room_of[node.id] for node in nodes}
        case = Case(
            relation=clause.relation,
            targets=targets,
            anchors=anchors,
            viewpoints={node.id: self.viewpoint(node) for node in nodes},
            room_boxes={node_id: room.box for node_id, room in rooms.items() if room is not None},
            ordinal=clause.ordinal,
        )
        verdicts = families()[clause.relation].judge(case)
        if is_rank(clause.relation):
            return verdicts
        return [self._across_rooms(target, verdict) for target, verdict in zip(targets, verdicts, strict=True)]

    def _across_rooms(self, target: Node, verdict: Verdict) -> Verdict:
        rooms = {room.id for i in (target.id, *verdict.anchor_ids) if (room := self.room_of[i]) is not None}
        if len(rooms) < 2:
            return verdict
        text = f"{verdict.sentence}, in another room"
        return Verdict(verdict.score * OTHER_ROOM, verdict.holds, text, verdict.anchor_ids)

    def _anchor_tuples(self, program: Program, index: int, scope: Scope, ranking: Ranking) -> list[tuple[Node, ...]]:
        """The anchors of a clause as alternatives, kept to those that their own clauses hold for."""
        clause = program.clauses[index]
        groups = [self._anchors(anchor, scope, ranking) for anchor in clause.anchors]
        for later in range(index + 1, len(program.clauses)):
            if program.clauses[later].of == index + 1 and groups:
                groups[0] = self._kept(program, later, groups[0], scope, ranking)
        if not groups or not all(groups):
            return []
        most = families()[clause.relation].anchors[clause.relation][1]
        if most == 2:
            return list(combinations(groups[0], 2)) if len(groups) == 1 else _pairs(groups[0], groups[1])
        return [(node,) for node in groups[0]]

    def _anchors(self, thing: Thing, scope: Scope, ranking: Ranking) -> list[Node]:
        """Nodes an anchor can be: in the scope, else in the whole map, else a place."""
        everywhere = self.graph.layer("object")
        for nodes in (scope.objects, everywhere, scope.places):
            is_places = nodes is scope.places
            fits = places_called(thing.noun, nodes, self.names) if is_places else self.names.named(thing.noun, nodes)
            candidates = [Candidate(fit.node, fit.score) for fit in fits]
            if candidates:
                self._attributes(candidates, thing)
                kept = [c for c in candidates if c.holds] or candidates
                kept.sort(key=lambda candidate: (-candidate.score, id_key(candidate.node.id)))
                if len(kept) > MOST_ANCHORS:
                    ranking.notes.append(f"of {len(kept)} {thing.noun} anchors the first {MOST_ANCHORS} were compared")
                return [candidate.node for candidate in kept[:MOST_ANCHORS]]
        return []

    def _kept(self, program: Program, index: int, nodes: list[Node], scope: Scope, ranking: Ranking) -> list[Node]:
        """The nodes a clause holds for; all of them, and not sure, when it holds for none."""
        anchors = self._anchor_tuples(program, index, scope, ranking)
        clause = program.clauses[index]
        if clause.anchors and not anchors:
            ranking.sure = False
            return nodes
        verdicts = self._judge(clause, nodes, anchors) if nodes else []
        kept = [node for node, verdict in zip(nodes, verdicts, strict=True) if verdict.holds != clause.negated]
        if nodes and not kept:
            ranking.sure = False
            ranking.notes.append(f"no {nodes[0].name} is {clause.relation} what was said; all of them were compared")
        return kept or nodes


def _pairs(first: list[Node], second: list[Node]) -> list[tuple[Node, ...]]:
    return [(a, b) for a in first for b in second if a.id != b.id]
