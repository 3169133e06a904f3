"""Losses of the ObjectNetwork: boxes and words by task-aligned assignment, and the dense head.

Source: TOOD's task-aligned assignment as in YOLOv8 (top 10 by score^.5 IoU^6); CIoU (Zheng 2020). Not as in YOLOv8:
the binary cross entropy of the dense head is focal (Lin 2017), because most of its cells show nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from placegraph.tools.training.data_augmentation import TrainingSample
from placegraph.tools.training.networks import anchors

TOP = 10
SCORE_POWER, IOU_POWER = 0.5, 6.0
BOX_WEIGHT, CLASS_WEIGHT, DENSE_WEIGHT, TAG_WEIGHT = 5.0, 0.5, 1.0, 0.05


@dataclass(frozen=True, eq=False)
class DetectionTargets:
    """Targets of a batch.

    boxes (M, 4), prompt of each (M,), whether it counts (M,), one list entry per image; cells (B, A8): the prompt of
    each stride-8 cell, -1 for none; tags (B, N): 1 shown, 0 not, nan too little to count.
    """

    boxes: list[Tensor]
    prompts: list[Tensor]
    counts: list[Tensor]
    cells: Tensor
    tags: Tensor


def detection_targets(samples: Sequence[TrainingSample], prompts: int) -> DetectionTargets:
    """Targets of a batch for `prompts` words; word i is that of class i while there are classes."""
    tags = np.zeros((len(samples), prompts), np.float32)
    for k, sample in enumerate(samples):
        tags[k, sample.classes[~sample.counts]] = np.nan
        tags[k, sample.classes[sample.counts]] = 1
    return DetectionTargets(
        [torch.from_numpy(s.boxes) for s in samples],
        [torch.from_numpy(s.classes) for s in samples],
        [torch.from_numpy(s.counts) for s in samples],
        torch.from_numpy(np.stack([s.cells for s in samples])),
        torch.from_numpy(tags),
    )


def losses(
    outputs: tuple[Tensor, Tensor, Tensor], targets: DetectionTargets, height: int, width: int
) -> dict[str, Tensor]:
    """Weighted losses by name, each a mean per sample."""
    distances, logits, dense = (part.float() for part in outputs)
    centres, strides = anchors(height, width)
    reach = functional.softplus(distances) * strides
    predicted_boxes = torch.cat((centres.T - reach[:, :2], centres.T + reach[:, 2:]), 1).transpose(1, 2)  # (B, A, 4)
    scores = torch.sigmoid(logits.detach())  # (B, N, A)
    target_scores = torch.zeros_like(scores)
    weight = torch.ones_like(scores)
    box_loss = torch.zeros(())
    total = torch.zeros(())
    for k in range(len(predicted_boxes)):
        boxes, prompts, counts = targets.boxes[k], targets.prompts[k], targets.counts[k]
        _ignore_anchors(weight[k], boxes[~counts], prompts[~counts], centres)
        boxes, prompts = boxes[counts], prompts[counts]
        if not len(boxes):
            continue
        owner, quality = assign_anchors(predicted_boxes[k].detach(), scores[k], boxes, prompts, centres)
        assigned = torch.nonzero(owner >= 0)[:, 0]
        if not len(assigned):
            continue
        target_scores[k, prompts[owner[assigned]], assigned] = quality[assigned]
        weight[k, prompts[owner[assigned]], assigned] = 1.0
        box_loss = (
            box_loss + ((1 - ciou(predicted_boxes[k, assigned], boxes[owner[assigned]])) * quality[assigned]).sum()
        )
        total = total + quality[assigned].sum()
    total = torch.clamp(total, min=1.0)
    class_loss = functional.binary_cross_entropy_with_logits(logits, target_scores, weight, reduction="sum")
    return {
        "box": BOX_WEIGHT * box_loss / total,
        "class": CLASS_WEIGHT * class_loss / total,
        "dense": DENSE_WEIGHT * _dense_loss(dense, targets.cells),
        "tag": TAG_WEIGHT * _tag_loss(dense, targets.tags),
    }


def assign_anchors(
    predicted_boxes: Tensor, scores: Tensor, boxes: Tensor, prompts: Tensor, centres: Tensor
) -> tuple[Tensor, Tensor]:
    """The box assigned to each anchor (A,), -1 for none, and the target score (A,).

    predicted_boxes: (A, 4) px; scores: (N, A); boxes: (M, 4); prompts: (M,); centres: (A, 2).
    """
    overlap = iou(boxes, predicted_boxes)  # (M, A)
    inside = (centres[None] > boxes[:, None, :2]).all(-1) & (centres[None] < boxes[:, None, 2:]).all(-1)
    # an object smaller than a cell may contain no centre: the nearest anchors are used
    off = torch.cdist((boxes[:, :2] + boxes[:, 2:]) / 2, centres)
    inside |= off <= torch.sort(off, dim=1)[0][:, 2:3]
    metric = scores[prompts] ** SCORE_POWER * overlap**IOU_POWER * inside + 1e-9 * inside
    best = torch.topk(metric, TOP, dim=1)
    chosen = torch.zeros_like(metric, dtype=torch.bool).scatter_(1, best.indices, best.values > 0)
    contested = chosen.sum(0) > 1
    if contested.any():
        winner = torch.where(chosen, overlap, torch.full_like(overlap, -1)).argmax(0)
        only = torch.zeros_like(chosen).scatter_(0, winner[None], True)
        chosen = torch.where(contested[None], chosen & only, chosen)
    metric = metric * chosen
    top_metric = metric.max(1, keepdim=True)[0].clamp(min=1e-9)
    top_overlap = (overlap * chosen).max(1, keepdim=True)[0]
    quality = (metric / top_metric * top_overlap).max(0)[0]
    owner = torch.where(chosen.any(0), chosen.float().argmax(0), torch.full_like(chosen[0], -1, dtype=torch.long))
    return owner, quality


def _ignore_anchors(weight: Tensor, boxes: Tensor, prompts: Tensor, centres: Tensor) -> None:
    """Anchors inside an object that is too small or cut off get no loss for its word."""
    for box, prompt in zip(boxes, prompts, strict=True):
        inside = ((centres > box[:2] - 8) & (centres < box[2:] + 8)).all(-1)
        weight[prompt, inside] = 0.0


def _dense_loss(dense: Tensor, cells: Tensor) -> Tensor:
    target = torch.zeros_like(dense)
    shown = cells >= 0
    image, cell = torch.nonzero(shown, as_tuple=True)
    target[image, cells[shown], cell] = 1.0
    loss = functional.binary_cross_entropy_with_logits(dense, target, reduction="none")
    miss = torch.abs(target - torch.sigmoid(dense.detach()))
    return (loss * miss**1.5).sum() / max(len(image), 1)


def _tag_loss(dense: Tensor, tags: Tensor) -> Tensor:
    pooled = torch.logsumexp(dense, dim=2)
    known = ~torch.isnan(tags)
    loss = functional.binary_cross_entropy_with_logits(pooled, torch.nan_to_num(tags), reduction="none")
    return (loss * known).sum() / len(tags)


def iou(a: Tensor, b: Tensor) -> Tensor:
    """(M, 4) and (A, 4) boxes to (M, A)."""
    low = torch.maximum(a[:, None, :2], b[None, :, :2])
    high = torch.minimum(a[:, None, 2:], b[None, :, 2:])
    shared = (high - low).clamp(min=0).prod(-1)
    areas = (a[:, 2:] - a[:, :2]).prod(-1)[:, None] + (b[:, 2:] - b[:, :2]).clamp(min=0).prod(-1)[None]
    return shared / (areas - shared + 1e-6)


def ciou(a: Tensor, b: Tensor) -> Tensor:
    """Complete IoU of paired boxes (K, 4)."""
    low, high = torch.maximum(a[:, :2], b[:, :2]), torch.minimum(a[:, 2:], b[:, 2:])
    shared = (high - low).clamp(min=0).prod(-1)
    size_a, size_b = a[:, 2:] - a[:, :2], b[:, 2:] - b[:, :2]
    plain = shared / (size_a.prod(-1) + size_b.prod(-1) - shared + 1e-6)
    around = torch.maximum(a[:, 2:], b[:, 2:]) - torch.minimum(a[:, :2], b[:, :2])
    apart = ((a[:, :2] + a[:, 2:] - b[:, :2] - b[:, 2:]) ** 2).sum(-1) / 4
    ratio = torch.atan(size_b[:, 0] / (size_b[:, 1] + 1e-6)) - torch.atan(size_a[:, 0] / (size_a[:, 1] + 1e-6))
    skew = 4 / torch.pi**2 * ratio**2
    with torch.no_grad():
        share = skew / (1 - plain + skew + 1e-6)
    return plain - apart / ((around**2).sum(-1) + 1e-6) - share * skew
