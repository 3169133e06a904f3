import json

import numpy as np
import pytest

from placegraph.nodes.naming import NODE, NamingConfig
from placegraph.nodes.naming.place_types import LOCATION_TYPES, ROOM_TYPES
from placegraph.runtime.errors import ConfigError, ModelError, SchemaError
from placegraph.runtime.language.language_model import LanguageModel
from placegraph.runtime.messages.codec import encode
from placegraph.runtime.node import Context
from placegraph.runtime.scene_graph import SceneGraph

UNKNOWN_TYPES = {"room_types": ["kitchen", "bedroom", "sauna"], "location_types": ["sauna bench", "dining area"]}


def make(**settings):
    return NODE(NamingConfig(**settings), Context())


def names_of(message):
    graph = SceneGraph.from_json(message.json)
    return {node.id: node.tags for layer in ("room", "location") for node in graph.layer(layer)}


def test_a_missing_model_is_named_before_it_is_needed():
    with pytest.raises(ModelError, match=r"/nowhere/model\.gguf"):
        make(model_path="/nowhere/model.gguf").start()
    make(model_path="/nowhere/model.gguf", method="none").start()


@pytest.mark.parametrize("types", [[], ['kitchen" |']])
@pytest.mark.parametrize("setting", ["room_types", "location_types"])
def test_types_that_could_break_a_grammar_are_refused(setting, types):
    with pytest.raises(ConfigError, match=rf"\[nodes\.naming\] {setting}: names of letters"):
        make(**{setting: types})


def test_a_broken_graph_is_refused(message_of, house):
    message = message_of(house, revision=3)
    object.__setattr__(message, "json", "{}")
    with pytest.raises(SchemaError, match="Graph of revision 3"):
        make().step(message)


def test_a_graph_without_places_comes_back_as_it_is(message_of, graph_of):
    message = message_of(graph_of({"B0": ""}, {}), revision=5, final=True)
    (named_graph,) = make().step(message)
    encode(named_graph)
    assert named_graph.json == message.json
    assert (named_graph.frame_id, named_graph.stamp_ns, named_graph.revision, named_graph.final) == (7, 9, 5, True)
    assert named_graph.place_types == (*ROOM_TYPES, *LOCATION_TYPES)


def test_naming_can_be_switched_off(message_of, house):
    message = message_of(house)
    (named_graph,) = make(method="none").step(message)
    assert named_graph.json == message.json


def test_rooms_are_named_by_what_they_hold_without_the_model(message_of, house, monkeypatch):
    monkeypatch.setattr(LanguageModel, "load", lambda self: pytest.fail("the table knows all of these"))
    node = make()
    node.start()
    first, again = (node.step(message_of(house, revision))[0] for revision in (1, 2))
    assert first.json == again.json
    names = names_of(first)
    assert [names[place][0].name for place in ("R1", "R2", "L0")] == ["living room", "bedroom", "dining area"]
    # four chairs, a table and cups: a dining room, if not a kitchen
    assert "kitchen" in [tag.name for tag in names["R0"]]
    for tags in names.values():
        weights = [tag.weight for tag in tags]
        assert len(weights) == 3 and weights == sorted(weights, reverse=True)
        assert sum(weights) == pytest.approx(1, abs=0.002)


def test_a_node_that_was_started_again_gives_the_same_graph(message_of, house, graph_of):
    assert NODE.restartable
    node = make()
    node.step(message_of(graph_of({"B0": "", "F0": "B0", "R0": "F0"}, {"R0": ["bed", "lamp"]})))
    message = message_of(house, revision=2)
    assert node.step(message)[0].json == make().step(message)[0].json


def test_nothing_but_tags_of_places_changes(message_of, house):
    (named_graph,) = make().step(message_of(house))
    before, after = json.loads(house.to_json()), json.loads(named_graph.json)
    for node in after["nodes"]:
        if node["id"][0] in "RL":
            node["tags"] = []
    assert after == before


def test_a_place_without_a_named_object_gets_no_name(message_of, graph_of):
    graph = graph_of({"B0": "", "F0": "B0", "R0": "F0", "R1": "F0"}, {"R1": [""]})
    assert names_of(make().step(message_of(graph))[0]) == {"R0": (), "R1": ()}


def test_the_model_is_asked_for_types_that_the_table_lacks_whatever_was_named_before(message_of, house, graph_of):
    first, second = make(**UNKNOWN_TYPES), make(**UNKNOWN_TYPES)
    second.step(message_of(graph_of({"B0": "", "F0": "B0", "R0": "F0"}, {"R0": ["zither", "lamp"]})))
    results = [node.step(message_of(house))[0].json for node in (first, second)]
    assert results[0] == results[1]
    for node in (first, second):
        node.stop()


def test_the_context_is_as_good_as_the_default_one_for_single_objects():
    """Bit for bit: what the table lacks is named the same in a smaller context. (contract)"""
    texts = ("A bed is found in the bedroom. A", " zither is found in the", [" bedroom", " living room"])
    small, default = LanguageModel(n_ctx=NamingConfig().n_ctx), LanguageModel()
    np.testing.assert_array_equal(small.log_probabilities(*texts), default.log_probabilities(*texts))
    small.close()
    default.close()
