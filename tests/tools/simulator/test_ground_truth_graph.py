"""The graph of a house's truth, and the programs of its questions on it."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from placegraph.models_onnx.text_encoder import TextEncoder
from placegraph.nodes.grounding.name_matching import NameMatcher
from placegraph.nodes.grounding.program import Program
from placegraph.nodes.grounding.program_executor import ProgramExecutor
from placegraph.nodes.grounding.program_syntax import format_program, parse_program
from placegraph.runtime.scene_graph import SceneGraph
from placegraph.tools.simulator.ground_truth_graph import ground_truth_graph
from placegraph.tools.simulator.house_frames import generate_house
from placegraph.tools.simulator.house_model import Floor, House
from placegraph.tools.simulator.questions import HouseQuestion, generate_questions


@cache
def house() -> House:
    return generate_house(2, 2)


@cache
def asked() -> tuple[HouseQuestion, ...]:
    return tuple(generate_questions(house(), 2))


def test_a_house_without_rooms_is_a_graph() -> None:
    floor = Floor(0, 0.0, 2.5, np.array([[0, 0], [4, 0], [4, 3], [0, 3.0]]), (), ())
    assert list(ground_truth_graph(House(0, (floor,), (), ())).nodes) == ["B0", "F0"]


def test_every_item_is_an_object_at_its_place() -> None:
    graph = ground_truth_graph(house())
    assert len(graph.layer("object")) == len(house().items)
    for placed in house().items:
        node = graph.nodes[f"O{placed.id}"]
        assert (node.name, graph.room_of(node.id)) == (placed.item.name, f"R{placed.room}")
        assert np.array_equal(node.box, placed.box)
        assert bool(node.color) == bool(placed.item.color_name)
    assert {node.name for node in graph.layer("room")} == {room.type for room in house().rooms}
    assert [node.name for node in graph.layer("floor")] == ["floor 1", "floor 2"]
    assert SceneGraph.from_json(graph.to_json()).to_json() == graph.to_json()


def test_every_question_has_a_program_of_its_own_words() -> None:
    for one in asked():
        assert format_program(parse_program(one.program)) == one.program
        nouns = [
            parse_program(one.program).noun,
            *(inner.noun for c in parse_program(one.program).conditions for inner in c.things),
        ]
        assert all(noun in one.text.lower() for noun in nouns), (one.text, one.program)


@pytest.mark.parametrize(
    ("form", "part"),
    [("chain", "; near ("), ("between", "between ("), ("two anchors", "near ("), ("left", "left ("), ("room", "room ("),
     ("below", "under ("), ("next to", "near ("), ("farthest", "farthest ("), ("location", "room (")],
)  # fmt: skip
def test_forms_mean_what_they_say(form: str, part: str) -> None:
    programs = [one.program for one in asked() if one.form == form]
    assert programs and all(part in program for program in programs)
    for one in (one for one in asked() if one.form in ("two anchors", "chain", "between")):
        anchors = {house().items[k].item.name for k in one.anchors}
        conditions = [*parse_program(one.program).conditions]
        inner = [c for outer in conditions for thing in outer.things for c in thing.conditions]
        nouns = {thing.noun for c in (*conditions, *inner) for thing in c.things if c.name != "room"}
        assert len(nouns) >= min(len(anchors), 2), one.program
    viewpoints = [one for one in asked() if "from (" in one.program]
    assert viewpoints and all("from the door" in one.text.lower() for one in viewpoints)


def test_programs_find_their_answers() -> None:
    names, graph = NameMatcher(TextEncoder().encode), ground_truth_graph(house())
    right = 0
    for one in asked():
        eye = np.full(3, np.nan) if one.viewpoint is None else one.viewpoint
        ranking = ProgramExecutor(graph, names, eye).rank(Program(target=parse_program(one.program)))
        right += bool(ranking.candidates) and ranking.candidates[0].node.id == f"O{one.target}"
    assert right >= 0.95 * len(asked())
