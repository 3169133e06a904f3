import pytest

from placegraph.nodes.grounding.options import enum_rule
from placegraph.runtime.errors import QueryError


def test_no_options_is_refused():
    with pytest.raises(QueryError, match="at least one option"):
        enum_rule([])


@pytest.mark.parametrize("text", ['a" | root', "a\\b", "", " a", "a\nb", "кружка", "{x}"])
def test_what_could_break_a_grammar_is_refused(text):
    with pytest.raises(QueryError, match="cannot enter a grammar"):
        enum_rule(["chair", text])
