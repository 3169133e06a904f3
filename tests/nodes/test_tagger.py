import numpy as np
import pytest

from placegraph.nodes.tagger import NODE, TaggerConfig
from placegraph.runtime.errors import ConfigError, ModelError
from placegraph.runtime.messages import End, Keyframe
from placegraph.runtime.node import Context


@pytest.fixture
def start(folder):
    def build(**settings):
        node = NODE(TaggerConfig(**settings), Context(model_dirs=(str(folder),)))
        node.start()
        return node

    return build


def keyframe(color):
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


def test_a_keyframe_gives_its_tags(start):
    (tags,) = start(model="tiny_tags").step(keyframe((255, 0, 0)))
    tags.check()
    assert (tags.frame_id, tags.stamp_ns, tags.names) == (3, 77, ("red",))
    np.testing.assert_allclose(tags.scores, [0.9525], atol=1e-3)


def test_min_score_and_max_tags(start):
    gray = keyframe((0, 0, 0))  # three logits of 0
    assert start(model="tiny_tags").step(gray)[0].names == ("red", "grey", "blue")
    assert start(model="tiny_tags", max_tags=2).step(gray)[0].names == ("red", "grey")
    (none,) = start(model="tiny_tags", min_score=0.5).step(gray)
    none.check()
    assert none.names == ()


def test_a_network_of_another_task_is_refused(start):
    with pytest.raises(ConfigError, match=r"\[nodes\.tagger\] model: 'tiny_sam' .* cannot tag images"):
        start(model="tiny_sam")


def test_missing_weights_are_refused(start):
    with pytest.raises(ModelError, match="no weights named 'nothing'"):
        start(model="nothing")


def test_it_takes_keyframes_only(start):
    with pytest.raises(TypeError, match="not End"):
        start(model="tiny_tags").step(End(frame_id=1, stamp_ns=0, frames=2))
