import tomllib

import numpy as np
import pytest

from placegraph.nodes.instances import NODE, InstancesConfig
from placegraph.runtime.errors import ConfigError
from placegraph.runtime.messages import End, Keyframe
from placegraph.runtime.node import Context


@pytest.fixture
def start(folder):
    def build(**settings):
        node = NODE(InstancesConfig(**settings), Context(model_dirs=(str(folder),)))
        node.start()
        return node

    return build


def keyframe(color=(255, 0, 0)):
    image = np.zeros((64, 64, 3), np.uint8)
    image[:] = color
    return Keyframe(
        frame_id=3,
        stamp_ns=77,
        color=image,
        depth=np.zeros((64, 64), np.uint16),
        depth_unit_m=0.001,
        intrinsics=np.array([60.0, 60, 32, 32]),
        world_from_camera=np.eye(4),
    )


def test_one_pass_gives_detections_and_segments(start):
    detections, segments = start(model="tiny_instances", min_score=0.1).step(keyframe())
    detections.check()
    segments.check()
    assert (detections.frame_id, detections.stamp_ns, segments.frame_id, segments.stamp_ns) == (3, 77, 3, 77)
    assert detections.names == ("cup", "lamp", "cup")
    assert segments.names == ("cup", "cup")  # the lamp's mask is empty
    np.testing.assert_allclose(segments.scores, [0.9, 0.2], atol=1e-6)
    np.testing.assert_array_equal(segments.boxes_px, [[8, 8, 24, 24], [40, 40, 48, 48]])
    assert [mask.mean() for mask in segments.masks()] == [1, 1]


def test_nothing_seen_is_said_too(start):
    detections, segments = start(model="tiny_instances").step(keyframe((0, 0, 0)))
    detections.check()
    segments.check()
    assert detections.names == segments.names == ()


def test_min_score_and_max_objects(start):
    def names(**settings):
        return start(model="tiny_instances", **settings).step(keyframe())[0].names

    assert names() == ("cup", "lamp")
    assert names(min_score=0.7) == ("cup",)
    assert names(min_score=0.0, max_objects=2) == ("cup", "lamp")


def test_the_vocabulary_may_be_a_toml_list():
    settings = tomllib.loads('model = "m"\nvocabulary = ["cup", "lamp"]')
    assert InstancesConfig(**settings).vocabulary == ("cup", "lamp")


def test_a_network_of_another_task_is_refused(start):
    with pytest.raises(ConfigError, match=r"\[nodes\.instances\] model: 'tiny_boxes' .* boxes with masks"):
        start(model="tiny_boxes")


def test_it_takes_keyframes_only(start):
    with pytest.raises(TypeError, match="not End"):
        start(model="tiny_instances").step(End(frame_id=1, stamp_ns=0, frames=2))
