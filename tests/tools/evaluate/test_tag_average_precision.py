import numpy as np
import pytest

from placegraph.tools.evaluate.network_metrics import tag_average_precisions

NAN = np.nan


def ap(scores, true):
    return tag_average_precisions(np.array(scores, float)[:, None], np.array(true, float)[:, None])[0]


@pytest.mark.parametrize("true", [[0, 0], [NAN, NAN], [0, NAN]])
def test_a_class_that_is_never_shown_is_unknown(true) -> None:
    assert np.isnan(ap([0.5, 0.6], true))


def test_by_hand() -> None:
    # right, wrong, right: (1 + 2/3) / 2
    assert ap([0.9, 0.8, 0.7], [1, 0, 1]) == pytest.approx((1 + 2 / 3) / 2)
    assert ap([0.7, 0.8, 0.9], [1, 1, 1]) == pytest.approx(1)


def test_what_is_unknown_plays_no_part() -> None:
    assert ap([0.9, 0.95, 0.8, 0.7], [1, NAN, 0, 1]) == pytest.approx((1 + 2 / 3) / 2)


def test_equal_scores_count_at_once_in_any_order() -> None:
    # a tagger that names nothing: the share of views that show it
    assert ap([0, 0, 0, 0], [1, 0, 0, 0]) == ap([0, 0, 0, 0], [0, 0, 0, 1]) == pytest.approx(0.25)
    assert ap([0.5, 0.5, 0.1], [0, 1, 1]) == pytest.approx((1 / 2 + 2 / 3) / 2)


def test_classes_are_apart() -> None:
    scores = np.array([[0.9, 0.1], [0.1, 0.9]])
    assert tag_average_precisions(scores, np.array([[1.0, 1], [0, 0]])) == pytest.approx([1, 0.5])
