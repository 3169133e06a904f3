import numpy as np
import pytest

from placegraph.tools.train.location_labels import Count, count_house, matched, overlaps
from placegraph.tools.train.location_maps import RoomScan


def square(x, y=0.0, size=1.0):
    return np.array([[x, y], [x + size, y], [x + size, y + size], [x, y + size]])


def room(*outlines):
    return RoomScan(0, 0.0, 2.5, np.zeros(4), (), (), outlines)


def test_overlap_of_outlines():
    found = overlaps([square(0), square(9)], [square(0.5), square(0)])
    np.testing.assert_allclose(found, [[1 / 3, 1], [0, 0]], atol=0.04)
    assert overlaps([], [square(0)]).shape == (0, 1)


def test_each_truth_and_each_find_is_used_once_best_first():
    overlap = np.array([[0.9, 0.6], [0.8, 0.0]])
    assert matched(overlap, 0.5) == Count(1, 2, 2)  # .9 takes both rests: .6 its find, .8 its truth
    assert matched(np.array([[0.9, 0.6], [0.8, 0.55]]), 0.5) == Count(2, 2, 2)


def test_an_overlap_must_exceed_delta():
    assert matched(np.array([[0.5]]), 0.5).right == 0


@pytest.mark.parametrize(("count", "f1"), [(Count(), 1.0), (Count(0, 3, 0), 0.0), (Count(2, 4, 4), 0.5)])
def test_f1(count, f1):
    assert count.f1 == f1


def test_counts_of_a_house_add_up_over_rooms():
    rooms = [room(square(0), square(5)), room(), room(square(0))]
    (half,) = count_house(rooms, lambda scan: [square(0.1)], [0.5])
    assert half == Count(2, 3, 3)
    assert half.precision == half.recall == half.f1 == pytest.approx(2 / 3)
