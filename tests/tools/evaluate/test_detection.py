import numpy as np
import pytest

from placegraph.tools.evaluate.detection import FoundBoxes, TrueBoxes, average_precisions, mean_of_known, overlaps

A, B, C = [0, 0, 10, 10], [20, 0, 30, 10], [40, 0, 50, 10]
FAR = [80, 80, 90, 90]


def found(*rows):
    """Rows of (box, class, score)."""
    boxes, classes, scores = zip(*rows, strict=True) if rows else ((), (), ())
    return FoundBoxes(np.array(boxes, float).reshape(-1, 4), np.array(classes, int), np.array(scores, float))


def true(*rows):
    """Rows of (box, class) or (box, class, ignored)."""
    boxes = np.array([row[0] for row in rows], float).reshape(-1, 4)
    ignored = np.array([len(row) == 3 and row[2] for row in rows], bool)
    return TrueBoxes(boxes, np.array([row[1] for row in rows], int), ignored)


def ap(found_boxes, true_boxes, **settings):
    return average_precisions([found_boxes], [true_boxes], 1, **settings)[0]


def test_nothing_to_find_is_unknown_and_nothing_found_is_zero() -> None:
    assert np.isnan(average_precisions([], [], 3)).all()
    assert np.isnan(ap(found((A, 0, 0.9)), true()))
    assert np.isnan(ap(found((A, 0, 0.9)), true((A, 0, True))))
    assert ap(found(), true((A, 0))) == 0


def test_all_found_is_one_whatever_their_scores() -> None:
    assert ap(found((B, 0, 0.1), (A, 0, 0.9)), true((A, 0), (B, 0))) == pytest.approx(1)


def test_half_found_is_the_share_of_recalls_up_to_a_half() -> None:
    # precision 1 at the recalls 0, .01 ... .5: 51 of 101
    assert ap(found((A, 0, 0.9)), true((A, 0), (B, 0))) == pytest.approx(51 / 101)


def test_a_wrong_box_costs_only_what_comes_after_it() -> None:
    first = found((FAR, 0, 0.9), (A, 0, 0.8))
    last = found((FAR, 0, 0.7), (A, 0, 0.8))
    assert ap(first, true((A, 0))) == pytest.approx(0.5)
    assert ap(last, true((A, 0))) == pytest.approx(1)


def test_by_hand_three_of_five_right() -> None:
    # in order of score: right, wrong, right, wrong, right, of 4: precision 1, 2/3, 3/5 at recalls 1/4, 1/2, 3/4
    finds = found((A, 0, 0.9), (FAR, 0, 0.8), (B, 0, 0.7), (FAR, 0, 0.6), (C, 0, 0.5))
    truth = true((A, 0), (B, 0), (C, 0), ([60, 0, 70, 10], 0))
    assert ap(finds, truth) == pytest.approx((26 * 1 + 25 * 2 / 3 + 25 * 3 / 5) / 101)


def test_a_recall_that_is_a_hundredth_is_reached() -> None:
    # 3 of 10: recalls 0, .01 ... .3 are 31, though 3 / 10 and .3 differ in their last bits
    boxes = [[20 * i, 0, 20 * i + 10, 10] for i in range(10)]
    assert ap(found(*((b, 0, 0.5) for b in boxes[:3])), true(*((b, 0) for b in boxes))) == pytest.approx(31 / 101)


def test_a_true_box_is_found_once() -> None:
    twice = found((A, 0, 0.9), (A, 0, 0.8), (B, 0, 0.7))
    # right, wrong, right of 2: precision 1 up to .5, then 2/3
    assert ap(twice, true((A, 0), (B, 0))) == pytest.approx((51 + 50 * 2 / 3) / 101)


def test_the_overlap_decides() -> None:
    half = [0, 0, 10, 5]  # IoU .5 exactly
    assert ap(found((half, 0, 0.9)), true((A, 0))) == pytest.approx(1)
    assert ap(found((half, 0, 0.9)), true((A, 0)), min_iou=0.51) == 0


def test_on_an_ignored_truth_a_box_is_neither_right_nor_wrong() -> None:
    truth = true((A, 0), (B, 0, True))
    assert ap(found((B, 0, 0.9), (B, 0, 0.85), (A, 0, 0.8)), truth) == pytest.approx(1)
    assert ap(found((FAR, 0, 0.9), (A, 0, 0.8)), truth) == pytest.approx(0.5)


def test_an_ignored_truth_of_another_class_excuses_nothing() -> None:
    truth = true((A, 0), (B, 1, True))
    assert ap(found((B, 0, 0.9), (A, 0, 0.8)), truth) == pytest.approx(0.5)


def test_classes_and_images_are_apart() -> None:
    finds = [found((A, 0, 0.9), (B, 1, 0.8)), found((A, 0, 0.95))]
    truth = [true((A, 0), (B, 0)), true((A, 1))]
    # class 0: wrong (second image), right, of 2; class 1: wrong, of 1; class 2 does not occur
    values = average_precisions(finds, truth, 3)
    assert values[:2] == pytest.approx([51 * 0.5 / 101, 0]) and np.isnan(values[2])
    assert mean_of_known(values) == pytest.approx(51 * 0.25 / 101)
    assert np.isnan(mean_of_known(np.array([np.nan])))


def test_only_the_best_hundred_of_an_image_count() -> None:
    rows = [(FAR, 1, 0.9)] * 100 + [(A, 0, 0.1)]
    assert ap(found(*rows), true((A, 0))) == 0
    assert ap(found(*rows[1:]), true((A, 0))) == pytest.approx(1)


def test_overlaps_by_hand() -> None:
    a = np.array([[0, 0, 2, 2], [5, 5, 5, 5]], float)
    b = np.array([[1, 1, 3, 3], [2, 2, 4, 4], [5, 5, 5, 5]], float)
    assert overlaps(a, b) == pytest.approx(np.array([[1 / 7, 0, 0], [0, 0, 0]]))
