import dataclasses
import json

import numpy as np
import pytest

from placegraph.runtime.errors import SchemaError
from placegraph.runtime.scene_graph import GraphNode, SceneGraph
from placegraph.runtime.scene_graph.place_graph import Approach, Connection, RouteSegment


def node(node_id: str, parent: str, **more: object) -> GraphNode:
    fields: dict = {"tags": (), "box": np.array([[0, 0, 0], [1, 1, 1]], float), "footprint": np.zeros((0, 2))}
    return GraphNode(id=node_id, parent=parent, first_frame=0, last_frame=1, **(fields | more))


def nodes(approach: Approach | None = None) -> list[GraphNode]:
    rooms = [node(f"R{i}", "F0") for i in (0, 1, 2)]
    return [node("B0", ""), node("F0", "B0"), *rooms, node("O1", "R1", approach=approach)]


def door(**changes: object) -> Connection:
    ends = np.array([[4.0, 1, 0], [4, 1, 0]])
    fields: dict = {"id": "C0", "kind": "door", "rooms": ("R0", "R1"), "ends": ends, "width_m": 0.9, "length_m": 0.0}
    return Connection(**(fields | changes))


def segment(**changes: object) -> RouteSegment:
    points = np.array([[4.0, 1], [6, 1]])
    return RouteSegment(**({"room": "R1", "ends": ("C0", "R1"), "length_m": 2.0, "points": points} | changes))


APPROACH = Approach((5.0, 1.0, 0.0), 1.5, (("C0", 1.2), ("R1", 0.4)))


def test_ends_of_a_connection() -> None:
    stairs = door(kind="stairs", ends=np.array([[0.0, 0, 0], [3, 0, 3]]), length_m=4.3)
    assert stairs.end_in("R1").tolist() == [3, 0, 3] and stairs.room_beyond("R1") == "R0"


def test_canonical_json_holds_the_place_graph_and_does_not_depend_on_the_order_of_making() -> None:
    two = door(id="C10"), door(id="C2", rooms=("R1", "R2"))
    route_segments = [segment(), segment(ends=("C10", "C2"), points=np.array([[4.0, 1], [4, 1]]), length_m=0.0)]
    graph = SceneGraph.of(nodes(APPROACH), [door(), *two], route_segments)
    text = graph.to_json()
    assert SceneGraph.of(nodes(APPROACH)[::-1], [*two[::-1], door()], route_segments[::-1]).to_json() == text
    again = SceneGraph.from_json(text)
    assert again.to_json() == text and list(again.connections) == ["C0", "C2", "C10"]
    assert again.nodes["O1"].approach == APPROACH and again.nodes["R0"].approach is None
    assert graph.with_nodes(nodes()).connections == graph.connections
    assert graph.room_of("O1") == "R1" and graph.room_of("F0") == ""


@pytest.mark.parametrize(
    ("connections", "route_segments", "problem"),
    [
        ([door(id="D0")], [], "'D0' is not a connection's id"),
        ([door(), door()], [], "id C0 appears more than once"),
        ([door(rooms=("R0", "R7"))], [], "C0: R7 is no room"),
        ([door(rooms=("R0", "F0"))], [], "C0: F0 is no room"),
        ([door(rooms=("R0", "R0"))], [], "C0: must join two rooms"),
        ([door(kind="gate")], [], "C0: kind must be one of door, opening, stairs, found 'gate'"),
        ([door(width_m=0.0)], [], "C0: width_m must be above 0"),
        ([door(ends=np.full((2, 3), np.nan))], [], "C0: ends must be"),
        ([door(ends=np.array([[0.0, 0, 0], [3, 0, 4]]), length_m=4.9)], [], r"not at least the straight line, 5\.000"),
        ([door()], [segment(room="R9")], "R9 is no room"),
        ([door()], [segment(room="R2")], "C0 is neither R2 nor one of its connections"),
        ([door()], [segment(ends=("C0", "C1"))], "C1 is neither R1"),
        ([door()], [segment(length_m=1.9)], "not at least the straight line"),
        ([door()], [segment(length_m=np.inf)], "not at least the straight line"),
        ([door()], [segment(points=np.zeros((1, 2)))], "points must be"),
    ],
)
def test_broken_invariants_are_named(
    connections: list[Connection], route_segments: list[RouteSegment], problem: str
) -> None:
    with pytest.raises(SchemaError, match=problem):
        SceneGraph.of(nodes(), connections, route_segments)


@pytest.mark.parametrize(
    ("changes", "problem"),
    [
        ({"position": (np.nan, 0.0, 0.0)}, "O1: approach must be 3 finite numbers"),
        ({"yaw_rad": np.inf}, "O1: approach must be 3 finite numbers"),
        ({"travel_m": (("C5", 1.0),)}, "C5 is neither R1"),
        ({"travel_m": (("C0", 0.9),)}, r"approach from C0: length 0\.9 m is not at least"),
    ],
)
def test_broken_approaches_are_named(changes: dict[str, object], problem: str) -> None:
    with pytest.raises(SchemaError, match=problem):
        SceneGraph.of(nodes(dataclasses.replace(APPROACH, **changes)), [door()])


@pytest.mark.parametrize(
    ("name", "value", "problem"),
    [
        ("connections", {}, "connections: Input should be a valid array"),
        ("ways", None, "ways: Input should be a valid array"),
        ("connections", [3], r"connections\[0\]: Input should be an object"),
        ("connections", [{"id": "C0"}], r"connections\[0\]\.kind: Field required"),
        ("ways", [{"room": "R0", "ends": ["C0"]}], r"ways\[0\]\.ends"),
    ],
)
def test_bad_entries_are_named(name: str, value: object, problem: str) -> None:
    data = json.loads(SceneGraph.of(nodes()).to_json()) | {name: value}
    with pytest.raises(SchemaError, match=problem):
        SceneGraph.from_json(json.dumps(data))


@pytest.mark.parametrize("approach", [3, [], {"position": [0, 0], "yaw_rad": 0, "travel_m": {}}, {"travel_m": []}])
def test_bad_approaches_are_named(approach: object) -> None:
    data = json.loads(SceneGraph.of(nodes()).to_json())
    data["nodes"][-1]["approach"] = approach
    with pytest.raises(SchemaError, match=r"nodes\[5\]\.approach"):
        SceneGraph.from_json(json.dumps(data))
