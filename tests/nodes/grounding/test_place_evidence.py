from importlib import resources

import numpy as np
import pytest

from placegraph.models_onnx.text_encoder import TextEncoder
from placegraph.nodes.grounding.place_evidence import ANYWHERE, REFERENCE, STRENGTHS, Telling, _table
from placegraph.nodes.grounding.place_naming import LOCATION_TYPES, ROOM_TYPES


class Opinion:
    """An opinion that counts what it is asked: it likes the first kind for a sauna stove, else all alike."""

    def __init__(self, count):
        self.count, self.asked = count, []

    def __call__(self, thing):
        self.asked.append(thing)
        liked = np.zeros(self.count)
        liked[0] = 8.0 if thing == "sauna stove" else 0.1 * len(self.asked)
        return liked


@pytest.fixture
def telling():
    def make(layer, kinds):
        opinion = Opinion(len(kinds))
        return Telling(layer, kinds, TextEncoder().encode, opinion), opinion

    return make


def test_the_table_knows_the_default_kinds_and_holds_no_thing_twice_in_a_line():
    for layer, kinds in (("room", ROOM_TYPES), ("location", LOCATION_TYPES)):
        lines = {line.rstrip("*"): groups for line, groups in _table()[layer].items()}
        assert set(kinds) <= set(lines)
        for line, groups in lines.items():
            things = [thing for group in groups for thing in group]
            assert len(groups) == len(STRENGTHS) and len(set(things)) == len(things), line
    everywhere = set(_table()[ANYWHERE][ANYWHERE][0])
    told = {
        thing for layer in ("room", "location") for groups in _table()[layer].values() for g in groups for thing in g
    }
    assert not everywhere & told


def test_things_of_the_table_ask_nothing(telling):
    rooms, opinion = telling("room", ROOM_TYPES)
    for tag, kind in (("bed", "bedroom"), ("couch", "living room"), ("Toilets", "bathroom"), ("gas stove", "kitchen")):
        row = rooms.row(tag)
        assert ROOM_TYPES[int(row.argmax())] == kind and row.max() == STRENGTHS[0]
    assert not rooms.row("window").any()
    assert opinion.asked == []
    locations, opinion = telling("location", LOCATION_TYPES)
    assert not locations.row("door").any()  # the table holds it for rooms alone
    assert opinion.asked == []


def test_the_tags_of_the_embedded_networks_are_all_in_the_table(telling):
    tags = resources.files("placegraph.models_onnx").joinpath("embedded", "house_tags.txt").read_text().split("\n")
    for layer, kinds in (("room", ROOM_TYPES), ("location", LOCATION_TYPES)):
        made, opinion = telling(layer, kinds)
        for tag in filter(None, tags):
            made.row(tag)
        assert opinion.asked == []


def test_an_unknown_thing_is_looked_up_once_by_words_alike_and_the_model(telling):
    rooms, opinion = telling("room", ROOM_TYPES)
    row = rooms.row("zither")
    assert ROOM_TYPES[int(row.argmax())] in ("living room", "playroom", "bathroom")
    assert (row >= 0).all() and row.max() <= STRENGTHS[1]
    assert opinion.asked == [*REFERENCE, "zither"]
    np.testing.assert_array_equal(rooms.row("zither"), row)
    assert len(opinion.asked) == len(REFERENCE) + 1


def test_a_kind_that_the_table_does_not_know_goes_by_the_model_alone(telling):
    rooms, opinion = telling("room", ("sauna", "bedroom"))
    assert rooms.row("sauna stove")[0] == STRENGTHS[1]
    assert rooms.row("bed")[1] == STRENGTHS[0]  # which the table tells
    assert "bed" in opinion.asked
    assert not rooms.row("window").any()
    assert "window" not in opinion.asked[len(REFERENCE) :]
    assert not rooms.is_settled[0] and rooms.is_settled[1]


def test_a_kind_may_be_said_in_other_words(telling):
    rooms, opinion = telling("room", ("corridor", "lounge"))
    assert rooms.is_bare.tolist() == [True, False]
    assert rooms.row("sofa")[1] == STRENGTHS[0]
    assert opinion.asked == []
