import json

import numpy as np
import pytest

from placegraph.runtime.scene_graph import GraphNode, SceneGraph, Tag
from placegraph.runtime.scene_graph.place_graph import Approach, Connection, RouteSegment


def node(node_id: str, parent: str, name: str = "", **more: object) -> GraphNode:
    tags = (Tag(name, 1.0),) if name else ()
    box = np.array([[0, 0, 0], [1, 1, 1]], float)
    fields: dict = {"tags": tags, "box": box, "footprint": np.zeros((0, 2)), "first_frame": 0, "last_frame": 1}
    return GraphNode(id=node_id, parent=parent, **(fields | more))


@pytest.fixture
def file(tmp_path):
    """Kitchen R0, door C0, hall R1, stairs C1, bedroom R2; bedroom R3 behind nothing."""
    nodes = [
        node("B0", ""), node("F0", "B0", "floor 1"), node("F1", "B0", "floor 2"), node("R0", "F0", "kitchen"),
        node("R1", "F0", "Hall"), node("R2", "F1", "bedroom"), node("R3", "F1", "bedroom"), node("O4", "R0", "cup"),
        node("O5", "R2", "bed", approach=Approach((8.0, 1.0, 3.0), 1.5708, (("C1", 3.0),))), node("O6", "R3", "hall"),
    ]  # fmt: skip
    connections = [
        Connection(id="C0", kind="door", rooms=("R0", "R1"), ends=np.array([[4.0, 1, 0]] * 2), width_m=0.8, length_m=0),
        Connection(
            id="C1", kind="stairs", rooms=("R1", "R2"), ends=np.array([[6.0, 1, 0], [6, 3, 3]]), width_m=1.0, length_m=4
        ),
    ]
    route_segments = [
        RouteSegment(room="R0", ends=("C0", "R0"), length_m=2.0, points=np.array([[4.0, 1], [2, 1]])),
        RouteSegment(room="R1", ends=("C0", "C1"), length_m=2.0, points=np.array([[4.0, 1], [6, 1]])),
    ]
    SceneGraph.of(nodes, connections, route_segments).save(tmp_path / "graph.json")
    return tmp_path / "graph.json"


def test_names_in_words(cli, file) -> None:
    done = cli("path", file, "Kitchen", "bed")
    assert (done.code, done.err) == (0, "")
    lines = done.out.splitlines()
    assert lines[0] == "R0 kitchen to O5 bed: 11.00 m"
    assert lines[1:6] == [
        "  R0 kitchen", "  through door C0 at (4.00, 1.00, 0.00), 0.80 m wide", "  R1 Hall",
        "  through stairs C1 at (6.00, 2.00, 1.50), 1.00 m wide, 4.00 m long", "  R2 bedroom",
    ]  # fmt: skip
    assert lines[6].startswith("way points: (2.00, 1.00, 0.00) (4.00, 1.00, 0.00) (6.00, 1.00, 0.00)")
    assert lines[7] == "there look to 90 degrees"


def test_ids_as_json(cli, file) -> None:
    found = json.loads(cli("path", file, "r0", "O5", "--json").out)
    assert [step["id"] for step in found["steps"]] == ["R0", "C0", "R1", "C1", "R2"]
    assert (found["from"], found["to"], found["length_m"], found["straight"]) == ("R0", "O5", 11, False)
    assert found["points"] == [[2, 1, 0], [4, 1, 0], [6, 1, 0], [6, 3, 3], [8, 1, 3]]
    assert found["arrival_yaw_rad"] == 1.571 and found["steps"][1]["kind"] == "door"


@pytest.mark.parametrize(
    ("start", "goal", "reason"),
    [
        ("kitchen", "cellar", "nothing in the map is called 'cellar'; its rooms: R0 kitchen, R1 Hall, R2 bedroom"),
        ("bedroom", "kitchen", "'bedroom' names 2 rooms: R2, R3; give an id"),
        ("kitchen", "R9", "nothing in the map is called 'R9'"),
        ("kitchen", "F1", "a floor is no place to go to"),
        ("kitchen", "cup", "cup O4: the map knows no place to stand before it"),
        ("kitchen", "R3", "no way is known from R0 kitchen to R3 bedroom"),
    ],
)
def test_what_cannot_be_answered_has_a_reason(cli, file, start, goal, reason) -> None:
    done = cli("path", file, start, goal)
    assert done.code == 1 and done.out == "" and reason in done.reason


def test_a_real_map(cli, mapped) -> None:
    graph = SceneGraph.load(mapped / "graph.json")
    room = graph.layer("room")[0]
    thing = next(one for one in graph.descendants(room.id, "object") if one.approach and one.approach.travel_m)
    found = json.loads(cli("path", mapped, room.id, thing.id, "--json").out)
    assert [step["id"] for step in found["steps"]] == [room.id]
    assert found["length_m"] == dict(thing.approach.travel_m)[room.id] and not found["straight"]
    assert found["points"][-1] == list(thing.approach.position)
