import pytest
from pydantic import ValidationError

from placegraph.nodes.grounding.program import CONDITIONS, Condition, Thing, normalized
from placegraph.nodes.grounding.program_syntax import parse_program


@pytest.mark.parametrize(
    "fields",
    [
        {"name": "beneath", "things": (Thing(noun="bed"),)},
        {"name": "near"},
        {"name": "leftmost", "things": (Thing(noun="bed"),)},
        {"name": "is"},
        {"name": "near", "things": (Thing(noun="bed"),), "words": "blue"},
        {"name": "count"},
        {"name": "on", "things": (Thing(noun="bed"),), "number": 2},
    ],
)
def test_a_condition_holds_what_its_form_says(fields):
    with pytest.raises(ValidationError):
        Condition(**fields)


def test_readings_are_the_same_whatever_the_order_number_of_words_and_first_rank():
    one = normalized(parse_program("pillows; is grey; leftmost 1; between (beds; is big, desk)"))
    other = normalized(parse_program("pillow; between (desk, bed; is big); leftmost; is gray"))
    assert one == other
    assert one != normalized(parse_program("pillow; between (desk, bed); leftmost; is gray"))
    assert normalized(parse_program("pillow; leftmost 2")) != normalized(parse_program("pillow; leftmost"))


def test_each_form_has_a_meaning_and_room_for_what_it_must_hold():
    for name, form in CONDITIONS.items():
        assert form.meaning and form.things[0] <= form.things[1], name
        assert not (form.words and form.things[1]), name
