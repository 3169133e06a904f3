import runpy
import tomllib
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from placegraph.models_onnx.text_encoder import TextEncoder
from placegraph.nodes.detector import NODE, DetectorConfig
from placegraph.runtime.errors import ConfigError
from placegraph.runtime.messages import Keyframe, Tags
from placegraph.runtime.node import Context

MAKER = Path(__file__).parents[1] / "models_onnx" / "make_tiny_models.py"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("tiny")
    maker = runpy.run_path(str(MAKER))
    maker["write_models"](path)
    texts = TextEncoder().encode(["coffee mug", "floor lamp"])
    maker["yolo_prompted"](path / "prompted.onnx", [[16, 16, 16, 16], [44, 32, 24, 48]], texts)
    with (path / "manifest.toml").open("a") as file:
        file.write(maker["manifest_table"]("tiny_prompted", "yolo", path, {"model": "prompted.onnx"}))
    return path


@pytest.fixture
def start(folder):
    def build(**settings):
        node = NODE(DetectorConfig(**settings), Context(model_dirs=(str(folder),)))
        node.start()
        return node

    return build


def keyframe(frame_id=3):
    image = np.zeros((64, 64, 3), np.uint8)
    image[..., 0] = 255
    return Keyframe(
        frame_id=frame_id,
        stamp_ns=70 + frame_id,
        color=image,
        depth=np.zeros((64, 64), np.uint16),
        depth_unit_m=0.001,
        intrinsics=np.array([60.0, 60, 32, 32]),
        world_from_camera=np.eye(4),
    )


def tags(*names, frame_id=3):
    return Tags(frame_id=frame_id, stamp_ns=70 + frame_id, names=names, scores=np.ones(len(names), np.float32))


@pytest.mark.parametrize("tags_first", [True, False])
def test_a_keyframe_and_its_tags_give_detections(start, tags_first):
    node = start(model="tiny_boxes")
    first, second = (tags(), keyframe()) if tags_first else (keyframe(), tags())
    assert list(node.step(first)) == []
    (found,) = node.step(second)
    found.check()
    assert (found.frame_id, found.stamp_ns, found.names) == (3, 73, ("cup", "lamp"))
    np.testing.assert_allclose(found.boxes_px, [[8, 8, 24, 24], [32, 8, 56, 56]], atol=1e-4)


def test_frames_are_not_mixed(start):
    node = start(model="tiny_boxes")
    assert list(node.step(keyframe(1))) == []
    assert list(node.step(tags(frame_id=2))) == []
    assert [found.frame_id for found in node.step(tags(frame_id=1))] == [1]
    assert [found.frame_id for found in node.step(keyframe(2))] == [2]


def test_min_score_and_max_objects(start):
    def names(**settings):
        node = start(model="tiny_boxes", **settings)
        node.step(tags())
        return node.step(keyframe())[0].names

    assert names(min_score=0.1) == ("cup", "lamp", "cup")
    assert names(min_score=0.1, max_objects=2) == ("cup", "lamp")
    assert names(min_score=0.95) == ()


def test_tags_and_vocabulary_are_looked_for(start):
    def names(vocabulary, *tag_names):
        node = start(model="tiny_prompted", min_score=0.9, vocabulary=vocabulary)
        node.step(tags(*tag_names))
        (found,) = node.step(keyframe())
        found.check()
        return set(found.names)

    assert names((), "coffee mug") == {"coffee mug"}
    assert names(("floor lamp",), "coffee mug", "floor lamp") == {"coffee mug", "floor lamp"}
    assert names(("floor lamp",)) == {"floor lamp"}
    assert names(()) == set()


def test_the_vocabulary_may_be_a_toml_list():
    settings = tomllib.loads('model = "m"\nvocabulary = ["cup", "lamp"]')
    assert DetectorConfig(**settings).vocabulary == ("cup", "lamp")
    with pytest.raises(ValidationError, match="vocabulary"):
        DetectorConfig(model="m", vocabulary=[1])
    with pytest.raises(ValidationError, match="vocabulary"):
        DetectorConfig(model="m", vocabulary="cup")


def test_settings_are_checked():
    for wrong in ({}, {"model": "m", "min_score": 2.0}, {"model": "m", "max_objects": 0}, {"model": "m", "gian": 1}):
        with pytest.raises(ValidationError):
            DetectorConfig(**wrong)


def test_a_network_of_another_task_is_refused(start):
    with pytest.raises(ConfigError, match=r"\[nodes\.detector\] model: 'tiny_tags' .* cannot find boxes"):
        start(model="tiny_tags")
