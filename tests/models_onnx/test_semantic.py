from pathlib import Path

import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper, numpy_helper

from placegraph.models_onnx import Detector, InstanceSegmenter, Segmenter, Tagger
from placegraph.models_onnx.load import load
from placegraph.models_onnx.semantic import FAMILY
from placegraph.nodes.camera._flat_scene import CLASSES
from placegraph.nodes.camera.flat import SOURCE
from placegraph.runtime.errors import ModelError

LABELS = ("wall", "red", "blue")


def make_colors(path, height="height", width="width", stride=1, channels=3):
    """Logits: wall 5, red 10 R, blue 10 B, with R and B in 0..1; every `stride`-th pixel."""
    weight = np.zeros((3, channels, 1, 1), np.float32)
    weight[1, 0], weight[2, 2] = 10, 10
    conv = helper.make_node("Conv", ["image", "weight", "bias"], ["logits"], strides=[stride, stride])
    graph = helper.make_graph(
        [conv],
        "colors",
        [helper.make_tensor_value_info("image", TensorProto.FLOAT, [1, channels, height, width])],
        [helper.make_tensor_value_info("logits", TensorProto.FLOAT, [1, 3, "h", "w"])],
        [
            numpy_helper.from_array(weight, "weight"),
            numpy_helper.from_array(np.array([5, 0, 0], np.float32), "bias"),
        ],
    )
    onnx.save(helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=9), path)
    return path


@pytest.fixture
def family(tmp_path, weights):
    def build(options=None, labels=LABELS, **shape):
        file = make_colors(tmp_path / "colors.onnx", **shape)
        chosen = {"ignore": ["wall"], "min_area_px": 1, **(options or {})}
        return FAMILY(weights("semantic", labels, chosen, model=file), 1)

    return build


@pytest.fixture
def image():
    """Grey wall with a red square of 8 x 6, a smaller red one of 4 x 5 and a blue one of 10 x 10."""
    picture = np.full((40, 60, 3), 20, np.uint8)
    picture[2:8, 3:11] = (255, 0, 0)
    picture[30:35, 50:54] = (230, 0, 0)
    picture[15:25, 20:30] = (0, 0, 245)
    return picture


def test_implements_the_tasks(family):
    for task in (InstanceSegmenter, Detector, Tagger, Segmenter):
        assert isinstance(family(), task)


def test_nothing_in_the_image(family):
    empty = np.full((10, 12, 3), 20, np.uint8)
    found = family().instances(empty, ())
    assert found.masks == []
    assert found.boxes.names == ()
    assert found.boxes.boxes_px.shape == (0, 4)
    assert found.boxes.scores.shape == (0,)
    tags = family().tag(empty)
    assert (tags.names, tags.scores.shape) == ((), (0,))
    masks = family().segment(empty, np.zeros((10, 12), np.float32), np.array([[0, 0, 5, 5]], np.float32))
    assert [mask.any() for mask in masks] == [False]
    assert family().segment(empty, np.zeros((10, 12), np.float32), np.zeros((0, 4), np.float32)) == []


def test_one_pixel(family):
    found = family().instances(np.array([[[255, 0, 0]]], np.uint8), ())
    assert found.boxes.names == ("red",)
    assert found.boxes.boxes_px.tolist() == [[0, 0, 1, 1]]


def test_pieces_of_one_class_are_separate_and_surest_comes_first(family, image):
    found = family().instances(image, ["names", "are", "ignored"])
    assert found.boxes.names == ("red", "blue", "red")
    assert found.boxes.boxes_px.tolist() == [[3, 2, 11, 8], [20, 15, 30, 25], [50, 30, 54, 35]]
    assert found.boxes.boxes_px.dtype == found.boxes.scores.dtype == np.float32
    assert [int(mask.sum()) for mask in found.masks] == [48, 100, 20]
    assert found.masks[0][2:8, 3:11].all()
    assert all(mask.shape == (40, 60) and mask.dtype == bool for mask in found.masks)
    # softmax of (5, 10, 0) and of the paler ones
    expected = [np.exp(x) / (np.exp(x) + np.exp(5) + 1) for x in (10, 10 * 245 / 255, 10 * 230 / 255)]
    assert found.boxes.scores == pytest.approx(expected, rel=1e-5)


def test_touching_things_of_one_class_are_one_piece(family, image):
    image[2:8, 11:20] = (255, 0, 0)
    assert family().detect(image, ()).names.count("red") == 2


def test_small_pieces_and_unsure_pixels_are_left_out(family, image):
    assert family({"min_area_px": 21}).detect(image, ()).names == ("red", "blue")
    assert family({"min_area_px": 20}).detect(image, ()).names == ("red", "blue", "red")
    assert family({"min_confidence": 0.992}).detect(image, ()).names == ("red",)


def test_labels_that_are_not_ignored_are_objects(family, image):
    assert "wall" in family({"ignore": []}).detect(image, ()).names


def test_tags_name_each_class_once_with_its_best_score(family, image):
    tags = family().tag(image)
    assert tags.names == ("red", "blue")
    assert tags.scores == pytest.approx(family().detect(image, ()).scores[:2])


def test_masks_for_boxes_come_in_their_order(family, image):
    boxes = np.array([[48, 28, 55, 36], [0, 38, 2, 40], [19, 14, 31, 26]], np.float32)
    masks = family().segment(image, np.zeros((40, 60), np.float32), boxes)
    assert [int(mask.sum()) for mask in masks] == [20, 0, 100]


@pytest.mark.parametrize("shape", [{"stride": 2}, {"height": 20, "width": 30}, {"height": 80, "width": 120}])
def test_networks_of_another_size_come_back_at_the_image_s(family, image, shape):
    found = family(None, **shape).instances(image, ())
    assert sorted(found.boxes.names) == ["blue", "red", "red"]
    boxes = np.array(sorted(found.boxes.boxes_px.tolist()))  # a smaller network blends borders: scores change places
    assert np.abs(boxes - [[3, 2, 11, 8], [20, 15, 30, 25], [50, 30, 54, 35]]).max() <= 2
    assert all(mask.shape == (40, 60) for mask in found.masks)


def test_mean_and_std_options(family, image):
    """With R halved, red loses against the wall."""
    assert family({"std": [510.0, 255.0, 255.0], "min_confidence": 0.6}).detect(image, ()).names == ("blue",)


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"ignore": ["floor"]}, "no label named floor"),
        ({"min_confidence": 2.0}, "min_confidence"),
        ({"min_aera_px": 3}, "min_aera_px"),
        ({"mean": [0.0]}, "mean"),
    ],
)
def test_wrong_options_are_named(family, options, text):
    with pytest.raises(ModelError, match=text):
        family(options)


def test_layouts_that_do_not_fit_are_named(family):
    with pytest.raises(ModelError, match=r"colors\.onnx: input 'image' has shape \[1, 4"):
        family(channels=4)
    with pytest.raises(ModelError, match=r"colors\.onnx: output 'logits' has shape \[1, 3"):
        family({"ignore": []}, labels=("wall", "red"))
    with pytest.raises(ModelError, match="needs labels"):
        family({"ignore": []}, labels=())


def test_the_embedded_network_knows_the_drawn_scene():
    """Another seed than it was fitted on: other noise and other tints."""
    network = load("drawn_scene")
    source = SOURCE(Path(), {"seed": 7, "frames": 8})
    right = total = 0
    hits, wanted = set(), set()
    for index in range(len(source.poses)):
        color, _, truth = source.render(index)
        labels, confidence = network.classify(color)
        assert confidence.min() > 0
        right += int((labels == truth).sum())
        total += truth.size
        counts = np.bincount(truth.ravel(), minlength=len(CLASSES))
        wanted |= {name for name, count in zip(CLASSES, counts, strict=True) if count > 300} - {"background"}
        hits |= set(network.tag(color).names)
    assert right / total > 0.99
    assert len(wanted) >= 10
    assert hits >= wanted
