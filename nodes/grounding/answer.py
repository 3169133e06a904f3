"""Question to answer: parse, select, relate, ground, and the reply as canonical JSON.

Source: paper, "Deductive Hierarchical Reasoning Algorithm"; METHOD section 10.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from placegraph.nodes.grounding.decide import settle
from placegraph.nodes.grounding.deduce import deduce
from placegraph.nodes.grounding.ground import Candidate, Grounder, Ranking
from placegraph.nodes.grounding.llm import LanguageModel, prompt
from placegraph.nodes.grounding.names import Names
from placegraph.nodes.grounding.parse import draft
from placegraph.nodes.grounding.program import Program, Thing, object_grammar, read_choice
from placegraph.nodes.grounding.select import Scope, narrow, places_called
from placegraph.nodes.grounding.words import normal_form, tokens
from placegraph.runtime.errors import QueryError
from placegraph.runtime.messages import Question
from placegraph.runtime.place_graph import approach_to_dict
from placegraph.runtime.question import MODES
from placegraph.runtime.route import find_route
from placegraph.runtime.scene_graph import ID_PATTERN, Node, SceneGraph

MOST_OPTIONS = 24  # departs: names of things offered for a purpose; each costs the model 30 to 60 ms
CHOICE_TOKENS = 48  # a one-field object with a noun phrase is at most 30

NO_WAY: dict[str, Any] = {"approach": None, "route": [], "travel_m": None}


class Reasoner:
    """Answers questions about one graph at a time; asks the model only what the words and the map leave open."""

    def __init__(self, names: Names, model: LanguageModel, place_types: Sequence[str], *, use_model: bool) -> None:
        """place_types: names that stand for a kind of place, also where the map has none such."""
        self._names = names
        self._model = model
        self._place_types = frozenset(map(normal_form, place_types))
        self._use_model = use_model

    def answer(self, graph: SceneGraph, revision: int, question: Question) -> dict[str, Any]:
        """The fields of the answer, all but those of an error. Raises QueryError when the question is not usable."""
        _check(question)
        before = self._model.calls
        if question.mode == "deductive":
            return self._deduced(graph, revision, question)
        program = self.parse(graph, question.text)
        scope = narrow(graph, program, self._names)
        if program.purpose:
            program = self._by_purpose(program, scope)
        grounder = Grounder(graph, self._names, np.asarray(question.viewpoint_world, float))
        ranking = grounder.rank(program, scope)
        # words that the program does not hold are all that could tell tied ones apart
        reader = self._model if program.rest and self._use_model else None
        decided = settle(reader, graph, ranking, question.text)
        common = {
            "question": question.text,
            "question_id": question.question_id,
            "parse": program.model_dump(mode="json"),
            "revision": revision,
            "llm_calls": self._model.calls - before,
        }
        if not ranking.candidates:
            return common | self._not_in_map(graph, program, ranking, grounder)
        return common | _found(graph, ranking, grounder, question.k, decided)

    def _deduced(self, graph: SceneGraph, revision: int, question: Question) -> dict[str, Any]:
        """The fields of an answer that the language model found level by level. Raises QueryError."""
        if not self._use_model:
            raise QueryError("mode 'deductive' needs the language model, which use_model = false switches off")
        before = self._model.calls
        asker_world = np.asarray(question.viewpoint_world, float)
        reading, ranking = deduce(self._model, graph, self._names, question.text, asker_world)
        grounder = Grounder(graph, self._names, asker_world)
        common = {
            "question": question.text,
            "question_id": question.question_id,
            "parse": asdict(reading),
            "revision": revision,
            "llm_calls": self._model.calls - before,
        }
        if not ranking.candidates:
            return common | self._not_in_map(graph, Program(target=Thing()), ranking, grounder)
        return common | _found(graph, ranking, grounder, question.k, ranking.sure)

    def parse(self, graph: SceneGraph, text: str) -> Program:
        """The program of a question in this map. Raises QueryError."""
        objects = graph.layer("object")
        places = [*graph.layer("room"), *graph.layer("location")]

        def is_place(phrase: str) -> bool:
            if not phrase:
                return False
            if ID_PATTERN.fullmatch(phrase.upper()):
                return phrase.upper() in graph.nodes and phrase[0] in "RLrl"
            named = normal_form(phrase) in self._place_types or bool(places_called(phrase, places, self._names))
            return named and not self._is_tag(phrase, objects)

        def is_known(phrase: str) -> bool:
            return self._names.is_known(phrase, objects) or is_place(phrase)

        found = draft(text, is_place, is_known)
        if len(found.target_options) < 2 or not self._use_model:
            return found.program
        fields = {"target": found.target_options}
        said = " ".join(tokens(text))
        reply = self._model.complete(
            prompt("target", question=said, things=", ".join(found.target_options)),
            object_grammar(fields),
            CHOICE_TOKENS,
        )
        return found.by_target[read_choice(reply, fields)["target"]]

    @staticmethod
    def _is_tag(phrase: str, objects: Sequence[Node]) -> bool:
        return any(normal_form(tag.name) == normal_form(phrase) for node in objects for tag in node.tags[:1])

    def _by_purpose(self, program: Program, scope: Scope) -> Program:
        """Let the model choose which of the names in scope serves the purpose."""
        names = sorted({normal_form(node.tags[0].name) for node in scope.objects if node.tags} - {""})
        scope.sure = False
        if not names or not self._use_model:
            raise QueryError(f"the question names no thing that can be looked for: {program.purpose}")
        if len(names) > MOST_OPTIONS:
            near = self._names.nearest(program.purpose, scope.objects, MOST_OPTIONS)
            names = sorted({normal_form(name) for name in near})
        options = [f" {name}" for name in names]
        opening, said = prompt("purpose", purpose=program.purpose).split("|", 1)
        neutral = prompt("purpose", purpose="something").split("|", 1)[1]
        # minus what each name scores when nothing is said: common words would win otherwise
        prior = self._model.log_probabilities(opening, neutral, options)
        scores = self._model.log_probabilities(opening, said, options) - prior
        best = int(np.argmax(scores))
        scope.notes.append(f"the language model chose {names[best]} among {len(names)} names for: {program.purpose}")
        return program.model_copy(update={"target": program.target.model_copy(update={"noun": names[best]})})

    def _not_in_map(self, graph: SceneGraph, program: Program, ranking: Ranking, grounder: Grounder) -> dict[str, Any]:
        objects = graph.layer("object")
        where = " there" if program.room or program.floor else " in the map"
        missing = f"is called {program.target.noun}" if program.target.noun else "fits the question"
        evidence = [*ranking.notes, f"nothing{where} {missing}"]
        elsewhere = self._names.named(program.target.noun, objects) if program.target.noun else []
        if elsewhere:
            listed = [f"{fit.node.name} {fit.node.id} in {_place(graph, fit.node)}" for fit in elsewhere[:5]]
            evidence.append(f"elsewhere: {'; '.join(listed)}")
        else:
            nearest = self._names.nearest(program.target.noun, objects)
            evidence.append(f"the nearest names in the map: {', '.join(nearest) or 'none'}")
        view = grounder.viewpoint(graph.building)
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
            **NO_WAY,
            "viewpoint": {"source": view.source, "xyz": _numbers(view.xyz_world)},
        }


def error_answer(question: Question, revision: int, reason: str) -> dict[str, Any]:
    """The fields of an answer that says why there is none."""
    asker = question.viewpoint_world
    given = bool(np.isfinite(asker).all())
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
        **NO_WAY,
        "viewpoint": {"source": "asker", "xyz": _numbers(asker)} if given else None,
        "parse": None,
        "revision": revision,
        "llm_calls": 0,
    }


def to_json(fields: dict[str, Any]) -> str:
    """Canonical JSON: sorted keys, no spaces; equal answers give equal bytes."""
    return json.dumps(fields, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False)


def _check(question: Question) -> None:
    if question.mode not in MODES:
        raise QueryError(f"mode {question.mode!r} is unknown; there are: {', '.join(MODES)}")
    if question.k < 1:
        raise QueryError(f"k = {question.k}: at least one candidate must be listed")
    finite = np.isfinite(question.viewpoint_world)
    if finite.any() and not finite.all():
        raise QueryError(f"viewpoint {question.viewpoint_world.tolist()}: give all of x, y and z, or none (NaN)")


def _found(graph: SceneGraph, ranking: Ranking, grounder: Grounder, k: int, sure: bool) -> dict[str, Any]:
    best = ranking.candidates[0]
    view = grounder.viewpoint(best.node)
    return {
        "status": "found",
        "object_id": best.node.id,
        "name": best.node.name,
        "box": _numbers(best.node.box),
        "center": _numbers(best.node.center),
        "path": [{"id": step.id, "layer": step.layer, "name": step.name} for step in graph.path(best.node.id)],
        "evidence": [*ranking.notes, *best.evidence],
        "candidates": [_candidate(candidate) for candidate in ranking.candidates[:k]],
        "sure": sure,
        **_way_to(graph, best.node, grounder.asker_world),
        "viewpoint": {"source": view.source, "xyz": _numbers(view.xyz_world)},
    }


def _way_to(graph: SceneGraph, node: Node, asker_world: NDArray[np.float64]) -> dict[str, Any]:
    """Where to stand before a node, and how the asker gets there: rooms and connections in turn, metres.

    To an object that cannot be approached the way into its room, as far as its middle; 0 m for who is there already.
    """
    approach = approach_to_dict(node.approach)
    found = NO_WAY | {"approach": approach and {name: approach[name] for name in ("position", "yaw_rad")}}
    if not np.isfinite(asker_world).all():
        return found
    room = graph.room_of(node.id)
    route = find_route(graph, asker_world, node.id) or (find_route(graph, asker_world, room) if room else None)
    if route is None:
        return found
    return found | {"route": list(route.ids), "travel_m": _numbers(route.length_m)}


def _candidate(candidate: Candidate) -> dict[str, Any]:
    return {
        "id": candidate.node.id,
        "name": candidate.node.name,
        "score": round(candidate.score, 4),
        "evidence": candidate.evidence,
    }


def _numbers(values: Any) -> Any:
    # adding 0.0 turns -0.0 into 0.0, so that equal answers print alike
    return (np.round(np.asarray(values, float), 3) + 0.0).tolist()


def _place(graph: SceneGraph, node: Node) -> str:
    parent = graph.nodes[node.parent]
    return f"{parent.name} {parent.id}"
