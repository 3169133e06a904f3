import numpy as np
import pytest

from placegraph.models_onnx.yolo_seg import FAMILY
from placegraph.runtime.errors import ModelError

LABELS = ("cup", "lamp")
NO_DEPTH = np.zeros((64, 64), np.float32)


@pytest.fixture
def network(tiny, weights, tmp_path):
    rows = [
        tiny.seg_row((32, 32, 32, 32), (0.9, 0.1), p0=3),  # left half positive
        tiny.seg_row((32, 32, 16, 16), (0.1, 0.6), p0=-9, p1=1),  # right half
        tiny.seg_row((32, 32, 32, 28), (0.2, 0.3), p1=1),  # upper half; less certain than the first
        tiny.seg_row((8, 8, 4, 4), (0.5, 0.0), p2=-1),  # nowhere
    ]
    path = tiny.yolo_seg(tmp_path / "m.onnx", rows, tiny.quadrants())
    return FAMILY(weights("yolo_seg", LABELS, {"min_score": 0.4}, model=path))


def rectangle(x0, y0, x1, y1, shape=(64, 64)):
    mask = np.zeros(shape, bool)
    mask[y0:y1, x0:x1] = True
    return mask


def test_masks_of_instances(network, red):
    found = network.instances(red(), ())
    assert found.boxes.names == ("cup", "lamp", "cup")
    np.testing.assert_allclose(found.boxes.boxes_px[:2], [[16, 16, 48, 48], [24, 24, 40, 40]], atol=1e-4)
    np.testing.assert_array_equal(found.masks[0], rectangle(16, 16, 32, 48))
    np.testing.assert_array_equal(found.masks[1], rectangle(32, 24, 40, 40))
    assert not found.masks[2].any()


def test_detect_gives_the_same_boxes(network, red):
    found, same = network.instances(red(), ()).boxes, network.detect(red(), ("zebra",))
    assert found.names == same.names
    np.testing.assert_array_equal(found.boxes_px, same.boxes_px)


def test_nothing_in_a_black_image(network):
    found = network.instances(np.zeros((64, 64, 3), np.uint8), ())
    assert found.boxes.names == () and found.masks == []


@pytest.mark.parametrize(("height", "width"), [(100, 200), (200, 100), (480, 640), (64, 64), (33, 47)])
def test_masks_lie_where_the_image_does(network, red, height, width):
    """The left half of the network's input is the left half of the image, whatever the padding."""
    found = network.instances(red(height, width), ())
    x0, y0, x1, y1 = np.floor(found.boxes.boxes_px[0] + 0.5).astype(int)
    expected = rectangle(x0, y0, x1, y1, (height, width))
    wrong = found.masks[0] ^ (expected & (np.arange(width) < width / 2))
    assert wrong.sum() <= y1 - y0  # an odd middle column may fall on either side
    assert found.masks[0].shape == (height, width) and found.masks[0].any()


def test_prompts_take_the_anchor_that_fits_best_by_overlap_and_certainty(network, red):
    prompts = np.array([[16, 16, 48, 46], [24, 24, 40, 40], [60, 60, 64, 64]], np.float32)
    masks = network.segment(red(), NO_DEPTH, prompts)
    # The first overlaps anchors 0 (.94) and 2 (.93) alike: 0 is more certain. The last overlaps none.
    np.testing.assert_array_equal(masks[0], rectangle(16, 16, 32, 46))
    np.testing.assert_array_equal(masks[1], rectangle(32, 24, 40, 40))
    assert not masks[2].any() and masks[2].shape == (64, 64)


def test_a_prompt_below_half_overlap_gets_an_empty_mask(network, red):
    masks = network.segment(red(), NO_DEPTH, np.array([[16, 16, 48, 31], [16, 16, 48, 33]], np.float32))
    assert not masks[0].any() and masks[1].any()


def test_no_prompts(network, red):
    assert network.segment(red(), NO_DEPTH, np.zeros((0, 4), np.float32)) == []


def test_instances_are_bounded(tiny, weights, tmp_path, red):
    rows = [tiny.seg_row((4 * i + 2, 8, 3, 3), (0.5 + i / 100, 0), p2=1) for i in range(9)]
    path = tiny.yolo_seg(tmp_path / "m.onnx", rows, tiny.quadrants())
    found = FAMILY(weights("yolo_seg", LABELS, {"max_objects": 4}, model=path)).instances(red(), ())
    np.testing.assert_allclose(found.boxes.scores, [0.58, 0.57, 0.56, 0.55], atol=1e-6)
    assert len(found.masks) == 4


def test_an_export_without_masks_is_refused(tiny, weights, tmp_path):
    path = tiny.yolo(tmp_path / "m.onnx", [[1, 1, 1, 1, 0.5, 0.5]])
    with pytest.raises(ModelError, match=r"expected boxes \(1, 4\+C\+M, A\) and prototypes"):
        FAMILY(weights("yolo_seg", LABELS, model=path))


def test_labels_must_fit(tiny, weights, tmp_path):
    path = tiny.yolo_seg(tmp_path / "m.onnx", [tiny.seg_row((1, 1, 1, 1), (0.5, 0.5))], tiny.quadrants())
    with pytest.raises(ModelError, match=r"expected \[1, 39, 'A'\]"):
        FAMILY(weights("yolo_seg", ("a", "b", "c"), model=path))


@pytest.mark.weights
def test_yolov8n_seg_finds_a_kitchen(real_models, real_frame):
    from placegraph.models_onnx.load import load

    network, image = load("yolov8n_seg_320", [real_models]), real_frame(0)
    found = network.instances(image, ())
    assert {"dining table", "chair", "cup"} <= set(found.boxes.names)
    prompt = np.array([[368, 163, 403, 203]], np.float32)  # the cup, by eye
    mask = network.segment(image, np.zeros((480, 640), np.float32), prompt)[0]
    assert 0.6 < mask.sum() / (35 * 40) <= 1.01
