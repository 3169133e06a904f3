import dataclasses

import numpy as np
import pytest

from placegraph.nodes.grounding.attributes import BASIC_COLORS, appearance_fits, color_fit, size_fit
from placegraph.nodes.grounding.box_arrays import layout_of
from placegraph.nodes.grounding.settings import AppearanceSettings
from placegraph.runtime.scene_graph import GraphNode, SceneGraph

SETTINGS = AppearanceSettings()


def test_unseen_color_neither_fits_nor_fails(thing_of):
    assert color_fit(thing_of(0, "R0", "cup", (0, 0, 0), (1, 1, 1)), "red", SETTINGS) == 0.5


@pytest.mark.parametrize("name", sorted(BASIC_COLORS))
def test_each_color_is_called_by_its_name(thing_of, name):
    node = thing_of(0, "R0", "cup", (0, 0, 0), (1, 1, 1), BASIC_COLORS[name])
    fits = {other: color_fit(node, other, SETTINGS) for other in BASIC_COLORS}
    assert max(fits, key=fits.get) == name
    assert sorted(fits.values())[-2] < 0.75


def test_a_tag_that_says_the_color_wins(thing_of):
    assert color_fit(thing_of(0, "R0", "red cup", (0, 0, 0), (1, 1, 1), (0, 0, 255)), "red", SETTINGS) == 1


def boxes_of(nodes):
    building = GraphNode(
        id="B0", parent="", tags=(), box=np.array([[0, 0, 0], [9, 9, 9.0]]), footprint=np.zeros((0, 2)),
        first_frame=-1, last_frame=-1,
    )  # fmt: skip
    floor, room = (dataclasses.replace(building, id=i, parent=p) for i, p in (("F0", "B0"), ("R0", "F0")))
    return layout_of(SceneGraph.of([building, floor, room, *nodes])).all.take(range(len(nodes)))


def fits(words, *nodes):
    return appearance_fits(words, nodes, boxes_of(nodes), np.ones(len(nodes), bool), SETTINGS)


def test_size_is_a_rank(thing_of):
    nodes = [thing_of(i, "R0", "box", (4, 4, 4), (size,) * 3) for i, size in enumerate((1, 3, 2))]
    every = np.ones(3, bool)
    assert size_fit(boxes_of([]), "large", np.ones(0, bool), SETTINGS).tolist() == []
    assert size_fit(boxes_of(nodes[:1]), "small", every[:1], SETTINGS).tolist() == [1.0]
    assert size_fit(boxes_of(nodes), "large", every, SETTINGS).tolist() == pytest.approx([0.4, 1.0, 0.7])
    assert size_fit(boxes_of(nodes), "small", every, SETTINGS).tolist() == pytest.approx([1.0, 0.4, 0.7])
    assert fits("big", *nodes).values.argmax() == 1


@pytest.mark.parametrize(
    ("words", "expected"),
    [("tall", 2), ("long", 1), ("narrow", 0), ("short", 1), ("dark brown", 0), ("light brown", 1), ("white colored", 2),
     ("brownish", None), ("brown in color", None), ("whitish", 2), ("lighter", 2), ("darker", 0), ("wooden", 2)],
)  # fmt: skip
def test_words_for_looks(thing_of, words, expected):
    dark = thing_of(0, "R0", "box", (2, 2, 1), (0.3, 0.3, 1), (70, 42, 22))
    light = thing_of(1, "R0", "box", (4, 2, 1), (2, 0.3, 0.4), (150, 108, 70))
    white = thing_of(2, "R0", "wooden box", (6, 2, 1), (1, 0.3, 2), (235, 235, 235))
    seen = fits(words, dark, light, white)
    assert seen.known
    if expected is None:
        assert seen.values[:2].min() > seen.values[2]
    else:
        assert seen.values.argmax() == expected


@pytest.mark.parametrize("words", ["burnt", "open", "red", "dark"])
def test_what_the_map_does_not_know_fits_all_alike(thing_of, words):
    seen = fits(words, *(thing_of(i, "R0", "box", (4, 4, 4), (1, 1, 1)) for i in range(2)))
    assert not seen.known
    assert seen.values[0] == seen.values[1] >= 0.5
