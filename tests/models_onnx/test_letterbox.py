import numpy as np
import pytest

from placegraph.models_onnx.letterbox import FILL, letterbox_image


@pytest.mark.parametrize("size", [(480, 640), (640, 480), (1, 1), (1, 500), (37, 91), (416, 416)])
@pytest.mark.parametrize("centered", [True, False])
def test_boxes_come_back(size, centered):
    image = np.zeros((*size, 3), np.uint8)
    canvas, placed = letterbox_image(image, 416, 320, centered=centered)
    assert canvas.shape == (416, 320, 3)
    boxes = np.array([[0, 0, size[1], size[0]], [size[1] / 4, 0, size[1] / 2, size[0] / 3]], np.float32)
    np.testing.assert_allclose(placed.to_image(placed.to_input(boxes)), boxes, atol=1e-3)
    x0, y0, x1, y1 = np.round(placed.to_input(boxes)[0]).astype(int)
    expected = np.full_like(canvas, FILL)
    expected[y0:y1, x0:x1] = 0  # the image is black
    np.testing.assert_array_equal(canvas, expected)


def test_where_the_image_lies():
    image = np.zeros((100, 200, 3), np.uint8)
    assert letterbox_image(image, 64, 64, centered=True)[1].pad_y == 16
    top_left = letterbox_image(image, 64, 64, centered=False)[1]
    assert (top_left.pad_x, top_left.pad_y, top_left.scale_x) == (0, 0, 0.32)


def test_boxes_are_clipped_to_the_image():
    placed = letterbox_image(np.zeros((100, 200, 3), np.uint8), 64, 64, centered=True)[1]
    np.testing.assert_allclose(placed.to_image(np.array([[-9, 0, 99, 64]], np.float32)), [[0, 0, 200, 100]])
    assert placed.to_image(np.zeros((0, 4), np.float32)).shape == (0, 4)
