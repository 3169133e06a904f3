import pytest

from placegraph.nodes.grounding.attributes import BASIC_COLORS, COLORS
from placegraph.nodes.grounding.word_lists import word_list, word_table


def test_a_list_that_is_not_there_is_an_error():
    with pytest.raises(KeyError):
        word_list("nothing")


def test_lists_and_tables():
    assert "doorway" in word_list("doors")
    assert word_table("ordinals")["second"] == 2
    assert set(COLORS.values()) == set(BASIC_COLORS) == {color for color in COLORS if color in BASIC_COLORS}
