import numpy as np
import pytest

from placegraph.nodes.grounding.box_arrays import layout_of
from placegraph.nodes.grounding.groups import group_fits
from placegraph.nodes.grounding.program_syntax import parse_program
from placegraph.nodes.grounding.settings import GroupSettings


@pytest.fixture
def fits(room_of):
    def make(condition, *xs):
        layout = layout_of(room_of(*(("cup", (x, 0, 0), (0.2, 0.2, 0.2)) for x in xs), ("end", (99, 0, 0), (1, 1, 1))))
        things = layout.all.take(range(len(xs)))
        return group_fits(
            things, np.arange(len(xs)), next(iter(parse_program(f"cup; {condition}").conditions)), GroupSettings()
        )

    return make


def test_of_none_and_of_one(fits):
    assert fits("alone")[0].tolist() == fits("count 2")[0].tolist() == []
    assert fits("alone", 0)[0].tolist() == [1.0]
    assert fits("count 1", 0)[0].tolist() == [1.0]


def test_alone_is_away_from_its_like(fits):
    values, told = fits("alone", 0, 0.5, 4)
    assert values.argmax() == 2 and values[0] < 0.5
    assert told(2) == "cup O2: the nearest of its kind is 3.30 m away"


def test_a_group_hangs_together_by_gaps(fits):
    values, told = fits("count 3", 0, 0.4, 0.8, 4, 4.4)
    assert values.tolist() == [1, 1, 1, 0.5, 0.5]
    assert told(0) == "cup O0 is in a group of 3"
    assert fits("count 5", 0, 0.4, 0.8, 4, 4.4)[0].tolist() == [1] * 5  # there are five of them
