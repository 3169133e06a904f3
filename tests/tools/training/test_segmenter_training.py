"""What the segmenter is asked and taught: true masks on the grids of boxes, and its losses."""

from __future__ import annotations

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="training needs the extra `train`")

from placegraph.tools.training import segmenter_training  # noqa: E402
from placegraph.tools.training.data_augmentation import TrainingSample  # noqa: E402
from placegraph.tools.training.mask_networks import MaskDecoder, MaskEncoder  # noqa: E402
from placegraph.tools.training.segmenter_training import MaskNetwork, draw_box_prompts, mask_losses, train_masks  # noqa: E402
from placegraph.tools.training.view_rendering import visible_boxes  # noqa: E402

torch.set_num_threads(1)
HEIGHT, WIDTH, G = 96, 128, MaskDecoder.GRID
LINE = MaskDecoder().line.numpy()
INSIDE = torch.from_numpy(np.outer((LINE >= 0) & (LINE <= 1), (LINE >= 0) & (LINE <= 1)).astype(np.float32))


def make_sample(instance, counts=None):
    """A sample of an instance image (H, W); item i is of class i."""
    rows = visible_boxes(instance, np.arange(100, dtype=np.uint8))
    n = len(rows)
    return TrainingSample(
        np.zeros((*instance.shape, 3), np.uint8), rows[:, 2:6], rows[:, 1].astype(np.int64),
        np.ones(n, bool) if counts is None else np.array(counts, bool), rows[:, 0].astype(np.int64),
        instance, np.zeros(instance.shape, np.float32), np.full(instance.size // 64, -1),
    )  # fmt: skip


def shapes():
    """A disc, an L, and a ring around a block: masks that are no rectangles; the disc touches the border."""
    instance = np.zeros((HEIGHT, WIDTH), np.uint16)
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    instance[(x - 20) ** 2 + (y - 18) ** 2 < 24**2] = 1
    instance[50:90, 10:20] = instance[80:90, 10:60] = 2
    instance[30:80, 70:120] = 3
    instance[45:65, 85:105] = 4
    return instance


@pytest.fixture
def exact(monkeypatch):
    monkeypatch.setattr(segmenter_training, "BOX_JITTER", 0.0)


@pytest.mark.usefixtures("exact")
def test_a_mask_by_hand():
    instance = np.zeros((HEIGHT, WIDTH), np.uint16)
    instance[16:48, 16:32] = 1
    instance[16:24, 24:48] = 1  # an L upside down in the box (16, 16)-(48, 48)
    asked = draw_box_prompts([make_sample(instance)], LINE, np.random.default_rng(1))
    torch.testing.assert_close(asked.boxes[0], torch.tensor([[16 / 128, 16 / 96, 48 / 128, 48 / 96]]))
    x, y = LINE[None], LINE[:, None]
    wanted = (x > 0) & (y > 0) & (x < 1) & (y < 1) & ((x < 0.5) | (y < 0.25))
    assert asked.masks.shape == (1, 1, G, G) and asked.masks.dtype == torch.float32
    np.testing.assert_array_equal(asked.masks[0, 0].numpy(), wanted)


@pytest.mark.parametrize("jitter", [0.0, 0.06, 0.2])
def test_masks_are_what_the_decoder_samples_there(jitter, monkeypatch):
    """The instance image put in the place of the embedding and read by the decoder gives the true masks."""
    monkeypatch.setattr(segmenter_training, "BOX_JITTER", jitter)
    instance = shapes()
    sample = make_sample(instance)
    asked = draw_box_prompts([sample], LINE, np.random.default_rng(1))
    # the chosen items' order is that of the boxes: each box is found by what it overlaps most
    for box, mask in zip(asked.boxes[0], asked.masks, strict=True):
        agreement = []
        for item in range(4):
            embedding = torch.zeros(1, MaskEncoder.CHANNELS, HEIGHT, WIDTH)
            embedding[0, 0] = torch.from_numpy((instance == item + 1).astype(np.float32))
            seen = MaskDecoder().sample(embedding, box[None])[0, 0] > 0.5
            agreement.append(float((seen == (mask[0] > 0.5))[INSIDE > 0].float().mean()))
        assert max(agreement) > 0.97
    assert len(asked.masks) == 4


@pytest.mark.usefixtures("exact")
def test_only_what_counts_is_asked_for_and_not_too_much():
    some = make_sample(shapes(), [True, False, False, True])
    many = np.zeros((HEIGHT, WIDTH), np.uint16)
    for i in range(12):
        many[10 + 40 * (i // 6) :, 4 + 20 * (i % 6) : 20 + 20 * (i % 6)] = i + 1
    asked = draw_box_prompts([some, make_sample(many)], LINE, np.random.default_rng(1))
    assert [len(boxes) for boxes in asked.boxes] == [2, segmenter_training.BOXES]
    assert len(asked.masks) == 2 + segmenter_training.BOXES
    wanted = some.boxes[[0, 3]] / [WIDTH, HEIGHT, WIDTH, HEIGHT]
    found = asked.boxes[0].numpy()
    np.testing.assert_allclose(found[np.argsort(found[:, 0])], wanted[np.argsort(wanted[:, 0])], rtol=1e-6)
    assert len(np.unique(asked.boxes[1].numpy(), axis=0)) == segmenter_training.BOXES


def test_pictures_without_objects():
    empty = make_sample(np.zeros((HEIGHT, WIDTH), np.uint16))
    asked = draw_box_prompts([empty, empty], LINE, np.random.default_rng(1))
    assert [tuple(boxes.shape) for boxes in asked.boxes] == [(0, 4)] * 2 and asked.masks.shape == (0, 1, G, G)
    asked = draw_box_prompts([empty, make_sample(shapes())], LINE, np.random.default_rng(1))
    assert [len(boxes) for boxes in asked.boxes] == [0, 4] and len(asked.masks) == 4


def test_boxes_are_a_little_off_and_stay_boxes_in_the_image():
    sample = make_sample(shapes())
    random = np.random.default_rng(3)
    found = torch.cat([draw_box_prompts([sample], LINE, random).boxes[0] for _ in range(60)]).numpy()
    assert (found >= 0).all() and (found <= 1).all()
    assert (found[:, 2:] > found[:, :2]).all()
    true = sample.boxes / np.array([WIDTH, HEIGHT, WIDTH, HEIGHT], np.float32)
    nearest = np.abs(found[:, None] - true[None]).max(axis=2)
    assert 0.2 < (nearest.min(axis=1) < 1e-6).mean() < 0.4  # .3 are exact
    assert np.median(nearest.min(axis=1)) < 0.06
    a, b = (draw_box_prompts([sample], LINE, np.random.default_rng(9)) for _ in range(2))
    assert torch.equal(a.boxes[0], b.boxes[0]) and torch.equal(a.masks, b.masks)


def true_masks():
    return draw_box_prompts([make_sample(shapes())], LINE, np.random.default_rng(1)).masks


def test_perfect_masks_cost_nothing():
    wanted = true_masks()
    cost = mask_losses((wanted * 2 - 1) * 20, torch.ones(len(wanted), 1), wanted, INSIDE)
    assert {name: float(value) < 1e-3 for name, value in cost.items()} == dict.fromkeys(cost, True)
    assert set(cost) == {"entropy", "dice", "quality"}


def test_wrong_masks_cost_and_bad_predictions_of_that_too():
    wanted = true_masks()
    wrong = (1 - wanted * 2) * 20
    cost = mask_losses(wrong, torch.ones(len(wanted), 1), wanted, INSIDE)
    assert float(cost["entropy"]) > 5 and float(cost["dice"]) > 0.9
    assert float(cost["quality"]) == pytest.approx(0.2)  # 1 predicted, 0 true
    assert float(mask_losses(wrong, torch.zeros(len(wanted), 1), wanted, INSIDE)["quality"]) == 0


def test_the_true_iou_is_that_within_the_box():
    wanted, logits = torch.zeros(1, 1, G, G), torch.full((1, 1, G, G), -9.0)
    inner = torch.nonzero(INSIDE)
    top, left = inner.min(0)[0].tolist()
    wanted[..., top : top + 10, left : left + 10] = 1
    logits[..., top : top + 10, left : left + 5] = 9
    logits[..., :top, :] = 9  # outside of the box nobody looks
    assert float(mask_losses(logits, torch.full((1, 1), 0.5), wanted, INSIDE)["quality"]) == pytest.approx(0, abs=1e-6)
    assert float(mask_losses(logits, torch.full((1, 1), 0.5), wanted, INSIDE)["dice"]) == pytest.approx(
        1 - (2 * 50 + 1) / (50 + 100 + 1), abs=0.01
    )


def test_empty_masks_have_finite_losses_and_gradients():
    logits = torch.zeros(2, 1, G, G, requires_grad=True)
    quality = torch.full((2, 1), 0.5, requires_grad=True)
    sum(mask_losses(logits, quality, torch.zeros(2, 1, G, G), INSIDE).values()).backward()
    assert torch.isfinite(logits.grad).all() and (logits.grad.sum() > 0) and torch.isfinite(quality.grad).all()


def test_boxes_of_a_batch_are_decoded_with_their_own_image():
    torch.manual_seed(0)
    network = MaskNetwork().eval()
    image, depth = torch.rand(3, 3, 64, 64), torch.rand(3, 1, 64, 64)
    boxes = [
        torch.tensor([[0.1, 0.1, 0.6, 0.6]]),
        torch.zeros(0, 4),
        torch.tensor([[0.1, 0.1, 0.6, 0.6], [0, 0, 1, 1.0]]),
    ]
    with torch.no_grad():
        logits, quality = network(image, depth, boxes)
        assert logits.shape == (3, 1, G, G) and quality.shape == (3, 1)
        last = network(image[2:], depth[2:], boxes[2:])[0]
    torch.testing.assert_close(logits[1:], last, atol=1e-4, rtol=1e-3)
    assert (logits[0] - logits[1]).abs().max() > 1e-3  # the same box in two images


def write_shard(folder):
    random = np.random.default_rng(6)
    folder.mkdir(parents=True)
    instance = np.stack((shapes(), np.zeros_like(shapes())))
    np.save(folder / "color.npy", random.integers(0, 256, (*instance.shape, 3)).astype(np.uint8))
    np.save(folder / "depth.npy", np.full(instance.shape, 1500, np.uint16))
    np.save(folder / "instance.npy", instance)
    np.save(folder / "item_class.npy", np.arange(4, dtype=np.uint8))
    np.save(folder / "boxes.npy", np.insert(visible_boxes(instance[0], np.arange(4, dtype=np.uint8)), 0, 0, axis=1))


def test_a_few_steps_of_training(tmp_path, monkeypatch):
    write_shard(tmp_path / "data" / "20000")  # half of its views show nothing
    monkeypatch.setattr(segmenter_training, "SIZE", (64, 64))
    monkeypatch.setattr(segmenter_training, "BATCH", 1)
    found = train_masks(tmp_path / "data", tmp_path / "masks.pt", steps=3, threads=1)
    assert not found.training
    assert all(torch.isfinite(value).all() for value in found.state_dict().values() if value.is_floating_point())
    assert torch.load(tmp_path / "masks.pt", weights_only=True)["done"] == 3
