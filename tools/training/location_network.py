"""The location network in PyTorch and its losses.

Source: the head of YOLOv8-seg (boxes, class, mask coefficients over shared prototypes) on a backbone of the same blocks
as the other embedded networks; assignment as in detection_losses.py; masks by cross entropy in the box and dice.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.nn import functional

from placegraph.tools.training.detection_losses import assign_anchors, ciou
from placegraph.tools.training.networks import Conv, Csp, PooledPyramid, anchors

PROTOTYPES = 32  # as in the YOLO-seg layout
WIDTHS = (64, 80, 96)  # of the features at strides 8, 16, 32
BOX_WEIGHT, CLASS_WEIGHT, MASK_WEIGHT, DICE_WEIGHT = 2.5, 1.0, 1.5, 1.5
MAX_MASKS = 64  # anchors per batch with a mask loss; bounds the time of a step


class LocationNetwork(nn.Module):
    """Bird's-eye image (B, 3, H, W), 0..1, to boxes and masks of locations.

    Outputs raw distances (B, 4, A), logits (B, 1, A), coefficients (B, 32, A) and prototypes (B, 32, H / 4, W / 4).
    """

    def __init__(self) -> None:
        super().__init__()
        self.to4 = nn.Sequential(Conv(3, 16, 3, 2), Conv(16, 32, 3, 2), Csp(32, 32, 1))
        self.to8 = nn.Sequential(Conv(32, 64, 3, 2), Csp(64, 64, 2))
        self.to16 = nn.Sequential(Conv(64, 96, 3, 2), Csp(96, 96, 2))
        self.to32 = nn.Sequential(Conv(96, 128, 3, 2), Csp(128, 128, 1), PooledPyramid(128))
        self.down16 = Csp(128 + 96, 80, 1)
        self.down8 = Csp(80 + 64, 64, 1)
        self.up16 = Conv(64, 64, 3, 2)
        self.join16 = Csp(64 + 80, 80, 1)
        self.up32 = Conv(80, 80, 3, 2)
        self.join32 = Csp(80 + 128, 96, 1)
        self.prototypes = nn.Sequential(Conv(64 + 32, 48), nn.Conv2d(48, PROTOTYPES, 1))
        self.heads = nn.ModuleList(
            nn.Sequential(Conv(c, 64), Conv(64, 64), nn.Conv2d(64, 5 + PROTOTYPES, 1)) for c in WIDTHS
        )
        for head in self.heads:
            nn.init.constant_(head[-1].bias[4:5], -4.0)  # type: ignore[index]  # most cells hold no location

    def forward(self, image: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """See the class."""
        c4 = self.to4(image)
        c8 = self.to8(c4)
        c16 = self.to16(c8)
        c32 = self.to32(c16)
        p16 = self.down16(torch.cat((_upsample(c32), c16), 1))
        p8 = self.down8(torch.cat((_upsample(p16), c8), 1))
        n16 = self.join16(torch.cat((self.up16(p8), p16), 1))
        n32 = self.join32(torch.cat((self.up32(n16), c32), 1))
        prototypes = self.prototypes(torch.cat((_upsample(p8), c4), 1))
        raw = torch.cat([head(f).flatten(2) for head, f in zip(self.heads, (p8, n16, n32), strict=True)], 2)
        return raw[:, :4], raw[:, 4:5], raw[:, 5:], prototypes


class LocationExport(nn.Module):
    """LocationNetwork in the YOLO-seg export layout, for one input size."""

    def __init__(self, network: LocationNetwork, size_px: int) -> None:
        super().__init__()
        self.network = network
        centres, strides = anchors(size_px, size_px)
        self.register_buffer("centres", centres.T.contiguous()[None])
        self.register_buffer("strides", strides[None, None])

    def forward(self, image: Tensor) -> tuple[Tensor, Tensor]:
        """(1, 3, S, S) to (1, 4 + 1 + 32, A), cx cy w h in px, probability, coefficients; and (1, 32, S / 4, S / 4)."""
        distances, logits, coefficients, prototypes = self.network(image)
        reach = functional.softplus(distances) * self.strides
        low, high = self.centres - reach[:, :2], self.centres + reach[:, 2:]
        boxes = torch.cat(((low + high) / 2, high - low), 1)
        return torch.cat((boxes, torch.sigmoid(logits), coefficients), 1), prototypes


@dataclass(frozen=True, eq=False)
class LocationTargets:
    """Targets of one image: boxes (M, 4) px, and masks (M, S / 4, S / 4) 0..1."""

    boxes: Tensor
    masks: Tensor


def losses(
    outputs: tuple[Tensor, Tensor, Tensor, Tensor], shown: list[LocationTargets], size_px: int
) -> dict[str, Tensor]:
    """Weighted losses by name."""
    distances, logits, coefficients, prototypes = (part.float() for part in outputs)
    centres, strides = anchors(size_px, size_px)
    reach = functional.softplus(distances) * strides
    predicted_boxes = torch.cat((centres.T - reach[:, :2], centres.T + reach[:, 2:]), 1).transpose(1, 2)  # (B, A, 4)
    scores = torch.sigmoid(logits).transpose(1, 2)
    target_scores = torch.zeros_like(scores)
    box_loss, total = torch.zeros(()), torch.zeros(())
    mask_losses: list[Tensor] = []
    for k, image_targets in enumerate(shown):
        if not len(image_targets.boxes):
            continue
        none = torch.zeros(len(image_targets.boxes), dtype=torch.long)
        owner, quality = assign_anchors(
            predicted_boxes[k].detach(), scores[k].detach().T, image_targets.boxes, none, centres
        )
        assigned = torch.nonzero(owner >= 0)[:, 0]
        if not len(assigned):
            continue
        target_scores[k, assigned, 0] = quality[assigned]
        box_loss = (
            box_loss
            + ((1 - ciou(predicted_boxes[k, assigned], image_targets.boxes[owner[assigned]])) * quality[assigned]).sum()
        )
        total = total + quality[assigned].sum()
        best = assigned[torch.argsort(-quality[assigned], stable=True)[: MAX_MASKS // len(shown) + 1]]
        mask_losses.append(
            _mask_losses(
                coefficients[k][:, best].T,
                prototypes[k],
                image_targets.masks[owner[best]],
                image_targets.boxes[owner[best]],
            )
        )
    total = torch.clamp(total, min=1.0)
    class_loss = functional.binary_cross_entropy_with_logits(logits.transpose(1, 2), target_scores, reduction="sum")
    entropy, dice = torch.cat(mask_losses, 1).mean(1) if mask_losses else torch.zeros(2)
    return {
        "box": BOX_WEIGHT * box_loss / total,
        "class": CLASS_WEIGHT * class_loss / total,
        "mask": MASK_WEIGHT * entropy,
        "dice": DICE_WEIGHT * dice,
    }


def _mask_losses(coefficients: Tensor, prototypes: Tensor, masks: Tensor, boxes: Tensor) -> Tensor:
    """(2, K) cross entropy and dice of K anchors' masks, within a margin around their boxes (K, 4) px."""
    logits = torch.tensordot(coefficients, prototypes, dims=1)  # (K, h, w)
    line = torch.arange(masks.shape[-1]) + 0.5
    low, high = boxes[:, :2, None] / 4 - 2, boxes[:, 2:, None] / 4 + 2  # predicted boxes are not exact
    within = (line > low) & (line < high)  # (K, 2, S / 4)
    inside = (within[:, 1, :, None] & within[:, 0, None, :]).float()
    entropy = functional.binary_cross_entropy_with_logits(logits, masks, reduction="none")
    share = torch.sigmoid(logits) * inside
    dice = 1 - (2 * (share * masks).sum((1, 2)) + 1) / (share.sum((1, 2)) + masks.sum((1, 2)) + 1)
    return torch.stack(((entropy * inside).sum((1, 2)) / inside.sum((1, 2)), dice))


def _upsample(x: Tensor) -> Tensor:
    return functional.interpolate(x, scale_factor=2.0, mode="nearest")
