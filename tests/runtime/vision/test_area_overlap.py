import numpy as np
import pytest

from placegraph.runtime.vision.area_overlap import overlaps, rasterize


def square(x, y, size=4.0):
    return np.array([[x, y], [x + size, y], [x + size, y + size], [x, y + size]])


def test_no_areas():
    assert overlaps([], [(0, square(0, 0))], 0.1).iou.shape == (0, 1)


def test_iou_of_squares():
    found = [(0, square(0, 0)), (0, np.zeros((0, 2))), (1, square(0, 0))]
    iou = overlaps(found, [(0, square(0, 0)), (0, square(2, 0)), (0, square(9, 9))], 0.1).iou
    np.testing.assert_allclose(iou, [[1, 1 / 3, 0], [0, 0, 0], [0, 0, 0]])


def test_a_concave_outline_covers_its_own_area_only():
    corner = np.array([[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]], float)
    (low, mask), whole = rasterize(corner - 0.3, 0.05), rasterize(square(0, 0, 2), 0.05)
    assert low.tolist() == [-6, -6] and mask.sum() * 0.05**2 == pytest.approx(3)
    assert whole[1].all() and whole[1].shape == (40, 40)
