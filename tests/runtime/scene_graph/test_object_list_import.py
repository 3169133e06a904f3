import json
import logging
import time

import numpy as np
import pytest

from placegraph.runtime.errors import SchemaError
from placegraph.runtime.scene_graph import SceneGraph
from placegraph.runtime.scene_graph.object_list import parse_object_list
from placegraph.runtime.scene_graph.object_list_import import graph_from_object_list, import_graph


def thing(own, x, y, z=0.5, tag="chair", **more):
    return {"id": own, "tags": [tag], "center": [x, y, z], "size": [0.5, 0.5, 1.0], **more}


def square(x0, y0, side):
    return [[x0, y0], [x0 + side, y0], [x0 + side, y0 + side], [x0, y0 + side]]


def scene(objects, **places):
    return graph_from_object_list(parse_object_list({"objects": objects} | places, "x"), "x")


def parents(made):
    """Own id of each object to the path of ids above it, in own ids where there are such."""
    return {
        made.ids[node.id]: [made.ids.get(step.id, step.id) for step in made.graph.path(node.id)[1:-1]]
        for node in made.graph.layer("object")
    }


def test_objects_alone_are_in_one_room_on_one_floor() -> None:
    made = scene([thing("s1", 1, 2, color=[1, 2, 3], front=[0, 2]), thing(7, 3, 0)])
    assert made.ids == {"O0": "s1", "O1": 7}
    assert [node.id for node in made.graph.nodes.values()] == ["B0", "F0", "R0", "O0", "O1"]
    assert made.graph.nodes["R0"].box.tolist() == [[0.75, -0.25, 0], [3.25, 2.25, 1]]
    chair = made.graph.nodes["O0"]
    assert (chair.name, chair.color, chair.front) == ("chair", (1, 2, 3), (0, 1))
    assert chair.footprint.tolist() == [[0.75, 1.75], [1.25, 1.75], [1.25, 2.25], [0.75, 2.25]]
    again = SceneGraph.from_json(made.graph.to_json())
    assert again.to_json() == made.graph.to_json()


def test_an_empty_list_is_an_empty_building() -> None:
    made = scene([])
    assert list(made.graph.nodes) == ["B0"] and made.ids == {}


def test_rooms_by_id_by_outline_by_box_and_none() -> None:
    rooms = [
        {"id": "hall", "outline": square(0, 0, 10)},
        {"id": "bath", "name": "bathroom", "tags": ["toilet"], "outline": square(1, 1, 2)},
        {"id": 3, "center": [20, 0, 1], "size": [4, 4, 2]},
        {"id": 4, "name": "pantry"},
    ]
    objects = [thing("a", 50, 50, room=4), thing("b", 2, 2), thing("c", 8, 8), thing("d", 21, 1), thing("e", 30, 0)]
    made = scene(objects, rooms=rooms)
    assert parents(made) == {
        "a": ["F0", 4], "b": ["F0", "bath"], "c": ["F0", "hall"], "d": ["F0", 3], "e": ["F0", "R4"]
    }  # fmt: skip
    bath = made.graph.nodes["R1"]
    assert [tag.name for tag in bath.tags] == ["bathroom", "toilet"] and bath.footprint.tolist() == square(1, 1, 2)
    assert bath.box.tolist() == [[1, 1, 0], [3, 3, 1]]  # its height is that of what is in it
    assert made.graph.nodes["R3"].box.tolist() == [[49.75, 49.75, 0], [50.25, 50.25, 1]]


def test_floors_by_id_and_by_height() -> None:
    floors = [{"id": "up", "name": "attic", "bottom": 3, "top": 5}, {"id": "down", "bottom": 0}]
    rooms = [
        {"id": 1, "outline": square(0, 0, 5), "floor": "up"},
        {"id": 2, "outline": square(0, 0, 5), "floor": "down"},
        {"id": 3, "center": [8, 0, 4], "size": [1, 1, 2]},
    ]
    objects = [thing("a", 1, 1, 3.5), thing("b", 1, 1), thing("c", 9, 9, 3.5), thing("d", 9, 9, -5)]
    made = scene(objects, rooms=rooms, floors=floors)
    assert parents(made) == {"a": ["up", 1], "b": ["down", 2], "c": ["up", "R3"], "d": ["down", "R4"]}
    assert made.graph.nodes["R2"].parent == "F0" and made.graph.nodes["F0"].name == "attic"
    assert made.graph.nodes["R0"].box.tolist() == [[0, 0, 3], [5, 5, 5]]


def test_a_floor_without_heights_lies_where_its_rooms_are() -> None:
    rooms = [{"id": 1, "floor": "upstairs"}, {"id": 2, "floor": "downstairs"}]
    made = scene([thing("a", 0, 0, 3.5, room=1), thing("b", 0, 0, room=2), thing("c", 5, 5, 3.5)], rooms=rooms)
    assert parents(made) == {"a": ["upstairs", 1], "b": ["downstairs", 2], "c": ["upstairs", "R2"]}
    assert [node.name for node in made.graph.layer("floor")] == ["upstairs", "downstairs"]


def test_floors_without_rooms_hold_objects_by_height() -> None:
    made = scene([thing("a", 0, 0, 3.5), thing("b", 0, 0)], floors=[{"id": 0, "bottom": 0}, {"id": 1, "bottom": 3}])
    assert parents(made) == {"a": [1, "R0"], "b": [0, "R1"]}


def test_rooms_that_only_objects_name_have_their_ids_as_names() -> None:
    made = scene([thing("a", 0, 0, room="kitchen"), thing("b", 5, 0, room=12)])
    assert [(node.name, made.ids[node.id]) for node in made.graph.layer("room")] == [
        ("kitchen", "kitchen"),
        ("room", 12),
    ]


def test_a_place_that_is_nowhere_is_left_out(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING):
        made = scene([thing("a", 0, 0)], rooms=[{"id": "r9", "name": "cellar"}])
    assert [made.ids.get(node.id) for node in made.graph.layer("room")] == [None]
    assert caplog.messages == ["x: left out 'r9': nothing is in it and nothing says where it is"]


def test_five_thousand_objects_load_fast(tmp_path) -> None:
    random = np.random.default_rng(0)
    objects = [thing(f"s{i}", *random.uniform(0, 100, 2).tolist()) for i in range(5000)]
    rooms = [{"id": i, "outline": square(i % 10 * 10, i // 10 * 10, 9)} for i in range(100)]
    file = tmp_path / "large.json"
    file.write_text(json.dumps({"objects": objects, "rooms": rooms}))
    began = time.process_time()  # not elapsed: other jobs run on this machine
    made = import_graph(file)
    assert time.process_time() - began < 1.0
    assert len(made.ids) == 5100


def test_files(tmp_path) -> None:
    made = scene([thing("a", 0, 0)])
    made.graph.save(tmp_path / "graph.json")
    assert import_graph(tmp_path / "graph.json").graph.to_json() == made.graph.to_json()
    assert import_graph(tmp_path / "graph.json").ids == {}
    for text in ("[]", "{}", "3", '{"nodes": []}'):
        (tmp_path / "x.json").write_text(text)
        with pytest.raises(SchemaError, match=r"x\.json: expected a scene graph, or an object list"):
            import_graph(tmp_path / "x.json")
    (tmp_path / "x.json").write_text('{"objects": [{}]}')
    with pytest.raises(SchemaError, match=r"x\.json: objects\[0\]\.id: Field required"):
        import_graph(tmp_path / "x.json")
