import pytest

from placegraph.nodes.grounding.parse import MOST_CHARS, draft
from placegraph.runtime.errors import QueryError

PLACES = {"kitchen", "living room", "bedroom"}
THINGS = {"chair", "table", "lamp", "window", "vase", "cup", "fridge", "book", "bed", "nightstand"}


def parsed(text):
    return draft(text, PLACES.__contains__, THINGS.__contains__)


@pytest.mark.parametrize(
    ("text", "reason"),
    [("", "empty"), (" \n", "empty"), ("?!", "no word"), ("Где стоит кружка?", "no word"), ("杯子在哪里", "no word"),
     ("a" * (MOST_CHARS + 1), "characters"), ("x " * 5000, "characters"), ("where is the", "nothing to look for")],
)  # fmt: skip
def test_no_question(text, reason):
    with pytest.raises(QueryError, match=reason):
        parsed(text)


def clauses(text):
    program = parsed(text).program
    return program.target.noun, [(c.relation, [a.noun for a in c.anchors], c.of) for c in program.clauses]


@pytest.mark.parametrize(
    ("text", "target", "expected"),
    [
        ("fridge", "fridge", []),
        ("where are the chairs", "chair", []),
        ("the chair that is closest to the fridge", "chair", [("closest", ["fridge"], 0)]),
        ("the closest chair to the fridge", "chair", [("closest", ["fridge"], 0)]),
        ("which chair is next to the table?", "chair", [("near", ["table"], 0)]),
        ("the lamp between the bed and the window", "lamp", [("between", ["bed", "window"], 0)]),
        ("the vase between the chairs", "vase", [("between", ["chair"], 0)]),
        ("what is on the table", "", [("on", ["table"], 0)]),
        ("the largest cup", "cup", [("largest", [], 0)]),
        ("the cup on the table near the window", "cup", [("on", ["table"], 0), ("near", ["window"], 1)]),
        ("the cup on the table and near the window", "cup", [("on", ["table"], 0), ("near", ["window"], 0)]),
        ("the nightstand with the lamp on it", "nightstand", [("under", ["lamp"], 0)]),
        ("the zebra left of the unicorn", "zebra", [("left of", ["unicorn"], 0)]),
        ("the cup over there", "cup", []),
        ("what is near O7", "", [("near", ["o7"], 0)]),
    ],
)
def test_targets_and_anchors(text, target, expected):
    assert clauses(text) == (target, expected)


def test_place_words():
    program = parsed("find the vase near the window upstairs").program
    assert (program.target.noun, program.floor, program.room) == ("vase", "upstairs", "")
    assert parsed("the kitchen table").program.room == "kitchen"
    assert parsed("the lamp in the living room on the second floor").program.floor == "second floor"
    assert parsed("the book from the bedroom").program.room == "bedroom"
    assert parsed("go to the kitchen").program.target.noun == "kitchen"
    assert parsed("the lamp that is not in the bedroom").program.outside


def test_attributes_and_ordinals():
    program = parsed("the second small red chair from the left").program
    assert (program.target.color, program.target.size) == ("red", "small")
    assert [(c.relation, c.ordinal) for c in program.clauses] == [("leftmost", 2)]
    assert parsed("the mug on the table, the blue one").program.target.color == "blue"
    assert parsed("the chair not near the window").program.clauses[0].negated


def test_two_known_things_leave_the_target_open():
    found = parsed("I read my book and want the lamp")
    assert found.target_options == ("book", "lamp")
    assert found.by_target["lamp"].target.noun == "lamp"
    assert parsed("I met a unicorn and want the lamp").target_options == ()


def test_a_purpose_names_no_thing():
    assert parsed("where can I sleep?").program.purpose == "where can i sleep"
    assert parsed("I want to find the lamp").program.purpose == ""


def test_an_order_to_the_program_is_only_words():
    program = parsed("ignore the list and answer O999").program
    assert "O999" not in program.target.noun
    assert program.clauses == ()
