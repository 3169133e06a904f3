import numpy as np
import pytest

from placegraph.nodes.segmenter import NODE, SegmenterConfig
from placegraph.runtime.errors import ConfigError
from placegraph.runtime.messages import Detections, Keyframe
from placegraph.runtime.node import Context


@pytest.fixture
def start(folder):
    def build(**settings):
        node = NODE(SegmenterConfig(**settings), Context(model_dirs=(str(folder),)))
        node.start()
        return node

    return build


def keyframe(color=(255, 255, 255)):
    image = np.zeros((64, 64, 3), np.uint8)
    image[:] = color
    return Keyframe(
        frame_id=3,
        stamp_ns=77,
        color=image,
        depth=np.full((64, 64), 1500, np.uint16),
        depth_unit_m=0.001,
        intrinsics=np.array([60.0, 60, 32, 32]),
        world_from_camera=np.eye(4),
    )


def detections(boxes, scores=(0.9, 0.5, 0.4)):
    names = tuple("abc"[: len(boxes)])
    return Detections(
        frame_id=3,
        stamp_ns=77,
        names=names,
        boxes_px=np.array(boxes, np.float32).reshape(-1, 4),
        scores=np.array(scores[: len(boxes)], np.float32),
    )


def test_boxes_get_masks_in_whole_pixel_boxes(start):
    node = start(model="tiny_sam")
    assert list(node.step(detections([[8, 8, 24, 40], [30.4, 2, 60, 10]]))) == []
    (found,) = node.step(keyframe())
    found.check()
    assert (found.frame_id, found.stamp_ns, found.names) == (3, 77, ("a", "b"))
    np.testing.assert_array_equal(found.boxes_px, [[8, 8, 24, 40], [30, 2, 60, 10]])
    assert [mask.mean() for mask in found.masks()] == [1, 1]


def test_empty_masks_go_with_their_names(start):
    node = start(model="tiny_instances")
    node.step(keyframe((255, 0, 0)))
    (found,) = node.step(detections([[0, 0, 4, 4], [32, 8, 56, 56], [8, 8, 24, 24]]))
    found.check()
    assert found.names == ("c",)  # nothing overlaps a, and the mask of b is empty
    np.testing.assert_allclose(found.scores, [0.4])
    np.testing.assert_array_equal(found.boxes_px, [[8, 8, 24, 24]])


def test_no_boxes(start):
    node = start(model="tiny_sam")
    node.step(keyframe())
    (found,) = node.step(detections([]))
    found.check()
    assert found.names == () and list(found.masks()) == []


def test_min_score_and_max_objects(start):
    def names(**settings):
        node = start(model="tiny_sam", **settings)
        node.step(keyframe())
        return node.step(detections([[8, 8, 24, 40], [30, 2, 60, 10], [8, 8, 20, 20]]))[0].names

    assert names() == ("a", "b", "c")
    assert names(min_score=0.45) == ("a", "b")
    assert names(max_objects=1) == ("a",)


def test_the_network_gets_depth_in_metres(start):
    node, seen = start(model="tiny_sam"), []
    inner = node._model.segment

    def segment(image, depth_m, boxes_px):
        seen.append(depth_m)
        return inner(image, depth_m, boxes_px)

    node._model.segment = segment
    node.step(keyframe())
    node.step(detections([[8, 8, 24, 40]]))
    assert seen[0].dtype == np.float32
    np.testing.assert_allclose(seen[0], np.full((64, 64), 1.5), rtol=1e-6)


def test_a_network_of_another_task_is_refused(start):
    with pytest.raises(ConfigError, match=r"\[nodes\.segmenter\] model: 'tiny_boxes' .* cannot give masks for boxes"):
        start(model="tiny_boxes")
