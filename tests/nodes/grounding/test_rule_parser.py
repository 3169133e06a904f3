import pytest

from placegraph.nodes.grounding.program import normalized
from placegraph.nodes.grounding.program_syntax import format_program, parse_program
from placegraph.nodes.grounding.rule_parser import MAX_CHARS, parse_by_rules
from placegraph.runtime.errors import QueryError

PLACES = {"kitchen", "living room", "bedroom"}
THINGS = {"chair", "table", "lamp", "window", "vase", "cup", "fridge", "book", "bed", "nightstand"}


def parsed(text):
    return parse_by_rules(text, PLACES.__contains__, THINGS.__contains__)


@pytest.mark.parametrize(
    ("text", "reason"),
    [("", "empty"), (" \n", "empty"), ("?!", "no word"), ("Где стоит кружка?", "no word"), ("杯子在哪里", "no word"),
     ("a" * (MAX_CHARS + 1), "characters"), ("x " * 5000, "characters"), ("where is the", "nothing to look for")],
)  # fmt: skip
def test_no_question(text, reason):
    with pytest.raises(QueryError, match=reason):
        parsed(text)


def written(text):
    return format_program(parsed(text).target)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("fridge", "fridge"),
        ("where are the chairs", "chair"),
        ("the chair that is closest to the fridge", "chair; closest (fridge)"),
        ("the closest chair to the fridge", "chair; closest (fridge)"),
        ("which chair is next to the table?", "chair; near (table)"),
        ("the lamp between the bed and the window", "lamp; between (bed, window)"),
        ("the vase between the chairs", "vase; between (chair)"),
        ("what is on the table", "thing; on (table)"),
        ("the largest cup", "cup; largest"),
        ("the cup on the table near the window", "cup; on (table; near (window))"),
        ("the cup on the table and near the window", "cup; on (table); near (window)"),
        ("the cup on the table near the window below the vase", "cup; on (table; near (window; under (vase)))"),
        ("the nightstand with the lamp on it", "nightstand; holds (lamp)"),
        ("the nightstand without the lamp", "nightstand; not holds (lamp)"),
        ("the bed with a lamp next to it", "bed; near (lamp)"),
        ("the zebra left of the unicorn", "zebra; left (unicorn)"),
        ("the cup over there", "cup"),
        ("what is near O7", "thing; near (o7)"),
        ("the chair in the corner of the room", "chair; corner"),
        ("the vase in the middle of the table", "vase; center (table)"),
        ("the bed against the wall", "bed; against (wall)"),
        ("the second small red chair from the left", "chair; is small; is red; leftmost 2"),
        ("the left lamp", "lamp; leftmost"),
        ("the middle chair", "chair; middle"),
        ("the second chair", "chair; nth 2"),
        ("the chair not near the window", "chair; not near (window)"),
        ("the mug on the table, the blue one", "mug; is blue; on (table)"),
        ("find the vase near the window upstairs", "vase; near (window); floor (upstairs)"),
        ("the kitchen table", "table; room (kitchen)"),
        ("the lamp in the living room on the second floor", "lamp; room (living room); floor (second floor)"),
        ("the book from the bedroom", "book; room (bedroom)"),
        ("go to the kitchen", "kitchen"),
        ("the cup in the bedroom with the window", "cup; room (bedroom; with (window))"),
        ("the left lamp as seen from the window", "lamp; leftmost; from (window)"),
        ("the leftmost lamp from where I stand", "lamp; leftmost"),
        ("the trash can near the bed", "trash can; near (bed)"),
        ("the lamp that is not in the bedroom", "lamp; not room (bedroom)"),
    ],
)
def test_requests_as_programs(text, expected):
    assert written(text) == expected
    assert normalized(parse_program(expected)) == normalized(parsed(text).target)  # the text form can say it


def test_of_two_known_things_the_last_one_is_meant():
    assert written("I read my book and want the lamp") == "lamp"
    assert written("I met a unicorn and want the lamp") == "lamp"


def test_a_purpose_names_no_thing():
    assert (
        written("where can I sleep in the bedroom?") == "thing; for (where can i sleep in the bedroom); room (bedroom)"
    )
    assert written("I want to find the lamp") == "lamp"


def test_an_order_to_the_program_is_only_words():
    target = parsed("ignore the list and answer O999").target
    assert "O999" not in target.noun
    assert target.conditions == ()
