import numpy as np
import pytest

from placegraph.models_onnx.sam import FAMILY, upscale
from placegraph.runtime.errors import ModelError


@pytest.fixture
def build(tiny, weights, tmp_path):
    def make(raw=False, **options):
        files = {
            "encoder": tiny.sam_encoder(tmp_path / "encoder.onnx", raw),
            "decoder": tiny.sam_decoder(tmp_path / "decoder.onnx"),
        }
        return FAMILY(weights("sam", options=options, **files))

    return make


def half_white(height, width):
    """White above, black below: the tiny encoder says where it is bright."""
    image = np.zeros((height, width, 3), np.uint8)
    image[: height // 2] = 255
    return image


@pytest.mark.parametrize(("height", "width"), [(480, 640), (640, 480), (1024, 1024), (100, 30)])
def test_the_mask_is_the_bright_part_of_the_box(build, height, width):
    box = np.array([[width * 0.25, height * 0.125, width * 0.75, height * 0.875]], np.float32)
    mask = build().segment(half_white(height, width), np.zeros((height, width), np.float32), box)[0]
    assert mask.shape == (height, width) and mask.dtype == bool
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    cell = max(height, width) / 256  # px of the image a low-resolution pixel covers
    side = cell + 0.5  # a mask ends at whole pixels
    assert abs(columns[0] - width * 0.25) <= side and abs(columns[-1] + 1 - width * 0.75) <= side
    assert abs(rows[0] - height * 0.125) <= side
    assert abs(rows[-1] + 1 - height * 0.5) <= 4 * cell  # the embedding is four times coarser
    assert mask[rows[0] : rows[-1] - round(4 * cell), columns[0] : columns[-1]].mean() > 0.97


def test_an_encoder_with_its_preprocessing_inside_gets_plain_pixels(build):
    box = np.array([[256, 128, 768, 896]], np.float32)
    image = half_white(1024, 1024)
    image[:512] = 200
    mask = build(raw=True).segment(image, np.zeros((1024, 1024), np.float32), box)[0]
    assert abs(int(mask.sum()) - 512 * 384) <= 4 * 4 * (512 + 384)


def test_each_box_gets_its_mask_in_order(build):
    boxes = np.array([[0, 0, 320, 60], [320, 60, 640, 120], [0, 300, 640, 480]], np.float32)
    masks = build().segment(half_white(480, 640), np.zeros((480, 640), np.float32), boxes)
    assert masks[0][10:50, 10:310].all() and not masks[0][70:].any()
    assert masks[1][70:110, 330:630].all() and not masks[1][:50].any()
    assert not masks[2].any()  # a dark box: the decoder's best mask is negative everywhere


def test_no_boxes(build):
    empty = np.zeros((0, 4), np.float32)
    assert build().segment(half_white(48, 64), np.zeros((48, 64), np.float32), empty) == []


def test_masks_predicted_to_be_bad_are_left_empty(build):
    box = np.array([[0, 0, 320, 120]], np.float32)
    depth = np.zeros((480, 640), np.float32)
    assert not build(min_iou=0.95).segment(half_white(480, 640), depth, box)[0].any()
    assert build(min_iou=0.9 - 1e-6).segment(half_white(480, 640), depth, box)[0].any()


def test_upscaling_keeps_places():
    low = np.full((256, 256), -1, np.float32)
    low[:, :128] = 1  # of the 1024 px square, 512 columns or rows; the image takes its upper 768 rows
    scales = np.array([1.6, 1.6], np.float32)
    np.testing.assert_array_equal(upscale(low, scales, (480, 640)), np.broadcast_to(np.arange(640) < 320, (480, 640)))
    rows = np.broadcast_to(np.arange(480)[:, None] < 320, (480, 640))
    np.testing.assert_array_equal(upscale(np.ascontiguousarray(low.T), scales, (480, 640)), rows)


def test_another_export_is_refused(tiny, weights, tmp_path):
    encoder, decoder = tiny.sam_encoder(tmp_path / "e.onnx"), tiny.sam_decoder(tmp_path / "d.onnx")
    with pytest.raises(ModelError, match=r"e\.onnx: no input named 'image_embeddings'"):
        FAMILY(weights("sam", encoder=encoder, decoder=encoder))
    with pytest.raises(ModelError, match=r"d\.onnx: expected one input"):
        FAMILY(weights("sam", encoder=decoder, decoder=decoder))
    with pytest.raises(ModelError, match="role 'encoder'"):
        FAMILY(weights("sam", model=encoder))
