import numpy as np
import pytest

from placegraph.models_onnx.yolox import FAMILY
from placegraph.runtime.errors import ModelError

LABELS = ("cup", "lamp")
# 64 px: anchors 0..63 of stride 8, 64..79 of stride 16, 80..83 of stride 32.
# Anchor 9 is cell (1, 1): centre (1.5, 1) * 8 = (12, 8), size 8 x 16; anchor 83 cell (1, 1): (48, 48), size 32 x 32.
ROWS = {
    9: [0.5, 0, 0, np.log(2), 1.0, 0.9, 0.1],
    10: [-0.5, 0, 0, np.log(2), 1.0, 0.8, 0.1],  # the same box from the next cell: a repeat
    83: [0.5, 0.5, 0, 0, 0.5, 0.2, 1.0],
    84 - 5: [0, 0, 0, 0, 0.3, 0.3, 0.3],  # .3 * .3 is below the floor of .1
}


@pytest.fixture
def network(tiny, weights, tmp_path):
    return FAMILY(weights("yolox", LABELS, model=tiny.yolox(tmp_path / "m.onnx", ROWS)))


def blue(height, width):
    image = np.zeros((height, width, 3), np.uint8)
    image[..., 2] = 255
    return image


def test_boxes_are_decoded(network):
    found = network.detect(blue(64, 64), ())
    assert found.names == ("cup", "lamp")
    np.testing.assert_allclose(found.scores, [0.9, 0.5], atol=1e-6)
    np.testing.assert_allclose(found.boxes_px, [[8, 0, 16, 16], [32, 32, 64, 64]], atol=1e-4)
    assert (found.boxes_px.dtype, found.scores.dtype) == (np.float32, np.float32)


def test_the_letterbox_is_undone_and_clipped(network):
    found = network.detect(blue(100, 200), ())  # scaled by .32, 32 rows used: the lamp lies below the image
    assert found.names == ("cup",)
    np.testing.assert_allclose(found.boxes_px, [[25, 0, 50, 50]], atol=1e-3)


def test_nothing_in_a_black_image(network):
    found = network.detect(np.zeros((64, 64, 3), np.uint8), ("cup",))
    assert found.names == () and found.boxes_px.shape == (0, 4)


def test_blue_is_the_first_channel(network, red):
    assert network.detect(red(), ()).names == ()


def test_the_floor_is_an_option(tiny, weights, tmp_path):
    path = tiny.yolox(tmp_path / "m.onnx", ROWS)
    assert FAMILY(weights("yolox", LABELS, {"min_score": 0.6}, model=path)).detect(blue(64, 64), ()).names == ("cup",)


@pytest.mark.parametrize(("labels", "text"), [((), "needs labels"), (("cup",), r"expected \[1, 'A', 6\]")])
def test_labels_must_fit(tiny, weights, tmp_path, labels, text):
    with pytest.raises(ModelError, match=text):
        FAMILY(weights("yolox", labels, model=tiny.yolox(tmp_path / "m.onnx", ROWS)))


def test_another_export_is_refused(tiny, weights, tmp_path):
    path = tiny.channel_means(tmp_path / "m.onnx", [[1, 0, 0]], 8)
    with pytest.raises(ModelError, match=r"m\.onnx: output 'logits'"):
        FAMILY(weights("yolox", LABELS, model=path))


def test_the_number_of_anchors_must_be_that_of_the_grids(tiny, weights, tmp_path):
    rows = [[1, 1, 1, 1, 1, 0.5, 0.5]] * 3
    path = tiny.yolo(tmp_path / "m.onnx", np.array(rows).T.tolist(), classes=0)  # (1, 3, 7): three anchors
    with pytest.raises(ModelError, match="3 anchors, expected 84"):
        FAMILY(weights("yolox", LABELS, model=path)).detect(blue(64, 64), ())


@pytest.mark.weights
def test_yolox_nano_finds_a_kitchen(real_models, real_frame):
    from placegraph.models_onnx.load import load

    found = load("yolox_nano", [real_models]).detect(real_frame(0), ())
    names = [name for name, score in zip(found.names, found.scores, strict=True) if score >= 0.5]
    assert {"dining table", "chair", "cup"} <= set(names)
    cup = found.boxes_px[found.names.index("cup")]
    np.testing.assert_allclose(cup, [368, 163, 403, 203], atol=8)  # by eye
