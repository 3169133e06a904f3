"""Assignment and losses of the detector against cases worked out by hand."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="training needs the extra `train`")

from placegraph.tools.training.data_augmentation import TrainingSample  # noqa: E402
from placegraph.tools.training.detection_losses import (  # noqa: E402
    DetectionTargets,
    assign_anchors,
    ciou,
    detection_targets,
    iou,
    losses,
)
from placegraph.tools.training.networks import anchors  # noqa: E402

torch.set_num_threads(1)
SIZE = 64
CENTERS, STRIDES = anchors(SIZE, SIZE)
COUNT = len(CENTERS)
WORDS = 5


def around(boxes):
    """What all anchors find (A, 4): the box around them of `boxes`, else one stride to each side."""
    found = torch.cat((CENTERS - STRIDES[:, None], CENTERS + STRIDES[:, None]), 1)
    for box in boxes:
        inside = (box[:2] < CENTERS).all(1) & (box[2:] > CENTERS).all(1)
        found[inside] = box
    return found


def raw(found):
    """Raw distances (1, 4, A) that decode to boxes (A, 4) around their anchors."""
    reach = torch.cat((CENTERS - found[:, :2], found[:, 2:] - CENTERS), 1) / STRIDES[:, None]
    return torch.log(torch.expm1(reach.clamp(min=1e-3))).T[None].contiguous()


def targets(boxes=(), prompts=(), counts=None, cells=None, tags=None):
    """Targets of one image."""
    boxes = torch.tensor(boxes, dtype=torch.float32).reshape(-1, 4)
    counts = [True] * len(boxes) if counts is None else counts
    return DetectionTargets(
        [boxes],
        [torch.tensor(prompts, dtype=torch.long)],
        [torch.tensor(counts, dtype=torch.bool)],
        torch.full((1, 64), -1) if cells is None else cells,
        torch.zeros(1, WORDS) if tags is None else tags,
    )


def outputs(found=None, logit=-3.0):
    """Leaf tensors of one image: boxes, logits, dense logits."""
    distances = raw(around([]) if found is None else found)
    plain = torch.full((1, WORDS, COUNT), logit), torch.full((1, WORDS, 64), logit)
    return tuple(part.clone().requires_grad_() for part in (distances, *plain))


@pytest.mark.parametrize("x", [0.0, 0.5, 7.9, 8.0, 30.0, 62.0])
@pytest.mark.parametrize("y", [0.0, 15.5, 62.0])
@pytest.mark.parametrize("size", [0.5, 2.0])
def test_a_box_smaller_than_a_cell_has_anchors_near_it(x, y, size):
    box = torch.tensor([[x, y, x + size, y + size]])
    owner, quality = assign_anchors(around([]), torch.full((WORDS, COUNT), 0.1), box, torch.tensor([2]), CENTERS)
    mine = torch.nonzero(owner == 0)[:, 0]
    assert 1 <= len(mine) <= 10
    off = (CENTERS[mine] - box[0, :2] - size / 2).norm(dim=1)
    assert off.max() < 20
    assert torch.isfinite(quality).all() and quality[mine].max() > 0


def test_tiny_boxes_of_one_picture_all_have_an_anchor():
    low = torch.tensor([[3.0, 3], [20, 8], [40, 8], [8, 40], [31, 31], [61, 61]])
    boxes = torch.cat((low, low + 2), 1)
    owner, _ = assign_anchors(
        around([]), torch.full((WORDS, COUNT), 0.1), boxes, torch.zeros(6, dtype=torch.long), CENTERS
    )
    assert set(owner.tolist()) == {-1, 0, 1, 2, 3, 4, 5}


def test_anchors_outside_answer_for_nothing():
    box = torch.tensor([[16.0, 16, 40, 48]])
    owner, quality = assign_anchors(around(box), torch.full((WORDS, COUNT), 0.5), box, torch.tensor([0]), CENTERS)
    mine = owner >= 0
    assert mine.sum() == 10  # of the 12 + 2 + 0 inside
    assert ((CENTERS[mine] > box[0, :2]) & (CENTERS[mine] < box[0, 2:])).all()
    torch.testing.assert_close(quality[mine].max(), torch.tensor(1.0), atol=1e-3, rtol=0)
    assert (quality[~mine] == 0).all()


def test_a_contested_anchor_goes_to_the_box_of_higher_iou():
    boxes = torch.tensor([[0.0, 0, 40, 40], [14, 14, 54, 54]])
    shared = (boxes[1, :2] < CENTERS).all(1) & (boxes[0, 2:] > CENTERS).all(1)
    found = around([])
    steps = torch.linspace(0.5, 13.5, int(shared.sum()))  # from near the first to near the second
    found[shared] = boxes[0] + steps[:, None]
    owner, _ = assign_anchors(found, torch.full((WORDS, COUNT), 0.5), boxes, torch.tensor([1, 1]), CENTERS)
    assert shared.sum() == 11  # each box asks for ten of them
    assert owner[shared].tolist() == iou(boxes, found[shared]).argmax(0).tolist()
    assert set(owner[shared].tolist()) == {0, 1}


def test_an_anchor_that_scores_the_word_is_preferred():
    box = torch.tensor([[0.0, 0, 64, 64]])
    scores = torch.full((WORDS, COUNT), 0.01)
    wanted = torch.arange(20, 30)
    scores[3, wanted] = 0.9
    scores[2, 40:50] = 0.9  # another word
    owner, _ = assign_anchors(around(box), scores, box, torch.tensor([3]), CENTERS)
    assert torch.nonzero(owner == 0)[:, 0].tolist() == wanted.tolist()


def perfect(boxes, prompts, cells):
    """Outputs that answer exactly for the anchors that are assigned, and exactly no elsewhere."""
    found = around(boxes)
    owner, _ = assign_anchors(found, torch.full((WORDS, COUNT), 0.5), boxes, torch.tensor(prompts), CENTERS)
    logits = torch.full((1, WORDS, COUNT), -15.0)
    mine = owner >= 0
    logits[0, torch.tensor(prompts)[owner[mine]], mine] = 15.0
    dense = torch.full((1, WORDS, 64), -15.0)
    shown = cells[0] >= 0
    dense[0, cells[0][shown], shown] = 15.0
    return raw(found), logits, dense


def test_perfect_outputs_cost_nothing():
    boxes, prompts = torch.tensor([[4.0, 4, 28, 28], [36, 20, 60, 60]]), [1, 4]
    cells = torch.full((1, 8, 8), -1)
    cells[0, 1:3, 1:3], cells[0, 3:7, 5:7] = 1, 4
    tags = torch.zeros(1, WORDS)
    tags[0, prompts] = 1
    cost = losses(
        perfect(boxes, prompts, cells.flatten(1)),
        targets(boxes.tolist(), prompts, None, cells.flatten(1), tags),
        SIZE,
        SIZE,
    )
    assert {name: float(value) < 0.01 for name, value in cost.items()} == dict.fromkeys(
        ("box", "class", "dense", "tag"), True
    )


def test_each_fault_shows_in_its_own_loss():
    boxes, prompts = torch.tensor([[4.0, 4, 28, 28]]), [1]
    cells = torch.full((1, 64), -1)
    cells[0, 9] = 1
    tags = torch.zeros(1, WORDS)
    tags[0, 1] = 1
    good, want = perfect(boxes, prompts, cells), targets(boxes.tolist(), prompts, None, cells, tags)
    shifted, _, _ = perfect(boxes + 6, prompts, cells)
    assert float(losses((shifted, *good[1:]), want, SIZE, SIZE)["box"]) > 0.3
    silent = torch.full_like(good[1], -15.0)
    assert float(losses((good[0], silent, good[2]), want, SIZE, SIZE)["class"]) > 1
    other = good[1].roll(1, dims=1)
    assert float(losses((good[0], other, good[2]), want, SIZE, SIZE)["class"]) > 1
    missed = losses((good[0], good[1], torch.full_like(good[2], -15.0)), want, SIZE, SIZE)
    assert float(missed["dense"]) > 1 and float(missed["tag"]) > 0.1


def class_gradient(want):
    """(N, A) of the class loss by the logits."""
    out = outputs()
    losses(out, want, SIZE, SIZE)["class"].backward()
    return out[1].grad[0]


def test_a_word_is_pushed_down_where_nothing_shows_it():
    assert (class_gradient(targets()) > 0).all()


def test_an_ignored_object_does_not_push_its_word_down():
    box = [16.0, 16, 48, 48]
    grad = class_gradient(targets([box], [2], [False]))
    inside = ((CENTERS > 16) & (CENTERS < 48)).all(1)
    far = ((CENTERS < 4) | (CENTERS > 60)).any(1)
    assert inside.sum() > 15 and (grad[2, inside] == 0).all()
    assert (grad[2, far] > 0).all()
    assert (grad[[0, 1, 3, 4]] > 0).all()  # only its own word is spared


def test_an_ignored_object_keeps_its_word_where_another_object_is_found():
    """A cup too small to count before a table: the table's anchors must not say `no cup` either."""
    table, cup = [8.0, 8, 56, 56], [24.0, 24, 40, 40]
    grad = class_gradient(targets([table, cup], [1, 2], [True, False]))
    inside = ((CENTERS > 24) & (CENTERS < 40)).all(1)
    assert (grad[1, inside] != 0).all()
    assert (grad[2, inside] == 0).all()


def test_an_image_without_objects_has_finite_losses_and_gradients():
    out = outputs()
    cost = losses(out, targets(), SIZE, SIZE)
    assert float(cost["box"]) == 0
    sum(cost.values()).backward()
    assert out[0].grad is None or torch.isfinite(out[0].grad).all()
    assert torch.isfinite(out[1].grad).all() and torch.isfinite(out[2].grad).all()
    assert out[1].grad.abs().sum() > 0


def test_extreme_outputs_have_finite_gradients():
    out = tuple(
        (torch.randn(part.shape, generator=torch.Generator().manual_seed(1)) * 40).requires_grad_()
        for part in outputs()
    )
    cells = torch.full((1, 64), -1)
    cells[0, 5] = 3
    tags = torch.full((1, WORDS), torch.nan)
    sum(
        losses(out, targets([[4, 4, 5, 60], [0, 0, 64, 64]], [3, 1], None, cells, tags), SIZE, SIZE).values()
    ).backward()
    assert all(torch.isfinite(part.grad).all() for part in out)


def test_images_of_a_batch_do_not_mix():
    a, b = targets([[4, 4, 28, 28]], [1]), targets()
    both = DetectionTargets(
        a.boxes + b.boxes, a.prompts + b.prompts, a.counts + b.counts, a.cells.repeat(2, 1), a.tags.repeat(2, 1)
    )
    out = tuple(part.detach().repeat(2, 1, 1).requires_grad_() for part in outputs())
    losses(out, both, SIZE, SIZE)["box"].backward()
    assert out[0].grad[0].abs().sum() > 0 and (out[0].grad[1] == 0).all()


def test_descending_the_losses_finds_the_boxes():
    """The raw outputs themselves are trained: losses alone must lead to the right boxes and words."""
    boxes, prompts = torch.tensor([[5.0, 9, 30, 50], [33, 3, 61, 22], [50, 50, 54, 54]]), [0, 3, 3]
    want = targets(boxes.tolist(), prompts)
    out = outputs()
    optimizer = torch.optim.Adam(out, lr=0.2)
    for _ in range(120):
        optimizer.zero_grad()
        sum(losses(out, want, SIZE, SIZE).values()).backward()
        optimizer.step()
    reach = torch.nn.functional.softplus(out[0][0]).T * STRIDES[:, None]
    found = torch.cat((CENTERS - reach[:, :2], CENTERS + reach[:, 2:]), 1)
    scores = torch.sigmoid(out[1][0])
    overlap = iou(boxes, found)
    for k, prompt in enumerate(prompts):
        best = (scores[prompt] * (overlap[k] > 0.5)).argmax()
        assert scores[prompt, best] > 0.8 and overlap[k, best] > 0.85
    assert scores[[1, 2, 4]].max() < 0.1


def test_iou_by_hand():
    a = torch.tensor([[0.0, 0, 10, 10], [20, 20, 30, 40]])
    b = torch.tensor([[0.0, 0, 10, 10], [5, 0, 15, 10], [50, 50, 60, 60], [20, 20, 20, 20]])
    torch.testing.assert_close(iou(a, b), torch.tensor([[1.0, 1 / 3, 0, 0], [0, 0, 0, 0]]), atol=1e-5, rtol=0)
    assert iou(a, torch.zeros(0, 4)).shape == (2, 0)


def test_ciou_is_one_for_equal_boxes_and_less_for_others():
    a = torch.tensor([[3.0, 4, 23, 14]])
    torch.testing.assert_close(ciou(a, a), torch.ones(1), atol=1e-4, rtol=0)
    moved, far = ciou(a, a + 2.0), ciou(a, a + 100.0)
    same_middle = ciou(a, torch.tensor([[8.0, -1, 18, 19]]))
    assert moved < iou(a, a + 2.0)[0] < 1 and far < 0
    assert same_middle < iou(a, torch.tensor([[8.0, -1, 18, 19]]))[0]  # the aspect costs, too
    assert ciou(a, a + 50.0) > far  # nearer is better also without overlap
    torch.testing.assert_close(ciou(a, a + 2.0), ciou(a + 2.0, a))


def test_ciou_has_finite_gradients():
    a = torch.tensor([[3.0, 4, 23, 14], [3, 4, 23, 14], [0, 0, 1e-3, 1e-3]], requires_grad=True)
    ciou(a, torch.tensor([[3.0, 4, 23, 14], [80, 80, 90, 90], [5, 5, 9, 9]])).sum().backward()
    assert torch.isfinite(a.grad).all() and (a.grad[1].abs().sum() > 0)


def make_sample(classes, counts):
    n = len(classes)
    boxes = np.tile(np.array([4, 4, 20, 20], np.float32), (n, 1))
    return TrainingSample(
        np.zeros((SIZE, SIZE, 3), np.uint8), boxes, np.array(classes, np.int64), np.array(counts, bool), np.arange(n),
        np.zeros((SIZE, SIZE), np.uint16), np.zeros((SIZE, SIZE), np.float32), np.full(64, -1),
    )  # fmt: skip


def test_targets_of_a_batch():
    first = make_sample([2, 2, 4, 0], [False, True, False, True])
    cells = np.full(64, -1)
    cells[7] = 2
    found = detection_targets([dataclasses.replace(first, cells=cells), make_sample([], [])], 7)
    nan = float("nan")
    np.testing.assert_array_equal(found.tags.numpy(), [[1, 0, 1, 0, nan, 0, 0], [0] * 7])
    assert [len(boxes) for boxes in found.boxes] == [4, 0] and found.cells.shape == (2, 64)
    assert int(found.cells[0, 7]) == 2 and found.counts[0].tolist() == [False, True, False, True]
    assert found.prompts[0].dtype == torch.long and found.counts[1].dtype == torch.bool
