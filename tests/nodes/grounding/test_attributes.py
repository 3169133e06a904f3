import pytest

from placegraph.nodes.grounding.attributes import BASIC_COLORS, UNKNOWN_FIT, color_fit, size_fit


def test_unseen_colour_neither_fits_nor_fails(thing_of):
    assert color_fit(thing_of(0, "R0", "cup", (0, 0, 0), (1, 1, 1)), "red") == UNKNOWN_FIT


@pytest.mark.parametrize("name", sorted(BASIC_COLORS))
def test_each_colour_is_called_by_its_name(thing_of, name):
    node = thing_of(0, "R0", "cup", (0, 0, 0), (1, 1, 1), BASIC_COLORS[name])
    fits = {other: color_fit(node, other) for other in BASIC_COLORS}
    assert max(fits, key=fits.get) == name
    assert sorted(fits.values())[-2] < 0.75


def test_a_tag_that_says_the_colour_wins(thing_of):
    assert color_fit(thing_of(0, "R0", "red cup", (0, 0, 0), (1, 1, 1), (0, 0, 255)), "red") == 1


def test_size_is_a_rank(thing_of):
    nodes = [thing_of(i, "R0", "box", (0, 0, 0), (size,) * 3) for i, size in enumerate((1, 3, 2))]
    assert size_fit([], "large") == []
    assert size_fit(nodes[:1], "small") == [1.0]
    assert size_fit(nodes, "large") == [0.5, 1.0, 0.75]
    assert size_fit(nodes, "small") == [1.0, 0.5, 0.75]
