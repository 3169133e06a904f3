import numpy as np
import pytest

from placegraph.runtime.vision import geometry as g


def test_backproject_empty_nan_and_one_pixel() -> None:
    k = np.array([100.0, 200.0, 1.0, 1.0])
    assert g.backproject(np.zeros((4, 4), np.float32), k).shape == (0, 3)
    depth = np.full((3, 3), np.nan, np.float32)
    depth[2, 0] = 2.0
    assert np.allclose(g.backproject(depth, k), [[-0.02, 0.01, 2.0]])


def test_backproject_stride_uses_the_full_images_pixels() -> None:
    depth = np.ones((8, 8), np.float32)
    points = g.backproject(depth, np.array([10.0, 10.0, 0.0, 0.0]), stride=4)
    assert np.allclose(points[:, :2], [[0, 0], [0.4, 0], [0, 0.4], [0.4, 0.4]])


def test_inverse_and_transform_cancel() -> None:
    pose = g.pose_from_quaternion(np.array([1.0, 2.0, 3.0]), np.array([0.1, -0.2, 0.3, 0.9]))
    points = np.random.default_rng(0).normal(size=(5, 3))
    assert np.allclose(g.transform(g.inverse(pose), g.transform(pose, points)), points)
    assert g.is_rigid(pose)
    back = g.quaternion_xyzw(pose[:3, :3])
    assert np.allclose(g.pose_from_quaternion(np.zeros(3), back)[:3, :3], pose[:3, :3])


@pytest.mark.parametrize(
    "bad", [np.full((4, 4), np.nan), np.zeros((4, 4)), np.diag([1.0, 1.0, -1.0, 1.0]), 2 * np.eye(4)]
)
def test_not_rigid(bad: np.ndarray) -> None:
    assert not g.is_rigid(bad)


@pytest.mark.parametrize("b", [(0, 0, 1), (0, 0, -1), (1, 0, 0), (0.6, 0, 0.8)])
def test_rotation_between(b: tuple[float, ...]) -> None:
    a = np.array([0.0, 0.0, 1.0])
    rotation = g.rotation_between(a, np.array(b))
    assert np.allclose(rotation @ a, b)
    assert np.isclose(np.linalg.det(rotation), 1)


def test_box_iou_and_distance() -> None:
    a = np.array([[0, 0, 0], [1, 1, 1]], float)
    assert g.box_iou(a, a) == 1
    assert g.box_iou(a, a + 0.5) == pytest.approx(0.125 / 1.875)
    assert g.box_iou(a, a + 2) == 0 and g.box_distance_m(a, a + 2) == pytest.approx(3**0.5)
    assert g.box_distance_m(a, a + 0.5) == 0
    point = np.zeros((2, 3))
    assert g.box_iou(point, point) == 0


def test_box_iou_of_many_boxes_in_an_image() -> None:
    box = np.array([[0, 0], [2, 2]], np.float32)
    boxes = np.array([[[0, 0], [2, 2]], [[1, 0], [3, 2]], [[2, 2], [4, 4]], [[1, 1], [1, 1]]], np.float32)
    np.testing.assert_allclose(g.box_iou(box, boxes), [1, 1 / 3, 0, 0])
    assert g.box_iou(box, boxes).dtype == np.float32 and g.box_iou(box, boxes[:0]).shape == (0,)
    assert g.box_iou(boxes[:, None], boxes[None, :2]).shape == (4, 2)


def test_yaw_box_of_one_point_and_of_a_turned_rectangle() -> None:
    assert np.allclose(g.yaw_box(np.array([[1.0, 2.0, 3.0]])), [1, 2, 3, 0, 0, 0, 0], atol=1e-6)
    yaw = 0.3
    turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
    corners = np.array([[x, y] for x in (-1, 1) for y in (-0.5, 0.5)]) @ turn.T
    points = np.column_stack((corners, [0, 1, 0, 1]))
    assert np.allclose(g.yaw_box(points), [0, 0, 0.5, 2, 1, 1, yaw], atol=1e-4)


def test_footprint_of_few_points() -> None:
    assert g.convex_footprint(np.array([[1.0, 2.0, 0.0]])).tolist() == [[1.0, 2.0]]
    inner = np.array([[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 5], [1, 1, 1]], float)
    assert len(g.convex_footprint(inner)) == 4
