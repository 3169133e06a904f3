import numpy as np
import pytest

from placegraph.nodes.grounding import NODE, GroundingConfig
from placegraph.runtime.errors import ConfigError, ModelError, SchemaError
from placegraph.runtime.messages.codec import encode
from placegraph.runtime.node import Context
from placegraph.runtime.scene_graph import SceneGraph


@pytest.fixture(scope="module")
def node():
    """The node with the packaged language model."""
    made = NODE(GroundingConfig(), Context())
    made.start()
    yield made
    made.stop()


def test_a_missing_model_is_named():
    with pytest.raises(ModelError, match=r"/nowhere/model\.gguf"):
        NODE(GroundingConfig(model_path="/nowhere/model.gguf"), Context()).start()


def test_a_file_that_is_no_model_is_named(tmp_path):
    path = tmp_path / "model.gguf"
    path.write_bytes(b"no model")
    with pytest.raises(ModelError, match=r"model\.gguf: llama\.cpp cannot load it"):
        NODE(GroundingConfig(model_path=str(path)), Context()).start()


def test_place_types_that_could_break_a_prompt_are_refused():
    for types in ([], ['kitchen" |']):
        with pytest.raises(ConfigError, match="room_types"):
            NODE(GroundingConfig(room_types=types), Context())


def test_a_broken_graph_is_refused(node, graph_message, house):
    message = graph_message(house)
    object.__setattr__(message, "json", "{}")
    with pytest.raises(SchemaError, match="revision 1"):
        node.step(message)


def test_a_graph_without_places_gives_empty_names(node, graph_message, node_of):
    graph = SceneGraph.of([node_of("B0", "", "building", (0, 0, 0), (1, 1, 1))])
    (names,) = node.step(graph_message(graph, named=False, revision=5, final=True))
    assert (names.revision, names.final, names.ids, names.weights.shape) == (5, True, (), (0,))
    assert encode(names)


def test_a_named_graph_gives_nothing(node, graph_message, house):
    assert list(node.step(graph_message(house, named=True))) == []


def test_naming_can_be_switched_off(graph_message, unnamed_house):
    made = NODE(GroundingConfig(name_places=False), Context())
    (names,) = made.step(graph_message(unnamed_house, named=False))
    assert names.ids == ()


def test_rooms_are_named_by_what_they_hold(node, graph_message, unnamed_house):
    (first,) = node.step(graph_message(unnamed_house, named=False, revision=1))
    (again,) = node.step(graph_message(unnamed_house, named=False, revision=2))
    assert (first.ids, first.names) == (again.ids, again.names)
    np.testing.assert_array_equal(first.weights, again.weights)
    best = dict(reversed(list(zip(first.ids, first.names, strict=True))))
    assert (best["R1"], best["R2"]) == ("living room", "bedroom")
    # four chairs, a table and cups: a dining room, if not a kitchen
    assert "kitchen" in [name for i, name in zip(first.ids, first.names, strict=True) if i == "R0"]
    for place in ("R0", "R1", "R2", "L0"):
        weights = [w for i, w in zip(first.ids, first.weights, strict=True) if i == place]
        assert len(weights) == 3
        assert sum(weights) == pytest.approx(1, abs=1e-5)
        assert weights == sorted(weights, reverse=True)


def test_names_do_not_depend_on_what_was_asked_before(graph_message, unnamed_house, ask):
    made = NODE(
        GroundingConfig(room_types=["kitchen", "bedroom"], location_types=["work area", "dining area"]), Context()
    )
    (before,) = made.step(graph_message(unnamed_house, named=False))
    other = NODE(
        GroundingConfig(room_types=["kitchen", "bedroom"], location_types=["work area", "dining area"]), Context()
    )
    other.step(graph_message(unnamed_house, named=True))
    ask(other, "I read my book and want the lamp")
    (after,) = other.step(graph_message(unnamed_house, named=False))
    other.stop()
    made.stop()
    assert before.names == after.names
    np.testing.assert_array_equal(before.weights, after.weights)


def test_a_purpose_is_put_to_the_model(node, ask, graph_message, house):
    node.step(graph_message(house))
    answer = ask(node, "where can I sleep?")
    assert (answer["object_id"], answer["sure"]) == ("O15", False)
    assert answer["llm_calls"] >= 1


def test_of_tied_ones_the_lowest_id_stands_first_and_it_is_not_sure(node, ask, graph_message, house):
    node.step(graph_message(house))
    answer = ask(node, "the nightstand", mode="rules")
    assert (answer["object_id"], answer["llm_calls"], answer["sure"]) == ("O16", 0, False)
    assert "2 candidates fit equally: O16, O17" in answer["evidence"]


def test_the_model_reads_whatever_was_asked_before(node, ask, graph_message, house):
    node.step(graph_message(house))
    first, second = "find the lamp", "a nightstand"
    answers = [ask(node, text, mode="program") for text in (first, second, first)]
    assert answers[0] == answers[2]
    for answer in answers:
        assert answer["status"] in ("found", "not_in_map")
        assert (answer["parse"]["reader"], answer["llm_calls"]) == ("model", 1)


def test_the_deductive_mode_is_asked_for_by_its_name(node, ask, graph_message, house):
    node.step(graph_message(house))
    answer = ask(node, "find the lamp upstairs", mode="deductive")
    assert answer["status"] in ("found", "not_in_map")
    assert answer["evidence"][0] == "read level by level (deductive mode)"
    assert answer["llm_calls"] >= 2
    assert set(answer["parse"]) == {"floors", "rooms", "locations", "targets", "anchors"}


def test_a_doubtful_reading_gives_way_to_the_deductive_mode_openly(node, ask, graph_message, house, monkeypatch):
    node.step(graph_message(house))
    monkeypatch.setattr("placegraph.nodes.grounding.reasoner.MIN_CONFIDENCE", 1.1)
    found = ask(node, "the vase near the sofa", mode="program")
    assert any("doubtful" in sentence and "level by level" in sentence for sentence in found["evidence"])
    assert found["llm_calls"] > 1 and (found["object_id"] is None or found["object_id"] in house.nodes)
    # what nobody in the map is called is not asked for twice
    assert not any("level by level" in sentence for sentence in ask(node, "flurb gnax", mode="program")["evidence"])
