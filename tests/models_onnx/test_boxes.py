import numpy as np

from placegraph.models_onnx import boxes

F32 = np.float32


def test_iou():
    one = np.array([0, 0, 2, 2], F32)
    many = np.array([[0, 0, 2, 2], [1, 0, 3, 2], [2, 2, 4, 4], [1, 1, 1, 1]], F32)
    np.testing.assert_allclose(boxes.image_box_iou(one, many), [1, 1 / 3, 0, 0])
    assert boxes.image_box_iou(one, np.zeros((0, 4), F32)).shape == (0,)
    np.testing.assert_array_equal(boxes.image_box_iou(np.zeros(4, F32), np.zeros((1, 4), F32)), [0])


def test_from_centers():
    np.testing.assert_array_equal(boxes.corners_from_centers(np.array([[5, 6, 4, 2]], F32)), [[3, 5, 7, 7]])


def test_suppression_is_within_a_class_and_in_order():
    found = np.array([[0, 0, 10, 10], [0, 0, 10, 9], [0, 0, 10, 9], [20, 20, 30, 30]], F32)
    scores = np.array([0.5, 0.9, 0.8, 0.9], F32)
    kept = boxes.non_maximum_suppression(found, scores, np.array([0, 0, 1, 0]), 0.5)
    assert kept.tolist() == [1, 3, 2]  # a tie keeps the lower index first; box 0 repeats box 1
    assert boxes.non_maximum_suppression(found, scores, np.array([0, 0, 1, 0]), 0.95).tolist() == [1, 3, 2, 0]


def test_suppression_of_nothing():
    empty = boxes.non_maximum_suppression(np.zeros((0, 4), F32), np.zeros(0, F32), np.zeros(0, np.int64), 0.5)
    assert empty.shape == (0,) and empty.dtype == np.int64


def test_suppression_is_bounded():
    many = boxes.MAX_CANDIDATES + 10
    corners = np.arange(many, dtype=F32)[:, None] * 4
    found = np.concatenate([corners, corners, corners + 1, corners + 1], axis=1)
    assert (
        len(boxes.non_maximum_suppression(found, np.ones(many, F32), np.zeros(many, np.int64), 0.5))
        == boxes.MAX_CANDIDATES
    )


def test_best_classes():
    scores = np.array([[0.1, 0.2], [0.5, 0.4], [0.3, 0.3]], F32)
    anchors, classes, best = boxes.best_classes(scores, 0.3)
    assert (anchors.tolist(), classes.tolist()) == ([1, 2], [0, 0])
    np.testing.assert_allclose(best, [0.5, 0.3])
    assert len(boxes.best_classes(np.zeros((3, 0), F32), 0.0)[0]) == 0


def test_empty_boxes_are_left_out():
    found = boxes.named_boxes(
        ["cup", "lamp"], np.array([1, 0]), np.array([[0, 0, 0, 5], [0, 0, 1, 5]], F32), np.array([1.5, 1.5], F32)
    )
    assert found.names == ("cup",)
    np.testing.assert_array_equal(found.boxes_px, [[0, 0, 1, 5]])
    np.testing.assert_array_equal(found.scores, [1])
