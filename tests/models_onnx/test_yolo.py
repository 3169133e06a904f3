import numpy as np
import pytest

from placegraph.models_onnx.text_encoder import DIMENSIONS, TextEncoder
from placegraph.models_onnx.yolo import FAMILY
from placegraph.runtime.errors import ModelError

LABELS = ("cup", "lamp")
ROWS = [[16, 32, 16, 16, 0.9, 0.1], [17, 32, 16, 16, 0.8, 0.1], [48, 32, 8, 24, 0.0, 0.6], [5, 5, 2, 2, 0.05, 0.09]]


@pytest.fixture
def fixed(tiny, weights, tmp_path):
    return FAMILY(weights("yolo", LABELS, model=tiny.yolo(tmp_path / "m.onnx", ROWS)))


def prompted(tiny, weights, tmp_path, slots="N"):
    path = tiny.yolo_prompted(
        tmp_path / "p.onnx",
        [[16, 32, 16, 16], [48, 32, 8, 24]],
        TextEncoder().encode(["coffee mug", "floor lamp"]),
        slots=slots,
    )
    return FAMILY(weights("yolo", options={"min_score": 0.9}, model=path))


def test_fixed_classes_ignore_the_names(fixed, red):
    found = fixed.detect(red(), ("zebra",))
    assert found.names == ("cup", "lamp")  # the second cup repeats the first, the last is below the floor
    np.testing.assert_allclose(found.boxes_px, [[8, 24, 24, 40], [44, 20, 52, 44]], atol=1e-4)
    np.testing.assert_allclose(found.scores, [0.9, 0.6], atol=1e-6)


def test_the_image_is_in_the_middle(fixed, red):
    found = fixed.detect(red(100, 200), ())  # scaled by .32, padded by 16 rows
    np.testing.assert_allclose(found.boxes_px, [[25, 25, 75, 75], [137.5, 12.5, 162.5, 87.5]], atol=1e-3)


def test_red_is_the_first_channel_of_0_to_1(fixed, red):
    assert fixed.detect(red()[:, :, ::-1].copy(), ()).names == ()
    half = red() // 2
    np.testing.assert_allclose(fixed.detect(half, ()).scores, [0.9 * 127 / 255, 0.6 * 127 / 255], atol=1e-5)


@pytest.mark.parametrize("slots", ["N", 2, 5])
def test_prompted_finds_what_it_is_asked_for(tiny, weights, tmp_path, red, slots):
    network = prompted(tiny, weights, tmp_path, slots)
    found = network.detect(red(), ("zebra", "floor lamp", "coffee mug", "floor lamp"))
    assert found.names == ("floor lamp", "coffee mug") or found.names == ("coffee mug", "floor lamp")
    boxes = dict(zip(found.names, found.boxes_px.tolist(), strict=True))
    assert boxes == {"coffee mug": [8, 24, 24, 40], "floor lamp": [44, 20, 52, 44]}
    assert network.detect(red(), ("zebra",)).names == ()


def test_prompted_with_no_names_finds_nothing(tiny, weights, tmp_path, red):
    found = prompted(tiny, weights, tmp_path).detect(red(), ())
    assert found.names == () and found.boxes_px.shape == (0, 4) and found.scores.shape == (0,)


def test_text_features_of_another_encoder_are_refused(tiny, weights, tmp_path):
    path = tiny.yolo_prompted(tmp_path / "p.onnx", [[1, 1, 1, 1]], np.ones((1, 512)))
    with pytest.raises(ModelError, match=f"text features of 512 numbers, but the text encoder gives {DIMENSIONS}"):
        FAMILY(weights("yolo", model=path))


def test_a_prompted_network_has_no_labels(tiny, weights, tmp_path):
    path = tiny.yolo_prompted(tmp_path / "p.onnx", [[1, 1, 1, 1]], np.ones((1, DIMENSIONS)))
    with pytest.raises(ModelError, match="no labels of its own"):
        FAMILY(weights("yolo", LABELS, model=path))


def test_labels_must_fit(tiny, weights, tmp_path):
    path = tiny.yolo(tmp_path / "m.onnx", ROWS)
    with pytest.raises(ModelError, match="needs labels"):
        FAMILY(weights("yolo", model=path))
    with pytest.raises(ModelError, match=r"'output0' has shape \[1, 6, 4\], expected \[1, 7, 'A'\]"):
        FAMILY(weights("yolo", ("a", "b", "c"), model=path))


def test_a_sam_decoder_is_no_yolo(tiny, weights, tmp_path):
    with pytest.raises(ModelError, match="expected one output"):
        FAMILY(weights("yolo", LABELS, model=tiny.sam_decoder(tmp_path / "d.onnx")))
