import numpy as np
import pytest

from placegraph.nodes.grounding.anchor_matching import Anchors, match_anchors
from placegraph.nodes.grounding.box_arrays import layout_of
from placegraph.nodes.grounding.program_syntax import parse_program
from placegraph.nodes.grounding.viewpoint import ViewpointSelector


@pytest.fixture
def relate(room_of):
    """Outcome of one condition between cups at xs and anchors at others, with weights."""

    def make(condition, xs, others, weights=None, count=0):
        spots = [*xs, *others]
        layout = layout_of(
            room_of(*(("cup", (x, 0, 0), (0.2, 0.2, 0.2)) for x in spots), ("end", (99, 0, 0), (1, 1, 1)))
        )
        targets, rest = layout.all.take(range(len(xs))), layout.all.take(range(len(xs), len(spots)))
        anchors = Anchors(rest, np.array(weights or [1.0] * len(others)), count=count)
        said = next(iter(parse_program(f"cup; {condition}").conditions))
        return match_anchors(said, targets, [anchors], layout, ViewpointSelector(layout, np.full(3, np.nan)))

    return make


def test_nothing_to_be_related_to(relate):
    outcome = relate("near (cup)", [0], [])
    assert (outcome.values.tolist(), outcome.sentence(0)) == ([0.0], "cup O0 has nothing to be near")
    assert np.isnan(relate("closest (cup)", [0], []).values).all()
    assert relate("between (cups)", [0], [1]).values.tolist() == [0.0]


def test_the_best_anchor_counts_by_how_well_it_fits(relate):
    assert relate("near (cup)", [0], [0.3, 2], [1.0, 1.0]).sentence(0) == "cup O0 is 0.10 m from cup O1"
    assert relate("near (cup)", [0], [0.3, 2], [0.1, 1.0]).sentence(0) == "cup O0 is 1.80 m from cup O2"


def test_a_doubtful_anchor_is_farther_away_for_ranks(relate):
    sure, doubtful = (relate("closest (cup)", [0, 5], [1, 5.5], weights) for weights in ([1, 1], [1, 0.05]))
    assert (sure.values.argmax(), doubtful.values.argmax()) == (1, 0)
    assert relate("farthest (cup)", [0, 5], [1, 5.5], [1, 0.05]).values.argmax() == 1


def test_anchors_are_counted_where_a_number_is_said(relate):
    one, three = relate("near (cup)", [0, 9], [0.3, 9.3, 8.7, 9.5], count=1).values
    assert one > three
    one, three = relate("near (cup)", [0, 9], [0.3, 9.3, 8.7, 9.5], count=3).values
    assert three > one


def test_between_two_of_a_kind(relate):
    outcome = relate("between (cups)", [0.5, 3], [0, 1])
    assert outcome.values[0] > 0.5 > outcome.values[1]


def test_a_thing_is_not_its_own_anchor(house, names):
    layout = layout_of(house)
    lamps = layout.all.take([layout.row[i] for i in ("O11", "O18")])
    said = next(iter(parse_program("lamp; closest (one)").conditions))
    outcome = match_anchors(
        said, lamps, [Anchors(lamps, np.ones(2))], layout, ViewpointSelector(layout, np.full(3, np.nan))
    )
    assert "from lamp O18, in another room" in outcome.sentence(0)
