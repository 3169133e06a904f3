from importlib import resources

import numpy as np
import pytest

from placegraph.models_onnx.text_encoder import TextEncoder
from placegraph.nodes.naming.place_evidence import ANYWHERE, GROUP_WEIGHTS, REFERENCE_OBJECTS, PlaceEvidence, _table
from placegraph.nodes.naming.place_types import LOCATION_TYPES, ROOM_TYPES


class FakeLogProbabilities:
    """Remembers what it is asked; it prefers the first type for a sauna stove, else none."""

    def __init__(self, count):
        self.count, self.asked = count, []

    def __call__(self, thing):
        self.asked.append(thing)
        liked = np.zeros(self.count)
        liked[0] = 8.0 if thing == "sauna stove" else 0.1 * len(self.asked)
        return liked


@pytest.fixture
def evidence_of():
    def make(layer, place_types):
        model = FakeLogProbabilities(len(place_types))
        return PlaceEvidence(layer, place_types, TextEncoder(), model), model

    return make


def test_the_table_knows_the_default_types_and_holds_no_object_twice_in_a_line():
    for layer, place_types in (("room", ROOM_TYPES), ("location", LOCATION_TYPES)):
        lines = {line.rstrip("*"): groups for line, groups in _table()[layer].items()}
        assert set(place_types) <= set(lines)
        for line, groups in lines.items():
            things = [thing for group in groups for thing in group]
            assert len(groups) == len(GROUP_WEIGHTS) and len(set(things)) == len(things), line
    everywhere = set(_table()[ANYWHERE][ANYWHERE][0])
    told = {
        thing for layer in ("room", "location") for groups in _table()[layer].values() for g in groups for thing in g
    }
    assert not everywhere & told


def test_objects_of_the_table_ask_nothing(evidence_of):
    rooms, model = evidence_of("room", ROOM_TYPES)
    for tag, kind in (("bed", "bedroom"), ("couch", "living room"), ("Toilets", "bathroom"), ("gas stove", "kitchen")):
        row = rooms.weights(tag)
        assert ROOM_TYPES[int(row.argmax())] == kind and row.max() == GROUP_WEIGHTS[0]
    assert not rooms.weights("window").any()
    assert model.asked == []
    locations, model = evidence_of("location", LOCATION_TYPES)
    assert not locations.weights("door").any()  # the table holds it for rooms alone
    assert model.asked == []


def test_the_tags_of_the_embedded_networks_are_all_in_the_table(evidence_of):
    tags = resources.files("placegraph.models_onnx").joinpath("embedded", "house_tags.txt").read_text().split("\n")
    for layer, place_types in (("room", ROOM_TYPES), ("location", LOCATION_TYPES)):
        made, model = evidence_of(layer, place_types)
        for tag in filter(None, tags):
            made.weights(tag)
        assert model.asked == []


def test_an_unknown_object_is_looked_up_once_by_words_alike_and_the_model(evidence_of):
    rooms, model = evidence_of("room", ROOM_TYPES)
    row = rooms.weights("zither")
    assert ROOM_TYPES[int(row.argmax())] in ("living room", "playroom", "bathroom")
    assert (row >= 0).all() and row.max() <= GROUP_WEIGHTS[1]
    assert model.asked == [*REFERENCE_OBJECTS, "zither"]
    np.testing.assert_array_equal(rooms.weights("zither"), row)
    assert len(model.asked) == len(REFERENCE_OBJECTS) + 1


def test_a_type_that_the_table_lacks_goes_by_the_model_alone(evidence_of):
    rooms, model = evidence_of("room", ("sauna", "bedroom"))
    assert rooms.weights("sauna stove")[0] == GROUP_WEIGHTS[1]
    assert rooms.weights("bed")[1] == GROUP_WEIGHTS[0]  # which the table tells
    assert "bed" in model.asked
    assert not rooms.weights("window").any()
    assert "window" not in model.asked[len(REFERENCE_OBJECTS) :]
    assert not rooms.has_decisive[0] and rooms.has_decisive[1]


def test_a_type_may_be_a_synonym(evidence_of):
    rooms, model = evidence_of("room", ("corridor", "lounge"))
    assert rooms.is_default.tolist() == [True, False]
    assert rooms.weights("sofa")[1] == GROUP_WEIGHTS[0]
    assert model.asked == []
