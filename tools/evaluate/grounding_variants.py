"""Variants of grounding, with and without its parts: questions of houses, asked of their true graphs or of maps.

Source: paper, the ablations of object grounding. Each variant changes one thing of the default mode.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from placegraph.models_onnx.text_encoder import TextEncoder
from placegraph.nodes.camera import detect_source
from placegraph.nodes.grounding.llm_parser import default_adapter_path, parse_by_examples, parse_by_model
from placegraph.nodes.grounding.name_matching import NameMatcher
from placegraph.nodes.grounding.program import Program, Thing
from placegraph.nodes.grounding.program_syntax import parse_program
from placegraph.nodes.grounding.reasoner import Reasoner
from placegraph.nodes.naming.place_types import LOCATION_TYPES, ROOM_TYPES
from placegraph.runtime.arrays import F64
from placegraph.runtime.errors import ConfigError, QueryError, SourceError
from placegraph.runtime.language.language_model import LanguageModel
from placegraph.runtime.messages import Question
from placegraph.runtime.query.reply import Reply, error_reply
from placegraph.runtime.query.request import make_question
from placegraph.runtime.scene_graph import GraphNode, SceneGraph
from placegraph.tools.evaluate.aligned_map import align_folder
from placegraph.tools.evaluate.grounding_scores import QuestionResult, eye_in_map, read_questions
from placegraph.tools.evaluate.trajectory_error import level_alignment, paired, positions_of
from placegraph.tools.map_files.map_folder import TRAJECTORY, read_graph
from placegraph.tools.map_files.trajectory_file import read_trajectory
from placegraph.tools.simulator.ground_truth_graph import ground_truth_graph
from placegraph.tools.simulator.house_frames import generate_house
from placegraph.tools.simulator.questions import HouseQuestion, generate_questions


@dataclass(frozen=True, eq=False)
class QuestionScene:
    """A graph, the questions about it, and how its frame lies in that of the questions.

    true_from_graph: (4, 4) rigid transform. boxes: (2, 3) of each object by id, in the frame of the questions.
    true_ids: whether O<number> is the item of that number, as in a true graph.
    """

    name: str
    graph: SceneGraph
    questions: Sequence[HouseQuestion]
    true_from_graph: F64
    boxes: Mapping[str, F64]
    true_ids: bool = False

    def question(self, question: HouseQuestion, mode: str = "program") -> Question:
        """What the asker sends: the text, and where it stands in the graph's frame."""
        return make_question(question.text, mode=mode, pose=eye_in_map(question, self.true_from_graph))


def house_scene(seed: int, count: int) -> QuestionScene:
    """The true graph of the house of a seed, with up to `count` questions."""
    house = generate_house(seed)
    graph = ground_truth_graph(house)
    boxes = {node.id: node.box for node in graph.layer("object")}
    return QuestionScene(
        f"house {seed}", graph, generate_questions(house, seed, count), np.eye(4), boxes, true_ids=True
    )


def map_scene(folder: Path, source: Path) -> QuestionScene:
    """A map with the questions of its house. Raises SourceError where the house has none, SchemaError for the map."""
    house_questions = read_questions(source)
    if not house_questions:
        raise SourceError(f"{source}: no questions in truth/questions.json")
    given = detect_source(str(source))(source, {}).given_poses()
    estimated, true = paired(positions_of(read_trajectory(folder / TRAJECTORY)), given)
    graph = read_graph(folder)
    true_from_map = level_alignment(estimated, true)
    boxes = {thing.id: thing.box for thing in align_folder(folder, graph, true_from_map).objects}
    return QuestionScene(str(folder), graph, house_questions, true_from_map, boxes)


class VariantRunner:
    """Asks questions in all variants; the model reads each request once, and each variant's time includes it."""

    def __init__(self, threads: int = 1) -> None:
        self.model = LanguageModel(threads=threads, adapter_path=default_adapter_path())
        self.names = NameMatcher(TextEncoder().encode)
        self.reasoner = Reasoner(self.names, self.model, (*ROOM_TYPES, *LOCATION_TYPES), use_model=True)
        self._programs: dict[tuple[str, str], Program] = {}
        self._parse_ms: dict[tuple[str, str], float] = {}  # ms of each reading
        self._saved_ms, self._saved_calls = 0.0, 0  # of a kept reading: added to the time of the variant that uses it
        self._flat_graphs: dict[str, SceneGraph] = {}

    def ask(self, variant: str, scene: QuestionScene, question: HouseQuestion) -> QuestionResult:
        """The reply of one variant."""
        calls, began = self.model.calls, time.perf_counter()
        self._saved_ms, self._saved_calls = 0.0, 0
        try:
            reply = VARIANTS[variant].answer(self, scene, question)
        except QueryError as error:
            reply = error_reply(str(error))
        ms = (time.perf_counter() - began) * 1e3 + self._saved_ms
        return QuestionResult(reply.status, reply.object_id or "", self.model.calls - calls + self._saved_calls, ms)

    def by_mode(self, scene: QuestionScene, question: HouseQuestion, mode: str) -> Reply:
        """The answer of one of the product's modes."""
        return self.reasoner.answer(scene.graph, 0, scene.question(question, mode))

    def by_program(
        self, scene: QuestionScene, question: HouseQuestion, program: Program, graph: SceneGraph | None = None
    ) -> Reply:
        """The answer to a program that is given."""
        return self.reasoner.answer_program(graph or scene.graph, 0, scene.question(question), program)

    def program(self, question: HouseQuestion, how: str = "adapter") -> Program:
        """What the model reads: with the adapter, without, or without but with examples before the request."""
        key = (how, question.text)
        if key in self._programs:
            self._saved_ms, self._saved_calls = self._parse_ms[key], 1
        else:
            began = time.perf_counter()
            if how == "examples":
                parsed = parse_by_examples(self.model, question.text)
            else:
                parsed = parse_by_model(self.model, question.text, use_adapter=how == "adapter")
            self._programs[key] = Program(target=parsed.thing or Thing(noun=question.text))
            self._parse_ms[key] = (time.perf_counter() - began) * 1e3
        return self._programs[key]

    def flat(self, scene: QuestionScene) -> SceneGraph:
        """The scene's objects in one room without a name."""
        if scene.name not in self._flat_graphs:
            self._flat_graphs[scene.name] = without_hierarchy(scene.graph)
        return self._flat_graphs[scene.name]


@dataclass(frozen=True)
class Variant:
    """One way to answer, in words and as a function."""

    description: str
    answer: Callable[[VariantRunner, QuestionScene, HouseQuestion], Reply]


VARIANTS: Mapping[str, Variant] = {
    "program": Variant("the default: read by the model with its adapter", lambda a, s, q: a.by_mode(s, q, "program")),
    "oracle": Variant("the true program in place of the parsed", lambda a, s, q: a.by_program(s, q, true_program(q))),
    "no relations": Variant(
        "only the noun, room and floor count, as in HOV-SG",
        lambda a, s, q: a.by_program(s, q, without_relations(a.program(q))),
    ),
    "flat": Variant(
        "no hierarchy: one room, no floors, no places in the request",
        lambda a, s, q: a.by_program(s, q, without_places(a.program(q)), a.flat(s)),
    ),
    "rules": Variant("read by phrase rules, no model", lambda a, s, q: a.by_mode(s, q, "rules")),
    "no adapter": Variant(
        "the same call without the adapter", lambda a, s, q: a.by_program(s, q, a.program(q, "plain"))
    ),
    "stock": Variant(
        "without the adapter, with examples in the prompt", lambda a, s, q: a.by_program(s, q, a.program(q, "examples"))
    ),
    "deductive": Variant("the paper's flow of calls", lambda a, s, q: a.by_mode(s, q, "deductive")),
}


def chosen_variants(names: str) -> list[str]:
    """Variant names of a comma separated list; raises ConfigError naming what there is."""
    chosen = [name.strip() for name in names.split(",") if name.strip()]
    unknown = [name for name in chosen if name not in VARIANTS]
    if unknown or not chosen:
        raise ConfigError(f"--variants: {unknown[0] if unknown else names!r} is none of {', '.join(VARIANTS)}")
    return chosen


def true_program(question: HouseQuestion) -> Program:
    """The program that the question was made from."""
    return Program(target=parse_program(question.program))


def without_relations(program: Program) -> Program:
    """The noun with its room and floor alone."""
    conditions = tuple(condition for condition in program.target.conditions if condition.kind == "place")
    return Program(target=Thing(noun=program.target.noun, conditions=conditions))


def without_places(program: Program) -> Program:
    """The request without room and floor."""
    conditions = tuple(condition for condition in program.target.conditions if condition.kind != "place")
    return Program(target=Thing(noun=program.target.noun, conditions=conditions))


def without_hierarchy(graph: SceneGraph) -> SceneGraph:
    """All objects of a graph in one room, without names of places, connections and ways."""

    def place(node_id: str, parent: str) -> GraphNode:
        return replace(graph.building, id=node_id, parent=parent, tags=())

    objects = [replace(node, parent="R0", approach=None) for node in graph.layer("object")]
    return SceneGraph.of([place("B0", ""), place("F0", "B0"), place("R0", "F0"), *objects])
