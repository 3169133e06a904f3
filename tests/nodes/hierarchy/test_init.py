import numpy as np
import pytest
from pydantic import ValidationError

from placegraph.nodes.hierarchy import NODE
from placegraph.runtime.errors import SchemaError
from placegraph.runtime.messages import Map, PlaceNames
from placegraph.runtime.messages.codec import encode
from placegraph.runtime.node import Context
from placegraph.runtime.scene_graph import SceneGraph

OBJECTS = {3: ("table", (1.0, 1.0, 0.0), (2.2, 1.8, 0.75)), 7: ("chair", (2.4, 1.0, 0.0), (2.9, 1.5, 0.9))}


def make():
    return NODE(NODE.config_type(), Context())


def names(revision, ids, words, weights):
    return PlaceNames(
        frame_id=0,
        stamp_ns=0,
        revision=revision,
        final=False,
        ids=tuple(ids),
        names=tuple(words),
        weights=np.array(weights, np.float32),
    )


@pytest.fixture
def maps(make_map, house_points, walk) -> list[Map]:
    return [make_map(house_points(1), walk(1), OBJECTS, revision=r, final=r == 1) for r in range(2)]


def test_names_before_any_map_are_ignored():
    assert make().step(names(0, ["R0"], ["kitchen"], [1.0])) == []


def test_a_map_gives_an_unnamed_graph_with_its_own_stamp(maps):
    (graph,) = make().step(maps[1])
    encode(graph)
    assert (graph.frame_id, graph.stamp_ns, graph.revision) == (101, 5, 1)
    assert graph.final and not graph.named
    assert all(node.tags == () for node in SceneGraph.from_json(graph.json).layer("room"))


def test_names_of_this_revision_are_applied_best_first(maps):
    node = make()
    node.step(maps[0])
    (graph,) = node.step(names(0, ["R0", "R0", "L0"], ["hall", "kitchen", "dining area"], [0.2, 0.8, 1.0]))
    encode(graph)
    assert graph.named and not graph.final and graph.frame_id == 100
    read = SceneGraph.from_json(graph.json)
    assert [tag.name for tag in read.nodes["R0"].tags] == ["kitchen", "hall"]
    assert read.nodes["L0"].name == "dining area" and read.nodes["R1"].tags == ()


def test_late_names_are_ignored_and_earlier_ones_not_carried_over(maps):
    node = make()
    node.step(maps[0])
    node.step(names(0, ["R0"], ["kitchen"], [1.0]))
    (graph,) = node.step(maps[1])
    assert node.step(names(0, ["R0"], ["hall"], [1.0])) == []
    assert graph.json == make().step(maps[1])[0].json


def test_names_touch_nothing_but_tags_of_places(maps):
    node = make()
    (before,) = node.step(maps[0])
    (after,) = node.step(names(0, ["R1"], ["bedroom"], [0.5]))
    old, new = SceneGraph.from_json(before.json), SceneGraph.from_json(after.json)
    assert list(old.nodes) == list(new.nodes)
    assert before.json.replace('"id":"R1"', "") != before.json
    assert SceneGraph.from_json(after.json).nodes["R1"].name == "bedroom"
    assert after.json.replace('"tags":[["bedroom",0.5]]', '"tags":[]') == before.json


def test_no_names_at_all_give_the_graph_as_named(maps):
    node = make()
    (before,) = node.step(maps[1])
    (after,) = node.step(names(1, [], [], []))
    assert after.named and after.final and after.json == before.json


@pytest.mark.parametrize("wrong", ["R9", "O3", "F0"])
def test_names_for_what_is_no_place_are_refused(maps, wrong):
    node = make()
    node.step(maps[0])
    with pytest.raises(SchemaError, match=f"revision 0: '{wrong}' is no room or location"):
        node.step(names(0, [wrong], ["kitchen"], [1.0]))


def test_unknown_settings_are_refused_in_every_layer():
    with pytest.raises(ValidationError, match=r"rooms.wal_share"):
        NODE.config_type.model_validate({"rooms": {"wal_share": 1.0}})
