"""The box-prompted segmenter on tiny networks whose masks are the bright, or the near, part of each box."""

from __future__ import annotations

import numpy as np
import pytest
from onnx import helper

from placegraph.models_onnx.box_masks import FAMILY
from placegraph.runtime.errors import ModelError

HEIGHT, WIDTH, GRID, MARGIN = 96, 128, 48, 0.08


def make_encoder(tiny, path, depth=False, height=HEIGHT, width=WIDTH):
    """Embedding (1, 2, H / 2, W / 2): the red of 0..1 less .7, and the depth in m less 1.5 (-1.5 without depth)."""
    node = helper.make_node
    nodes = [
        node("Slice", ["images", "zero", "one", "axis"], ["red"]),
        node("Sub", ["red", "grey"], ["bright"]),
        node("Sub", ["depth", "near"] if depth else ["nothing", "near"], ["far"]),
        node("Concat", ["bright", "far"], ["both"], axis=1),
        node("AveragePool", ["both"], ["image_embeddings"], kernel_shape=[2, 2], strides=[2, 2]),
    ]
    constants = {"zero": np.array([0]), "one": np.array([1]), "axis": np.array([1]), "grey": 0.7, "near": 1.5}
    if not depth:
        constants["nothing"] = np.zeros((1, 1, height, width))
    inputs = {"images": [1, 3, height, width]} | ({"depth": [1, 1, height, width]} if depth else {})
    return tiny._save(path, nodes, inputs, {"image_embeddings": [1, 2, height // 2, width // 2]}, constants)


def make_decoder(tiny, path, channel=0, margin=MARGIN, grid=GRID, height=HEIGHT, width=WIDTH):
    """Masks: channel `channel` of the embedding at each box's grid; the predicted IoU is the box's width as a share."""
    line = (np.arange(grid) + 0.5) / grid * (1 + 2 * margin) - margin
    node = helper.make_node
    nodes = []
    for k, name in enumerate(("x0", "y0", "x1", "y1")):
        nodes.append(node("Slice", ["boxes", f"i{k}", f"i{k + 1}", "i1"], [name]))
    for a, shape in (("x", "row"), ("y", "column")):
        nodes += [
            node("Sub", [f"{a}1", f"{a}0"], [f"{a}size"]),
            node("Mul", [f"{a}size", "line"], [f"{a}along"]),
            node("Add", [f"{a}0", f"{a}along"], [f"{a}share"]),
            node("Reshape", [f"{a}share", shape], [f"{a}part"]),
            node("Expand", [f"{a}part", "square"], [f"{a}full"]),
        ]
    nodes += [
        node("Concat", ["xfull", "yfull"], ["shares"], axis=3),
        node("Mul", ["shares", "two"], ["double"]),
        node("Sub", ["double", "unit"], ["places4"]),
        node("Reshape", ["places4", "flat"], ["places"]),
        node("Slice", ["image_embeddings", "from", "to", "i1"], ["chosen"]),
        node("GridSample", ["chosen", "places"], ["sampled"], padding_mode="border"),
        node("Reshape", ["sampled", "boxwise"], ["masks"]),
        node("Identity", ["xsize"], ["iou_predictions"]),
    ]
    constants = {
        **{f"i{k}": np.array([k]) for k in range(5)},
        "line": line[None],
        "row": np.array([-1, 1, grid, 1]),
        "column": np.array([-1, grid, 1, 1]),
        "square": np.array([1, grid, grid, 1]),
        "two": 2.0,
        "unit": 1.0,
        "flat": np.array([1, -1, grid, 2]),
        "from": np.array([channel]),
        "to": np.array([channel + 1]),
        "boxwise": np.array([-1, 1, grid, grid]),
    }
    inputs = {"image_embeddings": [1, 2, height // 2, width // 2], "boxes": ["N", 4]}
    return tiny._save(path, nodes, inputs, {"masks": ["N", 1, grid, grid], "iou_predictions": ["N", 1]}, constants)


@pytest.fixture
def build(tiny, weights, tmp_path):
    def make(depth=False, channel=0, grown=MARGIN, **options):
        files = {
            "encoder": make_encoder(tiny, tmp_path / "encoder.onnx", depth),
            "decoder": make_decoder(tiny, tmp_path / "decoder.onnx", channel, grown),
        }
        return FAMILY(weights("box_masks", options=options, **files))

    return make


def picture(height, width, low, high):
    """Black, with a white rectangle between the corners `low` and `high` x y px; and where it is."""
    shown = np.zeros((height, width), bool)
    shown[low[1] : high[1], low[0] : high[0]] = True
    return np.where(shown[..., None], np.uint8(255), np.uint8(0)).repeat(3, axis=2), shown


def no_depth(image):
    return np.zeros(image.shape[:2], np.float32)


def edges(mask):
    """x0 y0 x1 y1 (exclusive) of a mask."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    return np.array([columns[0], rows[0], columns[-1] + 1, rows[-1] + 1])


# 4:3 as the network, a wide and an upright image (letterboxed), and one smaller than the network's input
@pytest.mark.parametrize(("height", "width"), [(96, 128), (480, 640), (360, 640), (640, 480), (40, 60), (301, 77)])
def test_the_mask_is_the_bright_part_of_the_box(build, height, width):
    low, high = (round(width * 0.3), round(height * 0.25)), (round(width * 0.62), round(height * 0.7))
    image, shown = picture(height, width, low, high)
    boxes = np.array([[width * 0.2, height * 0.15, width * 0.8, height * 0.85]], np.float32)
    mask = build().segment(image, no_depth(image), boxes)[0]
    assert mask.shape == (height, width) and mask.dtype == bool
    cell = max(0.6 * width, 0.7 * height) * (1 + 2 * MARGIN) / GRID  # px of the image that a mask's cell covers
    pooled = 2 * max(width / WIDTH, height / HEIGHT)  # px that a number of the embedding covers
    np.testing.assert_allclose(edges(mask), [*low, *high], atol=0.35 * pooled + 0.5 * cell + 0.51)
    if min(height, width) > 90:  # smaller ones have too few px inside for a share of them
        assert (mask & shown).sum() / (mask | shown).sum() > 0.9


def test_a_mask_is_exact_where_the_logits_are(build):
    """Left of the middle of the picture: a straight edge that bilinear logits place within a pixel, box after box."""
    image = np.repeat(np.linspace(255, 102, 640).astype(np.uint8)[None, :, None], 480, 0).repeat(
        3, 2
    )  # .7 in the middle
    boxes = [[0, 0, 640, 480], [300, 10, 360, 470], [310, 200, 340, 230], [200, 0, 600, 50], [0, 0, 400, 480]]
    masks = build().segment(image, no_depth(image), np.array(boxes, np.float32))
    for (x0, y0, x1, y1), mask in zip(boxes, masks, strict=True):
        wanted = np.array([x0, y0, 320, y1])
        np.testing.assert_allclose(edges(mask), wanted, atol=2.1)  # red changes every 4 px
        assert not mask[:, x1:].any() and not mask[y1:].any() and not mask[:y0].any()


@pytest.mark.parametrize("corner", ["left top", "right top", "left bottom", "right bottom", "all"])
def test_boxes_at_the_border(build, corner):
    """The grid of such a box exceeds the image; the mask ends with the image and is not moved."""
    image, _ = picture(360, 640, (0, 0), (640, 360))
    x = (0, 200) if "left" in corner else (440, 640)
    y = (0, 150) if "top" in corner else (210, 360)
    x, y = ((0, 640), (0, 360)) if corner == "all" else (x, y)
    box = np.array([[x[0], y[0], x[1], y[1]]], np.float32)
    mask = build().segment(image, no_depth(image), box)[0]
    inner = np.zeros_like(mask)
    inner[y[0] + 4 : y[1] - 4, x[0] + 4 : x[1] - 4] = True  # grey of the letterbox shines in by a few px
    assert mask[inner].all()
    outer = np.ones_like(mask)
    outer[y[0] : y[1], x[0] : x[1]] = False
    assert not mask[outer].any()


def test_boxes_that_exceed_the_image_are_cut_with_it(build):
    image, _ = picture(96, 128, (0, 0), (128, 96))
    boxes = np.array([[-20, -10, 40, 30], [100, 70, 160, 120], [140, 10, 160, 30], [-9, -9, -2, -2]], np.float32)
    masks = build().segment(image, no_depth(image), boxes)
    np.testing.assert_array_equal(edges(masks[0]), [0, 0, 40, 30])
    np.testing.assert_array_equal(edges(masks[1]), [100, 70, 128, 96])
    assert not masks[2].any() and not masks[3].any()


def test_boxes_without_a_pixel_have_empty_masks(build):
    image, _ = picture(96, 128, (0, 0), (128, 96))
    boxes = np.array([[10, 10, 10, 30], [20.6, 20, 21.4, 40], [30, 30, 31, 31], [50, 40, 45, 30]], np.float32)
    counts = [int(mask.sum()) for mask in build().segment(image, no_depth(image), boxes)]
    assert counts == [0, 0, 1, 0]


def test_each_box_gets_its_mask_in_order(build):
    image, _ = picture(96, 128, (10, 10), (30, 90))
    boxes = np.array([[60, 10, 100, 80], [4, 4, 40, 95], [10, 30, 30, 60]], np.float32)
    masks = build().segment(image, no_depth(image), boxes)
    assert not masks[0].any()
    np.testing.assert_allclose(edges(masks[1]), [10, 10, 30, 90], atol=1.5)
    np.testing.assert_array_equal(edges(masks[2]), [10, 30, 30, 60])


def test_no_boxes(build):
    image, _ = picture(96, 128, (0, 0), (9, 9))
    assert build().segment(image, no_depth(image), np.zeros((0, 4), np.float32)) == []


@pytest.mark.parametrize(("height", "width"), [(96, 128), (480, 640), (360, 640), (640, 480), (30, 40)])
def test_depth_lies_where_the_image_does(build, height, width):
    """By depth alone: the mask is what is farther than 1.5 m."""
    low, high = (round(width * 0.3), round(height * 0.25)), (round(width * 0.62), round(height * 0.7))
    image, far = picture(height, width, low, high)
    boxes = np.array([[0, 0, width, height]], np.float32)
    mask = build(depth=True, channel=1).segment(image, np.where(far, 3, 0).astype(np.float32), boxes)[0]
    cell, pooled = max(height, width) * (1 + 2 * MARGIN) / GRID, 2 * max(width / WIDTH, height / HEIGHT)
    np.testing.assert_allclose(edges(mask), [*low, *high], atol=0.35 * pooled + 0.5 * cell + 0.51)


def test_depth_does_not_shine_into_the_letterbox(build):
    """Beside the image nothing is known: depth 0, so a mask that reaches there ends."""
    image, _ = picture(200, 640, (0, 0), (640, 200))
    depth = np.full((200, 640), 3, np.float32)
    segmenter = build(depth=True, channel=1)
    box = np.array([[0, -200, 640, 400]], np.float32)
    assert segmenter.segment(image, depth, box)[0][10:190, 10:630].all()
    assert not segmenter.segment(image, no_depth(image), box)[0].any()


def test_an_export_without_depth_ignores_it(build):
    image, _ = picture(96, 128, (20, 20), (60, 60))
    box = np.array([[10, 10, 90, 90]], np.float32)
    segmenter = build(depth=False)
    plain = segmenter.segment(image, no_depth(image), box)[0]
    np.testing.assert_array_equal(plain, segmenter.segment(image, np.full((96, 128), 9, np.float32), box)[0])


def test_the_margin_is_that_of_the_export(build):
    image, _ = picture(96, 128, (30, 30), (80, 70))
    box = np.array([[20, 20, 100, 80]], np.float32)
    for margin in (0.0, 0.25):
        mask = build(grown=margin, margin=margin).segment(image, no_depth(image), box)[0]
        np.testing.assert_allclose(edges(mask), [30, 30, 80, 70], atol=1.6)
    wrong = build(grown=0.25, margin=0.0).segment(image, no_depth(image), box)[0]
    assert np.abs(edges(wrong) - [30, 30, 80, 70]).max() > 3  # so that the two above tell something


def test_masks_predicted_to_be_bad_are_left_empty(build):
    image, _ = picture(96, 128, (0, 0), (128, 96))
    boxes = np.array([[0, 0, 32, 48], [0, 0, 96, 48]], np.float32)  # predicted IoU .25 and .75
    found = [mask.any() for mask in build(min_iou=0.5).segment(image, no_depth(image), boxes)]
    assert found == [False, True]
    assert all(mask.shape == (96, 128) for mask in build(min_iou=1.0).segment(image, no_depth(image), boxes))


def test_other_layouts_are_refused_by_file(tiny, weights, tmp_path):
    encoder, decoder = make_encoder(tiny, tmp_path / "e.onnx"), make_decoder(tiny, tmp_path / "d.onnx")
    with pytest.raises(ModelError, match=r"e\.onnx: no input named 'image_embeddings'"):
        FAMILY(weights("box_masks", encoder=encoder, decoder=encoder))
    with pytest.raises(ModelError, match=r"d\.onnx: no input named 'images'"):
        FAMILY(weights("box_masks", encoder=decoder, decoder=decoder))
    small = make_decoder(tiny, tmp_path / "small.onnx", height=64, width=64)
    with pytest.raises(ModelError, match=r"small\.onnx: input 'image_embeddings' has shape \[1, 2, 32, 32\]"):
        FAMILY(weights("box_masks", encoder=encoder, decoder=small))
    with pytest.raises(ModelError, match="role 'encoder'"):
        FAMILY(weights("box_masks", model=encoder))
    sam = tiny.sam_decoder(tmp_path / "sam.onnx")
    with pytest.raises(ModelError, match=r"sam\.onnx"):
        FAMILY(weights("box_masks", encoder=encoder, decoder=sam))
    with pytest.raises(ModelError, match="margin"):
        FAMILY(weights("box_masks", options={"margin": -1}, encoder=encoder, decoder=decoder))


def test_an_export_of_open_size_is_refused_by_file(tiny, weights, tmp_path):
    pool = [helper.make_node("AveragePool", ["images"], ["image_embeddings"], kernel_shape=[2, 2], strides=[2, 2])]
    inputs, outputs = {"images": [1, 3, "H", "W"]}, {"image_embeddings": [1, 3, "h", "w"]}
    encoder = tiny._save(tmp_path / "open.onnx", pool, inputs, outputs, {})
    decoder = make_decoder(tiny, tmp_path / "d.onnx")
    with pytest.raises(ModelError, match=r"open\.onnx"):
        FAMILY(weights("box_masks", encoder=encoder, decoder=decoder))
