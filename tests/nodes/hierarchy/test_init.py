import pytest
from pydantic import ValidationError

from placegraph.nodes.hierarchy import NODE
from placegraph.runtime.messages import Map
from placegraph.runtime.messages.codec import encode
from placegraph.runtime.node import Context
from placegraph.runtime.scene_graph import SceneGraph

OBJECTS = {3: ("table", (1.0, 1.0, 0.0), (2.2, 1.8, 0.75)), 7: ("chair", (2.4, 1.0, 0.0), (2.9, 1.5, 0.9))}


def make():
    return NODE(NODE.config_type(), Context())


@pytest.fixture
def maps(make_map, house_points, walk) -> list[Map]:
    return [make_map(house_points(1), walk(1), OBJECTS, revision=r, final=r == 1) for r in range(2)]


def test_a_map_gives_an_unnamed_graph_with_its_own_stamp(maps):
    (graph,) = make().step(maps[1])
    encode(graph)
    assert (graph.frame_id, graph.stamp_ns, graph.revision, graph.final) == (101, 5, 1, True)
    assert all(node.tags == () for node in SceneGraph.from_json(graph.json).layer("room"))


def test_an_equal_map_gives_an_equal_graph(maps):
    node = make()
    node.step(maps[0])
    (graph,) = node.step(maps[1])
    assert graph.json == make().step(maps[1])[0].json


def test_unknown_settings_are_refused_in_every_layer():
    with pytest.raises(ValidationError, match=r"rooms.wal_share"):
        NODE.config_type.model_validate({"rooms": {"wal_share": 1.0}})
