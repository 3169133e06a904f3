import pytest

from placegraph.nodes.grounding import NODE, GroundingConfig
from placegraph.runtime.errors import ModelError, SchemaError
from placegraph.runtime.node import Context


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


def test_a_broken_graph_is_refused(node, graph_message, house):
    message = graph_message(house)
    object.__setattr__(message, "json", "{}")
    with pytest.raises(SchemaError, match="revision 1"):
        node.step(message)


def test_a_graph_gives_nothing_and_is_asked_from_then_on(ask, graph_message, house):
    made = NODE(GroundingConfig(use_model=False), Context())
    assert ask(made, "find the lamp")["error"] == "no scene graph has arrived yet"
    assert list(made.step(graph_message(house, revision=5))) == []
    assert ask(made, "the sofa")["revision"] == 5


def test_a_type_of_place_is_understood_where_the_map_has_none(ask, graph_message, house):
    made = NODE(GroundingConfig(use_model=False), Context())
    made.step(graph_message(house))
    answer = ask(made, "the lamp in the garage")
    assert answer["parse"]["text"] == ask(made, "the lamp in the kitchen")["parse"]["text"].replace("kitchen", "garage")


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
