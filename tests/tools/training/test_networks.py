"""Layouts, sizes and geometry of the networks, on inputs of 64 px."""

from __future__ import annotations

import pytest

torch = pytest.importorskip("torch", reason="training needs the extra `train`")

from placegraph.tools.training.mask_networks import MaskDecoder, MaskEncoder  # noqa: E402
from placegraph.tools.training.networks import STRIDES, Backbone, DetectorExport, ObjectNetwork, TaggerNetwork, anchors  # noqa: E402

torch.set_num_threads(1)
G, MARGIN = MaskDecoder.GRID, MaskDecoder.MARGIN


@pytest.fixture(autouse=True)
def seeded():
    torch.manual_seed(0)


@pytest.fixture(scope="module")
def network():
    torch.manual_seed(0)
    return ObjectNetwork().eval()


def test_anchors_are_cell_middles_by_stride_row_column():
    centers, strides = anchors(64, 96)
    assert [int((strides == s).sum()) for s in STRIDES] == [96, 24, 6]
    assert centers[:2].tolist() == [[4, 4], [12, 4]] and centers[12].tolist() == [4, 12]
    assert centers[96].tolist() == [8, 8] and centers[-1].tolist() == [80, 48]
    assert strides.tolist() == sorted(strides.tolist())


def test_outputs_of_the_object_network(network):
    with torch.no_grad():
        distances, logits, dense = network(torch.rand(2, 3, 64, 96), torch.randn(2, 7, 256))
    assert distances.shape == (2, 4, 126) and logits.shape == (2, 7, 126) and dense.shape == (2, 7, 96)
    probability = torch.sigmoid(logits)
    assert 0.001 < float(probability.mean()) < 0.1  # most cells show nothing


def test_features_have_the_strides_that_anchors_count(network):
    with torch.no_grad():
        features = network.backbone(torch.rand(1, 3, 64, 96))
    assert [tuple(f.shape[1:]) for f in features] == [
        (width, 64 // stride, 96 // stride) for width, stride in zip(Backbone.WIDTHS, STRIDES, strict=True)
    ]


def test_cells_and_anchors_have_the_same_order(network):
    """Something at one place of the image changes the logits of the anchors there most."""
    with torch.no_grad():
        text, plain = torch.randn(1, 1, 256), torch.full((1, 3, 128, 192), 0.5)
        marked = plain.clone()
        marked[:, :, 80:104, 144:168] = torch.rand(3, 24, 24)
        change = (network(marked, text)[0] - network(plain, text)[0]).abs().sum(1)[0]
    centers, strides = anchors(128, 192)
    for stride in STRIDES[:2]:
        here = strides == stride
        strongest = centers[here][change[here].argmax()]
        assert (strongest - torch.tensor([156.0, 92.0])).norm() < 2.5 * stride


def test_every_weight_learns():
    network = ObjectNetwork()
    outputs = network(torch.rand(2, 3, 64, 64), torch.randn(2, 3, 256))
    sum((part**2).sum() for part in outputs).backward()
    dead = [name for name, p in network.named_parameters() if p.grad is None or not torch.isfinite(p.grad).all()]
    assert dead == []


def test_a_word_is_scored_alone(network):
    with torch.no_grad():
        image, text = torch.rand(1, 3, 64, 64), torch.randn(1, 4, 256)
        logits, alone = network(image, text)[1], network(image, text[:, 2:3])[1]
    torch.testing.assert_close(logits[:, 2:3], alone, atol=1e-5, rtol=1e-4)


class Fixed(torch.nn.Module):
    """An ObjectNetwork of known outputs."""

    def __init__(self, distances, logits):
        super().__init__()
        self.outputs = distances, logits, None

    def forward(self, image, text):
        return self.outputs


def test_detector_boxes_decode_as_documented():
    distances = torch.full((1, 4, 84), -20.0)  # nothing: softplus(-20) = 0
    half = torch.log(torch.expm1(torch.tensor([0.5, 1.0, 1.5, 2.0])))  # left, top, right, bottom in strides
    logits = torch.full((1, 2, 84), -4.0)
    for anchor in (9, 64 + 5, 83):
        distances[0, :, anchor] = half
    logits[0, 1, 69] = 2.0
    found = DetectorExport(Fixed(distances, logits), 64, 64)(torch.rand(1, 3, 64, 64), torch.rand(1, 2, 256))
    assert found.shape == (1, 6, 84)
    # anchor 9: stride 8 at (12, 12): x 8..24, y 4..28
    torch.testing.assert_close(found[0, :4, 9], torch.tensor([16.0, 16, 16, 24]))
    # anchor 69: stride 16 at (24, 24): x 16..48, y 8..56
    torch.testing.assert_close(found[0, :4, 69], torch.tensor([32.0, 32, 32, 48]))
    # anchor 83: stride 32 at (48, 48): x 32..96, y 16..112
    torch.testing.assert_close(found[0, :4, 83], torch.tensor([64.0, 64, 64, 96]))
    torch.testing.assert_close(found[0, 2:4, 0], torch.zeros(2), atol=1e-5, rtol=0)
    torch.testing.assert_close(found[0, 4:, 69], torch.sigmoid(torch.tensor([-4.0, 2.0])))


def test_detector_takes_any_number_of_words(network):
    detector = DetectorExport(network, 64, 96)
    with torch.no_grad():
        for count in (1, 5):
            found = detector(torch.rand(1, 3, 64, 96), torch.randn(1, count, 256))
            assert found.shape == (1, 4 + count, 126)
            assert (found[:, 2:4] > 0).all() and (found[:, 4:] >= 0).all() and (found[:, 4:] <= 1).all()


def test_tagger_undoes_the_normalization_and_pools_cells_and_anchors(network):
    text = torch.randn(5, 256)
    tagger = TaggerNetwork(network, text).eval()
    image = torch.rand(2, 3, 64, 64)
    mean, std = torch.tensor([0.485, 0.456, 0.406]), torch.tensor([0.229, 0.224, 0.225])
    normal = (image - mean.view(3, 1, 1)) / std.view(3, 1, 1)
    with torch.no_grad():
        tagger.gains.copy_(torch.stack((torch.linspace(0.5, 2, 5), torch.linspace(0.7, 0.1, 5))))
        tagger.shift.copy_(torch.linspace(-1, 1, 5))
        _, anchors, cells = network(image, text[None].expand(2, -1, -1))
        wanted = torch.linspace(0.5, 2, 5) * torch.logsumexp(cells, 2) + torch.linspace(-1, 1, 5)
        wanted += torch.linspace(0.7, 0.1, 5) * torch.logsumexp(anchors, 2)
        entered = []
        hook = network.backbone.register_forward_pre_hook(lambda _, given: entered.append(given[0]))
        found = tagger(normal)
        hook.remove()
    torch.testing.assert_close(entered[0], image)  # an untrained network's logits hardly depend on its input
    assert found.shape == (2, 5)
    torch.testing.assert_close(found, wanted, atol=1e-3, rtol=1e-3)


def test_mask_encoder_keeps_depth_in_its_last_channel():
    encoder = MaskEncoder().eval()
    depth = torch.rand(2, 1, 64, 96) * 4
    depth[:, :, :8] = 0
    with torch.no_grad():
        found = encoder(torch.rand(2, 3, 64, 96), depth)
        without = encoder(torch.rand(2, 3, 64, 96), torch.zeros(2, 1, 64, 96))
    assert found.shape == (2, MaskEncoder.CHANNELS, 32, 48)
    torch.testing.assert_close(found[:, -1], depth[:, 0].unflatten(1, (32, 2)).unflatten(3, (48, 2)).amax((2, 4)))
    assert (without[:, -1] == 0).all() and torch.isfinite(without).all()


def ramps(height, width):
    """Embedding (1, C, h, w): channel 0 is x, 1 is y as shares of the image, the last is depth 1 + 2 x."""
    embedding = torch.zeros(1, MaskEncoder.CHANNELS, height, width)
    x, y = (torch.arange(width) + 0.5) / width, (torch.arange(height) + 0.5) / height
    embedding[0, 0], embedding[0, 1], embedding[0, -1] = x[None], y[:, None], 1 + 2 * x[None]
    return embedding


@pytest.mark.parametrize("size", [(40, 52), (32, 32), (160, 208)], ids=str)
def test_the_grid_lies_exactly_on_the_box(size):
    boxes = torch.tensor([[0.2, 0.3, 0.7, 0.9], [0.5, 0.1, 0.6, 0.2], [0.1, 0.4, 0.9, 0.45]])
    cells = MaskDecoder().sample(ramps(*size), boxes)
    assert cells.shape == (3, MaskEncoder.CHANNELS + 4, G, G)
    line = (torch.arange(G) + 0.5) / G * (1 + 2 * MARGIN) - MARGIN  # -.08 .. 1.08 of the box
    for cell, (x0, y0, x1, y1) in zip(cells, boxes.tolist(), strict=True):
        torch.testing.assert_close(cell[0], (x0 + (x1 - x0) * line)[None].expand(G, G), atol=1e-4, rtol=0)
        torch.testing.assert_close(cell[1], (y0 + (y1 - y0) * line)[:, None].expand(G, G), atol=1e-4, rtol=0)


def test_the_line_reaches_the_margin_on_both_sides():
    line = MaskDecoder().line
    half = (1 + 2 * MARGIN) / G / 2
    torch.testing.assert_close(line[[0, -1]], torch.tensor([-MARGIN + half, 1 + MARGIN - half]))
    torch.testing.assert_close(line + line.flip(0), torch.ones(G))


def test_depth_is_relative_to_the_middle_and_the_box_is_drawn():
    box = torch.tensor([[0.2, 0.3, 0.6, 0.9]])
    cell = MaskDecoder().sample(ramps(64, 64), box)[0]
    relative, coarse_mask, size = cell[-5], cell[-3], cell[-2:]
    wanted = 2 * (cell[0] - 0.4)  # depth is 1 + 2 x and the box's middle at x = .4
    torch.testing.assert_close(relative, wanted, atol=5e-3, rtol=0)
    torch.testing.assert_close(cell[-4], relative * 4)
    line = MaskDecoder().line
    inside = (line > 0) & (line < 1)
    torch.testing.assert_close(coarse_mask, (inside[:, None] & inside[None]).float())
    torch.testing.assert_close(size[:, 3, 5], torch.tensor([0.4, 0.6]))


def test_far_depth_is_clamped_and_no_depth_is_level():
    embedding = ramps(64, 64)
    embedding[0, -1, :, 40:] = 100.0
    cell = MaskDecoder().sample(embedding, torch.tensor([[0.1, 0.1, 0.6, 0.6]]))[0]
    assert float(cell[-5].max()) <= 2.0 and float(cell[-5].min()) >= -2.0
    embedding[0, -1] = 0
    cell = MaskDecoder().sample(embedding, torch.tensor([[0.1, 0.1, 0.6, 0.6]]))[0]
    assert (cell[-5] == 0).all() and torch.isfinite(cell).all()


def test_what_lies_outside_the_image_is_empty():
    embedding = torch.ones(1, MaskEncoder.CHANNELS, 32, 32)
    cell = MaskDecoder().sample(embedding, torch.tensor([[-0.5, 0.0, 0.5, 0.5]]))[0]
    line = MaskDecoder().line
    assert (cell[0][:, line < 0.45] == 0).all()
    torch.testing.assert_close(cell[0][8:-8, line > 0.55], torch.ones(G - 16, int((line > 0.55).sum())))


def test_no_boxes_give_no_masks():
    masks, quality = MaskDecoder().eval()(torch.rand(1, MaskEncoder.CHANNELS, 16, 16), torch.zeros(0, 4))
    assert masks.shape == (0, 1, G, G) and quality.shape == (0, 1)


def test_each_box_is_decoded_alone():
    decoder, embedding = MaskDecoder().eval(), torch.rand(1, MaskEncoder.CHANNELS, 32, 32)
    boxes = torch.tensor([[0.1, 0.1, 0.5, 0.5], [0.4, 0.2, 0.9, 0.9], [0, 0, 1, 1]])
    with torch.no_grad():
        masks, quality = decoder(embedding, boxes)
        alone, its_quality = decoder(embedding, boxes[1:2])
    assert masks.shape == (3, 1, G, G) and quality.shape == (3, 1)
    assert ((quality >= 0) & (quality <= 1)).all()
    torch.testing.assert_close(masks[1:2], alone, atol=1e-5, rtol=1e-4)
    torch.testing.assert_close(quality[1:2], its_quality, atol=1e-5, rtol=1e-4)
