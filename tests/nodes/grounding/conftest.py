"""A hand-made house: a kitchen and a living room below, a bedroom above."""

import dataclasses
import json
import tomllib
from pathlib import Path

import numpy as np
import pytest

from placegraph.models_onnx.text_encoder import TextEncoder
from placegraph.nodes.grounding.name_matching import NameMatcher
from placegraph.runtime.messages import NamedGraph, Question
from placegraph.runtime.scene_graph import GraphNode, SceneGraph, Tag


def make_node(node_id, parent, name, low, high, color=(), others=()):
    tags = tuple(Tag(text, weight) for text, weight in (((name, 5.0),) if name else ()) + tuple(others))
    box = np.array([low, high], float)
    outline = box[[0, 1, 1, 0], 0], box[[0, 0, 1, 1], 1]
    return GraphNode(
        id=node_id, parent=parent, tags=tags, box=box, footprint=np.stack(outline, axis=1),
        first_frame=-1, last_frame=-1, color=tuple(color),
    )  # fmt: skip


def thing(number, parent, name, center, size, color=(), others=()):
    center, size = np.array(center, float), np.array(size, float)
    return make_node(f"O{number}", parent, name, center - size / 2, center + size / 2, color, others)


WHITE, BROWN, RED, BLUE, BLACK, GREEN = (
    (235, 235, 235),
    (110, 72, 40),
    (180, 35, 40),
    (45, 70, 170),
    (25, 25, 25),
    (50, 120, 60),
)


def make_house(named=True):
    """x to the east, y to the north. Kitchen 0..4 x 0..4, living room 4..9 x 0..5, bedroom above the kitchen."""
    places = [
        make_node("B0", "", "building", (0, 0, 0), (9, 5, 5.4)),
        make_node("F0", "B0", "floor 1", (0, 0, 0), (9, 5, 2.5)),
        make_node("F1", "B0", "floor 2", (0, 0, 2.8), (9, 5, 5.4)),
        make_node("R0", "F0", "kitchen" if named else "", (0, 0, 0), (4, 4, 2.5)),
        make_node("R1", "F0", "living room" if named else "", (4, 0, 0), (9, 5, 2.5)),
        make_node("R2", "F1", "bedroom" if named else "", (0, 0, 2.8), (4, 4, 5.3)),
        make_node("L0", "R0", "dining area" if named else "", (1, 1, 0), (3, 3, 1.2)),
    ]
    things = [
        thing(0, "L0", "table", (2, 2, 0.4), (1.4, 0.8, 0.8), BROWN),
        thing(1, "L0", "chair", (2, 1.3, 0.45), (0.45, 0.45, 0.9), BROWN),
        thing(2, "L0", "chair", (2, 2.7, 0.45), (0.45, 0.45, 0.9), BROWN),
        thing(3, "L0", "chair", (1.0, 2, 0.45), (0.45, 0.45, 0.9), BROWN),
        thing(4, "L0", "chair", (3.1, 2, 0.45), (0.45, 0.45, 0.9), RED),
        thing(5, "L0", "cup", (1.7, 2, 0.85), (0.08, 0.08, 0.1), WHITE),
        thing(6, "L0", "cup", (2.4, 2.1, 0.85), (0.08, 0.08, 0.1), BLUE),
        thing(7, "R0", "fridge", (0.4, 3.6, 0.9), (0.7, 0.7, 1.8), WHITE),
        thing(8, "R0", "window", (2, 3.95, 1.5), (1.2, 0.1, 1.0), WHITE),
        thing(9, "R1", "sofa", (6.5, 0.6, 0.45), (2.0, 0.9, 0.9), BLUE),
        thing(10, "R1", "tv", (6.5, 4.8, 1.0), (1.2, 0.1, 0.7), BLACK),
        thing(11, "R1", "lamp", (5.2, 0.5, 0.8), (0.4, 0.4, 1.6), WHITE),
        thing(12, "R1", "armchair", (8.2, 2.5, 0.45), (0.8, 0.8, 0.9), GREEN, [("chair", 3.0)]),
        thing(13, "R1", "vase", (8.6, 4.2, 0.5), (0.2, 0.2, 0.4), BLUE),
        thing(14, "R1", "window", (8.95, 4.0, 1.5), (0.1, 1.4, 1.2), WHITE),
        thing(15, "R2", "bed", (2, 3, 3.1), (1.6, 2.0, 0.6), WHITE),
        thing(16, "R2", "nightstand", (0.9, 3.7, 3.05), (0.45, 0.4, 0.5), BROWN),
        thing(17, "R2", "nightstand", (3.1, 3.7, 3.05), (0.45, 0.4, 0.5), BROWN),
        thing(18, "R2", "lamp", (0.9, 3.7, 3.5), (0.2, 0.2, 0.4), WHITE),
        thing(19, "R2", "vase", (3.6, 0.6, 3.3), (0.2, 0.2, 0.4), RED),
        thing(20, "R2", "window", (3.95, 0.8, 4.2), (0.1, 1.2, 1.2), WHITE),
        thing(21, "R1", "picture", (6.5, 0.05, 1.7), (0.8, 0.05, 0.6), RED),
        thing(22, "R1", "coffee table", (6.5, 2.0, 0.25), (1.0, 0.6, 0.5), BROWN),
        thing(23, "R1", "book", (6.4, 2.0, 0.52), (0.2, 0.3, 0.04), RED),
        thing(24, "R1", "vase", (4.4, 4.6, 0.3), (0.2, 0.2, 0.6), WHITE),
    ]  # fmt: skip
    return SceneGraph.of(places + things)


def make_graph_message(graph, revision=1):
    # types that stand for a place in the questions, of which the house has two
    place_types = ("kitchen", "bathroom", "garage", "work area", "dining area")
    return NamedGraph(
        frame_id=7, stamp_ns=9, revision=revision, final=False, place_types=place_types, json=graph.to_json()
    )


def make_question(text, viewpoint=(np.nan,) * 3, k=3, mode="rules", question_id="q1"):
    return Question(
        frame_id=-1, stamp_ns=0, question_id=question_id, text=text, k=k, mode=mode,
        viewpoint_world=np.array(viewpoint, np.float64),
    )  # fmt: skip


@pytest.fixture(scope="session")
def house():
    return make_house()


@pytest.fixture(scope="session")
def unnamed_house():
    return make_house(named=False)


@pytest.fixture(scope="session")
def node_of():
    return make_node


@pytest.fixture(scope="session")
def thing_of():
    return thing


@pytest.fixture(scope="session")
def room_of():
    """Makes a graph of objects (name, centre, size) in one room without a name, as lists of boxes are imported."""

    def make(*things, fronts=None):
        boxes = np.array([(np.array(c, float) - np.array(s) / 2, np.array(c) + np.array(s) / 2) for _, c, s in things])
        low, high = boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)
        places = [make_node("B0", "", "", low, high), make_node("F0", "B0", "", low, high)]
        places.append(make_node("R0", "F0", "", low, high))
        nodes = [thing(i, "R0", name, center, size) for i, (name, center, size) in enumerate(things)]
        for i, front in (fronts or {}).items():
            nodes[i] = dataclasses.replace(nodes[i], front=front)
        return SceneGraph.of(places + nodes)

    return make


@pytest.fixture(scope="session")
def graph_message():
    return make_graph_message


@pytest.fixture(scope="session")
def question_of():
    return make_question


@pytest.fixture(scope="session")
def ask():
    """Puts a question to a node and returns the answer's fields."""

    def put(node, text, **kwargs):
        (answer,) = node.step(make_question(text, **kwargs))
        return json.loads(answer.json)

    return put


@pytest.fixture(scope="session")
def names():
    return NameMatcher(TextEncoder().encode)


@pytest.fixture(scope="session")
def questions():
    """Questions about the house with the ids that are right."""
    return tomllib.loads(Path(__file__).with_name("questions.toml").read_text())["question"]
