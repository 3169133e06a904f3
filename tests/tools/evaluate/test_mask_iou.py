import numpy as np
import pytest

from placegraph.tools.evaluate.network_metrics import mask_ious


def mask(*cells):
    found = np.zeros((4, 4), bool)
    found.ravel()[list(cells)] = True
    return found


def test_no_masks() -> None:
    assert mask_ious([], []).shape == (0,)


def test_by_hand() -> None:
    found = [mask(0, 1, 2), mask(5), mask(), mask(), mask(7)]
    true = [mask(1, 2, 3), mask(5), mask(), mask(1), mask()]
    assert mask_ious(found, true) == pytest.approx([0.5, 1, np.nan, 0, 0], nan_ok=True)


def test_lists_of_different_lengths_are_a_bug() -> None:
    with pytest.raises(ValueError):
        mask_ious([mask()], [])
