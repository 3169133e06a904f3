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

from placegraph.tools.simulator.object_classes import NAMES
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
    return DetectionTargets(
        [torch.from_numpy(s.boxes) for s in samples],
        [torch.from_numpy(s.classes) for s in samples],
        [torch.from_numpy(s.counts) for s in samples],
        torch.from_numpy(np.stack([s.cells for s in samples])),
        tag_targets(samples, prompts),
    )


def tag_targets(samples: Sequence[TrainingSample], count: int = len(NAMES)) -> Tensor:
    """(B, count): 1 shown, 0 not, nan where the only visible object of the class is too small or cut off."""
    tags = np.zeros((len(samples), count), np.float32)
    for k, sample in enumerate(samples):
        tags[k, sample.classes[~sample.counts]] = np.nan
        tags[k, sample.classes[sample.counts]] = 1
    return torch.from_numpy(tags)


class AnchorLosses:
    """Box and class losses of a batch by task-aligned assignment, accumulated image by image."""

    def __init__(self, distances: Tensor, logits: Tensor, height: int, width: int) -> None:
        """distances: (B, 4, A) raw; logits: (B, N, A) of N words."""
        self.centers, strides = anchors(height, width)
        reach = functional.softplus(distances) * strides
        self.boxes = torch.cat((self.centers.T - reach[:, :2], self.centers.T + reach[:, 2:]), 1).transpose(1, 2)
        self.logits, self.scores = logits, torch.sigmoid(logits.detach())
        self.target_scores, self.weight = torch.zeros_like(self.scores), torch.ones_like(self.scores)
        self.box_loss, self.total = torch.zeros(()), torch.zeros(())

    def add(self, k: int, boxes: Tensor, prompts: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Adds image k with boxes (M, 4) of prompts (M,); returns assigned anchors, their boxes and quality (K,)."""
        if not len(boxes):
            return prompts, prompts, torch.zeros(0)
        owner, quality = assign_anchors(self.boxes[k].detach(), self.scores[k], boxes, prompts, self.centers)
        assigned = torch.nonzero(owner >= 0)[:, 0]
        owner, quality = owner[assigned], quality[assigned]
        self.target_scores[k, prompts[owner], assigned] = quality
        self.weight[k, prompts[owner], assigned] = 1.0
        self.box_loss = self.box_loss + ((1 - ciou(self.boxes[k, assigned], boxes[owner])) * quality).sum()
        self.total = self.total + quality.sum()
        return assigned, owner, quality

    def sums(self) -> tuple[Tensor, Tensor, Tensor]:
        """Summed box and class loss, and the quality of all assigned anchors to divide them by."""
        class_loss = functional.binary_cross_entropy_with_logits(
            self.logits, self.target_scores, self.weight, reduction="sum"
        )
        return self.box_loss, class_loss, torch.clamp(self.total, min=1.0)


def losses(
    outputs: tuple[Tensor, Tensor, Tensor], targets: DetectionTargets, height: int, width: int
) -> dict[str, Tensor]:
    """Weighted losses by name, each a mean per sample."""
    distances, logits, dense = (part.float() for part in outputs)
    anchor_losses = AnchorLosses(distances, logits, height, width)
    for k, (boxes, prompts, counts) in enumerate(zip(targets.boxes, targets.prompts, targets.counts, strict=True)):
        _ignore_anchors(anchor_losses.weight[k], boxes[~counts], prompts[~counts], anchor_losses.centers)
        anchor_losses.add(k, boxes[counts], prompts[counts])
    box, word, total = anchor_losses.sums()
    return {
        "box": BOX_WEIGHT * box / total,
        "class": CLASS_WEIGHT * word / total,
        "dense": DENSE_WEIGHT * _dense_loss(dense, targets.cells),
        "tag": TAG_WEIGHT * tag_loss(torch.logsumexp(dense, dim=2), targets.tags),
    }


def assign_anchors(
    predicted_boxes: Tensor, scores: Tensor, boxes: Tensor, prompts: Tensor, centers: Tensor
) -> tuple[Tensor, Tensor]:
    """The box assigned to each anchor (A,), -1 for none, and the target score (A,).

    predicted_boxes: (A, 4) px; scores: (N, A); boxes: (M, 4); prompts: (M,); centres: (A, 2).
    """
    overlap = iou(boxes, predicted_boxes)  # (M, A)
    inside = (centers[None] > boxes[:, None, :2]).all(-1) & (centers[None] < boxes[:, None, 2:]).all(-1)
    # an object smaller than a cell may contain no centre: the nearest anchors are used
    off = torch.cdist((boxes[:, :2] + boxes[:, 2:]) / 2, centers)
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


def _ignore_anchors(weight: Tensor, boxes: Tensor, prompts: Tensor, centers: Tensor) -> None:
    """Anchors inside an object that is too small or cut off get no loss for its word."""
    for box, prompt in zip(boxes, prompts, strict=True):
        inside = ((centers > box[:2] - 8) & (centers < box[2:] + 8)).all(-1)
        weight[prompt, inside] = 0.0


def _dense_loss(dense: Tensor, cells: Tensor) -> Tensor:
    target = torch.zeros_like(dense)
    shown = cells >= 0
    image, cell = torch.nonzero(shown, as_tuple=True)
    target[image, cells[shown], cell] = 1.0
    loss = functional.binary_cross_entropy_with_logits(dense, target, reduction="none")
    miss = torch.abs(target - torch.sigmoid(dense.detach()))
    return (loss * miss**1.5).sum() / max(len(image), 1)


def tag_loss(logits: Tensor, tags: Tensor) -> Tensor:
    """Cross entropy of the tags (B, N) that are known, a mean per sample."""
    known = ~torch.isnan(tags)
    loss = functional.binary_cross_entropy_with_logits(logits, torch.nan_to_num(tags), reduction="none")
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
