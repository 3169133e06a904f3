import pytest

from placegraph.runtime.errors import QueryError
from placegraph.runtime.language.grammar_options import enum_rule


def test_no_options_is_refused():
    with pytest.raises(QueryError, match="at least one option"):
        enum_rule([])


@pytest.mark.parametrize("text", ['a" | root', "a\\b", "", " a", "a\nb", "кружка", "{x}"])
def test_what_could_break_a_grammar_is_refused(text):
    with pytest.raises(QueryError, match="cannot enter a grammar"):
        enum_rule(["chair", text])
