import json
from pathlib import Path

import numpy as np
import pytest

from placegraph.runtime.errors import SchemaError
from placegraph.runtime.scene_graph import GraphNode, SceneGraph, Tag


def node(node_id: str, parent: str, **changes: object) -> GraphNode:
    fields: dict = {
        "tags": (),
        "box": np.array([[0, 0, 0], [1, 1, 1]], float),
        "footprint": np.zeros((0, 2)),
        "first_frame": 0,
        "last_frame": 1,
    }
    return GraphNode(id=node_id, parent=parent, **(fields | changes))


def house() -> list[GraphNode]:
    chain = [node("B0", ""), node("F0", "B0"), node("R0", "F0"), node("R10", "F0"), node("R2", "F0")]
    return [*chain, node("L0", "R2"), node("O5", "L0", tags=(Tag("cup", 1.23456),)), node("O3", "R0")]


def test_smallest_graph() -> None:
    graph = SceneGraph.of([node("B0", "")])
    assert graph.building.id == "B0" and graph.layer("object") == [] and graph.children("B0") == []


def test_walks() -> None:
    graph = SceneGraph.of(house())
    assert [n.id for n in graph.layer("room")] == ["R0", "R2", "R10"]
    assert [n.id for n in graph.path("O5")] == ["B0", "F0", "R2", "L0", "O5"]
    assert [n.id for n in graph.descendants("F0", "object")] == ["O3", "O5"]
    assert [n.id for n in graph.descendants("R2", "object")] == ["O5"]
    assert [n.id for n in graph.children("F0")] == ["R0", "R2", "R10"]
    assert graph.nodes["O5"].name == "cup" and graph.nodes["R0"].name == "room"


@pytest.mark.parametrize(
    ("nodes", "problem"),
    [
        ([], "expected one building, found 0"),
        ([node("B0", ""), node("B1", "")], "expected one building, found 2"),
        ([node("B0", ""), node("B0", "")], "id B0 appears more than once"),
        ([node("B0", ""), node("O1", "R9")], "O1: parent R9 is not in the graph"),
        ([node("B0", ""), node("O1", "B0")], "O1: a object cannot hang from the building B0"),
        ([node("B0", "B0")], "B0: a building has no parent"),
        ([node("B0", ""), node("X1", "B0")], "'X1' is not an id"),
        ([node("B0", ""), node("F01", "B0")], "'F01' is not an id"),
        ([node("B0", "", box=np.array([[1, 0, 0], [0, 1, 1]], float))], "B0: box must be"),
        ([node("B0", "", box=np.full((2, 3), np.nan))], "B0: box must be"),
        ([node("B0", "", footprint=np.zeros((2, 3)))], "B0: footprint must be"),
    ],
)
def test_broken_invariants_are_named(nodes: list[GraphNode], problem: str) -> None:
    with pytest.raises(SchemaError, match=problem):
        SceneGraph.of(nodes)


def test_canonical_json_does_not_depend_on_the_order_of_making(tmp_path: Path) -> None:
    text = SceneGraph.of(house()).to_json()
    assert SceneGraph.of(house()[::-1]).to_json() == text
    assert SceneGraph.from_json(text).to_json() == text
    SceneGraph.of(house()).save(tmp_path / "graph.json")
    assert SceneGraph.load(tmp_path / "graph.json").to_json() == text


def test_rounding_and_minus_zero() -> None:
    tiny = SceneGraph.of([node("B0", "", box=np.array([[-0.0001, 0.12345, 0], [1, 1, 1]]))])
    box = json.loads(tiny.to_json())["nodes"][0]["box"]
    assert box[0] == [0.0, 0.123, 0.0] and "-0.0" not in tiny.to_json()


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("", "not JSON"),
        ("[]", "Input should be an object"),
        ('{"version": 1}', "expected graph version 2, found 1"),
        ('{"version": 3}', "expected graph version 2, found 3"),
        ('{"version": 2}', "nodes: Field required"),
        ('{"version": 2, "nodes": [3], "connections": [], "ways": []}', r"nodes\[0\]: Input should be an object"),
        (
            '{"version": 2, "nodes": [{"id": "B0"}], "connections": [], "ways": []}',
            r"nodes\[0\]\.parent: Field required",
        ),
    ],
)
def test_bad_files_are_named_with_node_and_field(tmp_path: Path, text: str, problem: str) -> None:
    path = tmp_path / "graph.json"
    path.write_text(text)
    with pytest.raises(SchemaError, match=problem) as error:
        SceneGraph.load(path)
    assert str(path) in str(error.value)
    with pytest.raises(SchemaError, match="cannot read"):
        SceneGraph.load(tmp_path / "absent.json")


def test_a_front_is_kept_and_must_be_a_direction() -> None:
    graph = SceneGraph.of([*house(), node("O7", "R0", front=(0.0, -1.0))])
    assert SceneGraph.from_json(graph.to_json()).nodes["O7"].front == (0.0, -1.0)
    with pytest.raises(SchemaError, match="front"):
        SceneGraph.of([*house(), node("O7", "R0", front=(0.0, 0.0))])
