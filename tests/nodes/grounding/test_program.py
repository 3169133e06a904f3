import pytest

from placegraph.nodes.grounding.program import enum_rule, object_grammar, read_choice
from placegraph.runtime.errors import QueryError


def test_no_options_is_refused():
    with pytest.raises(QueryError, match="at least one option"):
        enum_rule([])


@pytest.mark.parametrize("text", ['a" | root', "a\\b", "", " a", "a\nb", "кружка", "{x}"])
def test_what_could_break_a_grammar_is_refused(text):
    with pytest.raises(QueryError, match="cannot enter a grammar"):
        enum_rule(["chair", text])


def test_object_grammar():
    assert object_grammar({"target": ("cup", "red mug")}) == (
        'root ::= "{\\"target\\": \\"" f0 "\\"" "}"\nf0 ::= "cup" | "red mug"'
    )


@pytest.mark.parametrize("reply", ["", "null", '{"target": 1}', '{"target": "sofa"}', "{}", '{"target": "cup"'])
def test_a_reply_that_was_not_offered_is_refused(reply):
    with pytest.raises(QueryError, match="language model"):
        read_choice(reply, {"target": ("cup",)})


def test_a_reply_is_read():
    assert read_choice('{"target": "cup"}', {"target": ("cup", "mug")}) == {"target": "cup"}
