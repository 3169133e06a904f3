import numpy as np
import pytest

from placegraph.nodes.grounding.box_arrays import layout_of
from placegraph.nodes.grounding.viewpoint import ViewpointSelector

NOBODY = np.full(3, np.nan)
CENTER = ("room centre", [3.0, 2.5])


def words(lines):
    return tuple(map(str, lines.sources))


@pytest.fixture
def layout(room_of):
    """A room of 6 x 5 m: a bed with its head to the west, a tv on the east wall, two windows in the north wall."""
    return layout_of(room_of(
        ("wall", (3, 2.5, 1.25), (6, 5, 2.5)), ("bed", (1.1, 1, 0.3), (2.0, 1.6, 0.6)),
        ("tv", (5.95, 1, 1), (0.1, 1.2, 0.7)),
        ("window", (1, 4.95, 1.5), (1, 0.1, 1)), ("window", (4, 4.95, 1.5), (1, 0.1, 1)),
        ("stool", (3, 2.5, 0.3), (0.4, 0.4, 0.6)),
    ))  # fmt: skip


def test_who_faces_a_thing_stands_square_before_it(layout):
    viewpoints, things = ViewpointSelector(layout, NOBODY), layout.all
    for row, forward in ((1, [-1, 0]), (2, [1, 0]), (3, [0, 1]), (4, [0, 1])):
        assert np.allclose(viewpoints.facing_direction(things, row), forward), row
        viewpoint = viewpoints.in_front_of(things.take([row]))
        assert np.allclose(viewpoint.forward, forward)
        assert (things.center[row, :2] - viewpoint.eye) @ viewpoint.forward > 0.5
    assert not viewpoints.facing_direction(things, 5).any()  # in the very middle of the room nothing says which side


def test_several_are_seen_towards_the_wall_that_most_are_on(layout):
    viewpoints = ViewpointSelector(layout, NOBODY)
    assert np.allclose(viewpoints.in_front_of_most(layout.all.take([2, 3, 4])).forward, [0, 1])
    assert np.allclose(viewpoints.overlooking(layout.all.take([3, 4])).forward, [0, 1])


def test_the_order_of_preference(layout):
    tv = layout.all.take([2])
    assert words(ViewpointSelector(layout, NOBODY).lines_of_sight(tv)) == ("room centre",)
    asked = ViewpointSelector(layout, np.array([1.0, 1.0, 1.5]))
    assert words(asked.lines_of_sight(tv)) == ("asker",)
    asked.requested = asked.at(layout.all.take([1]))
    assert words(asked.lines_of_sight(tv)) == ("bed O1",)
    assert (
        asked.lines_of_sight(tv).trust.tolist()
        == [1.0]
        > ViewpointSelector(layout, NOBODY).lines_of_sight(tv).trust.tolist()
    )


def test_a_front_is_seen_by_who_faces_it(room_of):
    layout = layout_of(room_of(("desk", (0, 0, 0), (1, 1, 1)), ("cup", (5, 5, 0), (1, 1, 1)), fronts={0: (-1.0, 0.0)}))
    lines = ViewpointSelector(layout, NOBODY).lines_of_sight(layout.all.take([0]))
    assert lines.forward.tolist() == [[1.0, 0.0]]
    assert lines.left.tolist() == [[0.0, 1.0]]
    assert words(lines) == ("front of desk O0",)


def test_away_from_a_thing_is_the_way_opposite_to_facing_it(layout):
    viewpoints, tv = ViewpointSelector(layout, NOBODY), layout.all.take([2])
    assert np.allclose(viewpoints.with_back_to(tv).forward, -viewpoints.in_front_of(tv).forward)


def test_of_several_doors_each_room_has_its_own(house):
    layout = layout_of(house)
    viewpoints = ViewpointSelector(layout, NOBODY)
    windows = layout.all.take([layout.row[i] for i in ("O8", "O14", "O20")])
    viewpoints.requested = viewpoints.at(windows)
    things = layout.all.take([layout.row[i] for i in ("O0", "O9", "O15")])
    assert words(viewpoints.lines_of_sight(things)) == ("window O8", "window O14", "window O20")


def test_a_room_without_a_door_of_its_own_is_seen_by_the_asker(house):
    layout = layout_of(house)
    bed = layout.all.take([layout.row["O15"]])
    for asker, source, trust in ((NOBODY, "sofa O9", 0.5), (np.array([1.0, 1, 4]), "asker", 1.0)):
        viewpoints = ViewpointSelector(layout, asker)
        viewpoints.requested = viewpoints.at(layout.all.take([layout.row["O9"]]))
        lines = viewpoints.lines_of_sight(bed)  # the sofa is downstairs in another room
        assert (words(lines), lines.trust.tolist()) == ((source,), [trust])


def test_nothing_is_seen_without_error(layout):
    viewpoints = ViewpointSelector(layout, NOBODY)
    nothing = layout.all.take([])
    assert len(viewpoints.lines_of_sight(nothing).sources) == 0
    assert viewpoints.overlooking(nothing).forward is not None
