import numpy as np
import pytest

from placegraph.runtime.vision import area_overlap
from placegraph.tools.evaluate.place_overlap import CELL_M, f1_curve, hydra_scores, match_floors, match_scores


def overlaps(found, true):
    return area_overlap.overlaps(found, true, CELL_M)


def square(x, y, side=1.0, floor=0):
    return floor, np.array([[x, y], [x + side, y], [x + side, y + side], [x, y + side]], float)


def test_no_areas() -> None:
    empty = overlaps([], [])
    assert empty.iou.shape == (0, 0)
    scores = match_scores(empty.iou, 0.5)
    assert np.isnan([scores.precision, scores.recall, scores.f1, *hydra_scores(empty)]).all()
    missed, invented = overlaps([], [square(0, 0)]), overlaps([square(0, 0)], [])
    assert match_scores(missed.iou, 0.5).recall == 0 and np.isnan(match_scores(missed.iou, 0.5).precision)
    assert match_scores(invented.iou, 0.5).precision == 0 and match_scores(invented.iou, 0.5).f1 == 0


def test_an_outline_of_less_than_three_corners_covers_nothing() -> None:
    line = (0, np.array([[0.0, 0], [1, 1]]))
    nothing = (0, np.zeros((0, 2)))
    found = overlaps([line, nothing], [square(0, 0)])
    assert found.found.tolist() == [0, 0] and found.iou.tolist() == [[0], [0]]
    assert hydra_scores(found) == (0, 0)


def test_overlap_by_hand() -> None:
    found = overlaps([square(0.5, 0)], [square(0, 0), square(-3, -2, 2)])
    assert found.iou == pytest.approx(np.array([[1 / 3, 0]]))
    assert found.true.tolist() == [400, 1600]  # cells of .05 m
    assert hydra_scores(found) == (pytest.approx(0.5), pytest.approx(0.25))


def test_a_bent_room_covers_its_own_cells_only() -> None:
    bent = (0, np.array([[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2.0]]))
    assert overlaps([bent], [square(1, 1)]).iou[0, 0] == 0
    assert overlaps([bent], [square(0, 0, 2)]).iou[0, 0] == pytest.approx(0.75)


def test_floors_are_apart() -> None:
    both = overlaps([square(0, 0, floor=1)], [square(0, 0, floor=0), square(0, 0, floor=1)])
    assert both.iou.tolist() == [[0, 1]]


def test_each_true_area_is_used_once_in_the_order_of_the_found() -> None:
    iou = np.array([[0.6, 0.0], [0.9, 0.4]])
    scores = match_scores(iou, 0.5)  # the first takes it, the better second is left with .4
    assert (scores.precision, scores.recall, scores.f1) == (0.5, 0.5, 0.5)
    assert match_scores(iou, 0.3).f1 == 1
    assert match_scores(iou, 0.6).f1 == 0.5  # more than delta: .6 is not enough, .9 is
    assert iou.tolist() == [[0.6, 0.0], [0.9, 0.4]]


def test_the_curve_falls() -> None:
    curve = f1_curve(np.array([[0.55]]))
    assert list(curve) == [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9]
    assert list(curve.values()) == [1] * 5 + [0] * 4


def test_a_room_split_in_two_is_precise_but_half_missed() -> None:
    halves = [(0, np.array([[x, 0], [x + 1, 0], [x + 1, 2], [x, 2.0]])) for x in (0, 1)]
    found = overlaps(halves, [square(0, 0, 2)])
    assert hydra_scores(found) == (pytest.approx(1), pytest.approx(0.5))
    assert match_scores(found.iou, 0.5).f1 == 0


def test_floors_are_paired_by_their_surfaces_and_judged_by_the_worse_boundary() -> None:
    true = np.array([[0, 2.5], [2.8, 5.3]])
    assert match_floors(np.zeros((0, 2)), true) == []
    assert match_floors(np.array([[2.9, 5.3]]), true) == [(0, 1, pytest.approx(0.1))]
    three = np.array([[0.3, 2.5], [2.8, 5.4], [1.5, 2.6]])
    assert match_floors(three, true) == [(1, 1, pytest.approx(0.1)), (0, 0, pytest.approx(0.3))]
    merged = np.array([[0.1, 5.3]])
    assert match_floors(merged, true) == [(0, 0, pytest.approx(2.8))]
    assert match_floors(np.array([[0.1, 2.4], [8, 10]]), true) == [(0, 0, pytest.approx(0.1))]  # no height in common
    assert match_floors(true, np.zeros((0, 2))) == []


def test_more_floors_than_truth_pair_each_true_one_once() -> None:
    found = np.array([[0.0, 2.5], [0.2, 2.5], [2.8, 5.3], [2.9, 5.2]])
    pairs = match_floors(found, np.array([[0, 2.5], [2.8, 5.3]]))
    assert sorted((i, j) for i, j, _ in pairs) == [(0, 0), (2, 1)]


def strip(x, width, depth=3.0):
    return 0, np.array([[x, 0], [x + width, 0], [x + width, depth], [x, depth]])


def test_a_room_split_in_three() -> None:
    found = overlaps([strip(0, 1), strip(1, 1), strip(2, 1)], [strip(0, 3)])
    assert hydra_scores(found) == (pytest.approx(1), pytest.approx(1 / 3))
    assert (
        match_scores(found.iou, 0.5).f1 == 0 and match_scores(found.iou, 0.3).f1 == 0.5
    )  # one right, two wrong, none missed


def test_two_rooms_merged() -> None:
    equal = overlaps([strip(0, 4)], [strip(0, 2), strip(2, 2)])
    assert hydra_scores(equal) == (pytest.approx(0.5), pytest.approx(1))
    assert match_scores(equal.iou, 0.5).f1 == 0  # each is half of it, and more than .5 is asked for
    large = overlaps([strip(0, 4)], [strip(0, 3), strip(3, 1)])
    scores = match_scores(large.iou, 0.5)
    assert (scores.precision, scores.recall, scores.f1) == (1, 0.5, pytest.approx(2 / 3))


def test_areas_far_apart_need_no_grid_of_all_between() -> None:
    found = overlaps([square(0, 0), square(9000, -9000)], [square(9000, -9000)])
    assert found.iou.tolist() == [[0], [1]]


def test_areas_that_touch_share_nothing() -> None:
    assert overlaps([square(0, 0)], [square(1, 0), square(0, -1), square(1, 1)]).shared.tolist() == [[0, 0, 0]]
