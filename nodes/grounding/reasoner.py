"""Question to answer: parse the question into a program, execute it on the graph, build the reply.

Source: paper, "Deductive Hierarchical Reasoning Algorithm". Not as in the paper: by default one call parses the
question; the paper's flow, a call per layer, is the mode "deductive".
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from placegraph.nodes.grounding.box_arrays import Layout, layout_of
from placegraph.nodes.grounding.deductive_reasoning import deduce
from placegraph.nodes.grounding.llm_parser import parse_by_examples, parse_by_model
from placegraph.nodes.grounding.name_matching import NameMatcher
from placegraph.nodes.grounding.program import Program, Thing
from placegraph.nodes.grounding.program_executor import ProgramExecutor
from placegraph.nodes.grounding.program_syntax import format_program
from placegraph.nodes.grounding.ranking import Ranking
from placegraph.nodes.grounding.reply_builder import ReplyBuilder
from placegraph.nodes.grounding.rule_parser import check_text, parse_by_rules
from placegraph.nodes.grounding.search_scope import SearchScope, match_places
from placegraph.nodes.grounding.settings import DEFAULTS, GroundingSettings
from placegraph.runtime.errors import QueryError
from placegraph.runtime.language.language_model import LanguageModel
from placegraph.runtime.language.prompts import fill_prompt
from placegraph.runtime.language.word_forms import normal_form, tokens
from placegraph.runtime.messages import Question
from placegraph.runtime.query.reply import LayerSelection, ProgramParse, Reply
from placegraph.runtime.query.request import MODES
from placegraph.runtime.scene_graph import ID_PATTERN, GraphNode, SceneGraph

MAX_OPTIONS = 24  # names offered for a purpose; each costs the model 30 to 60 ms
# Confidence below which a reading gives way to the deductive mode. Measured: of 300 requests of people and of phrasings
# that training never said 5 readings lay below 0.1, none of them right, and above it 82 % were.
MIN_CONFIDENCE = 0.05


@dataclass(frozen=True)
class ModeResult:
    """What one mode made of a question: its program (None in mode "deductive") and the ranking."""

    program: Program | None
    ranking: Ranking
    executor: ProgramExecutor
    sure: bool
    reader: str = ""  # "model" or "rules"
    confidence: float | None = None  # of the model's reading, 0..1
    selection: LayerSelection | None = None  # mode "deductive"


class Reasoner:
    """Answers questions about one graph at a time."""

    def __init__(
        self,
        names: NameMatcher,
        model: LanguageModel,
        place_types: Sequence[str],
        *,
        use_model: bool,
        settings: GroundingSettings = DEFAULTS,
    ) -> None:
        """place_types: names of kinds of places; they count as places even when the map has none of that kind."""
        self._names = names
        self._model = model
        self._place_types = frozenset(map(normal_form, place_types))
        self._use_model, self._settings = use_model, settings
        self._layout: tuple[SceneGraph, Layout] | None = None
        self._modes: dict[str, Callable[[SceneGraph, Question], ModeResult]] = {
            "program": self._answer_by_model,
            "rules": self._answer_by_rules,
            "deductive": self._answer_deductive,
        }

    def answer(self, graph: SceneGraph, revision: int, question: Question) -> Reply:
        """Answer a question. Raises QueryError for a question that cannot be answered at all."""
        _check(question)
        calls_before = self._model.calls
        result = self._modes[question.mode](graph, question)
        return self._reply(revision, question, result, calls_before)

    def answer_program(self, graph: SceneGraph, revision: int, question: Question, program: Program) -> Reply:
        """Answer a question whose program is given. Raises QueryError."""
        calls_before = self._model.calls
        return self._reply(revision, question, self._execute(graph, question, program, ""), calls_before)

    def _reply(self, revision: int, question: Question, result: ModeResult, calls_before: int) -> Reply:
        program, ranking = result.program, result.ranking
        parse: ProgramParse | LayerSelection | None = result.selection
        if program:
            parse = ProgramParse(
                text=format_program(program.target),
                program=program.model_dump(mode="json"),
                confidence=result.confidence,
                reader=result.reader,
            )
        builder = ReplyBuilder(question, revision, result.executor, parse, self._model.calls - calls_before)
        if not ranking.candidates:
            return builder.not_in_map(ranking, program.target if program else Thing())
        return builder.found(ranking, sure=result.sure)

    def _answer_by_model(self, graph: SceneGraph, question: Question) -> ModeResult:
        if not self._use_model:  # the reply's `parse` says that the rules read it
            return self._answer_by_rules(graph, question)
        check_text(question.text)
        parse = parse_by_model if self._model.adapter_path else parse_by_examples
        parsed = parse(self._model, question.text)
        confidence = round(float(parsed.confidence), 4)
        if parsed.thing is not None and confidence >= MIN_CONFIDENCE:
            return self._execute(graph, question, Program(target=parsed.thing), "model", confidence)
        return self._answer_uncertain(graph, question, parsed.thing, confidence)

    def _answer_uncertain(
        self, graph: SceneGraph, question: Question, thing: Thing | None, confidence: float
    ) -> ModeResult:
        """The deductive mode's answer; when it has none, that of the doubtful program, or of the rules without one."""
        note = f"the reading of the request is doubtful (confidence {confidence:.2f})"
        result: ModeResult | None = None
        if _names_something(graph, question.text):
            try:
                result = self._answer_deductive(graph, question)
                note += ", so it was asked level by level"
            except QueryError as error:
                note += f", and level by level there is no answer: {error}"
        if result is None and thing is not None:
            result = self._execute(graph, question, Program(target=thing), "model", confidence)
        result = result or self._answer_by_rules(graph, question)
        result.ranking.notes.insert(0, note)
        return replace(result, sure=False)

    def _answer_deductive(self, graph: SceneGraph, question: Question) -> ModeResult:
        if not self._use_model:
            raise QueryError("mode 'deductive' needs the language model, which use_model = false switches off")
        asker = np.asarray(question.viewpoint_world, float)
        executor = ProgramExecutor(
            graph, self._names, asker, question.heading_rad, self._layout_of(graph), self._settings
        )
        selection, ranking = deduce(self._model, executor, question.text)
        return ModeResult(None, ranking, executor, ranking.sure, "levels", selection=selection)

    def _answer_by_rules(self, graph: SceneGraph, question: Question) -> ModeResult:
        return self._execute(graph, question, self.parse(graph, question.text), "rules")

    def _execute(
        self, graph: SceneGraph, question: Question, program: Program, reader: str, confidence: float | None = None
    ) -> ModeResult:
        """Execute a program on the graph; a purpose ("something to sit on") is first turned into a noun."""
        asker = np.asarray(question.viewpoint_world, float)
        executor = ProgramExecutor(
            graph, self._names, asker, question.heading_rad, self._layout_of(graph), self._settings
        )
        scope = executor.scope(program.target)
        if any(program.target.conditions_named("for")):
            program = self._by_purpose(program, scope)
        ranking = executor.rank(program, scope)
        tied = ranking.tied(self._settings.scores.tie_margin)
        if len(tied) > 1:  # the lowest id stands first
            ranking.note(f"{len(tied)} candidates fit equally: {', '.join(candidate.node.id for candidate in tied)}")
        return ModeResult(program, ranking, executor, ranking.sure, reader, confidence)

    def _layout_of(self, graph: SceneGraph) -> Layout:
        if self._layout is None or self._layout[0] is not graph:
            self._layout = (graph, layout_of(graph))
        return self._layout[1]

    def parse(self, graph: SceneGraph, text: str) -> Program:
        """Parse a question by rules; which words are places or known names depends on the map. Raises QueryError."""
        objects = graph.layer("object")
        places = [*graph.layer("room"), *graph.layer("location")]

        def is_place(phrase: str) -> bool:
            if not phrase:
                return False
            if ID_PATTERN.fullmatch(phrase.upper()):
                return phrase.upper() in graph.nodes and phrase[0] in "RLrl"
            is_named_place = normal_form(phrase) in self._place_types or bool(match_places(phrase, places, self._names))
            return is_named_place and not self._is_tag(phrase, objects)

        def is_known(phrase: str) -> bool:
            return self._names.is_known(phrase, objects) or is_place(phrase)

        return parse_by_rules(text, is_place, is_known)

    @staticmethod
    def _is_tag(phrase: str, objects: Sequence[GraphNode]) -> bool:
        return any(normal_form(tag.name) == normal_form(phrase) for node in objects for tag in node.tags[:1])

    def _by_purpose(self, program: Program, scope: SearchScope) -> Program:
        """Let the model choose which of the names in scope serves the purpose, and make it the target's noun."""
        purpose = next(program.target.conditions_named("for")).words
        names = sorted({normal_form(node.tags[0].name) for node in scope.objects if node.tags} - {""})
        scope.sure = False
        if not names:
            return program
        if not self._use_model:
            raise QueryError(f"the question names no thing that can be looked for: {purpose}")
        if len(names) > MAX_OPTIONS:
            nearest = self._names.nearest_names(purpose, scope.objects, MAX_OPTIONS)
            names = sorted({normal_form(name) for name in nearest})
        options = [f" {name}" for name in names]
        prefix, asked_purpose = fill_prompt(__package__, "purpose", purpose=purpose).split("|", 1)
        neutral = fill_prompt(__package__, "purpose", purpose="something").split("|", 1)[1]
        # minus each name's score for an empty purpose; otherwise common words would always win
        prior = self._model.log_probabilities(prefix, neutral, options)
        scores = self._model.log_probabilities(prefix, asked_purpose, options) - prior
        best = int(np.argmax(scores))
        scope.notes.append(f"the language model chose {names[best]} among {len(names)} names for: {purpose}")
        scope.thing = scope.thing.model_copy(update={"noun": names[best]})
        return program.model_copy(update={"target": program.target.model_copy(update={"noun": names[best]})})


def _names_something(graph: SceneGraph, text: str) -> bool:
    """Whether a word of the request is a name in the map; otherwise the deductive mode would find nothing either."""
    named = {word for node in graph.nodes.values() for tag in node.tags for word in normal_form(tag.name).split()}
    return any(normal_form(word) in named for word in tokens(text))


def _check(question: Question) -> None:
    if question.mode not in MODES:
        raise QueryError(f"mode {question.mode!r} is unknown; there are: {', '.join(MODES)}")
    if question.k < 1:
        raise QueryError(f"k = {question.k}: at least one candidate must be listed")
    finite = np.isfinite(question.viewpoint_world)
    if finite.any() and not finite.all():
        raise QueryError(f"pose {question.viewpoint_world.tolist()}: give all of x, y and z, or none (NaN)")
