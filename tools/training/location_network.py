"""The location network in PyTorch and its losses.

Source: the head of YOLOv8-seg (boxes, class, mask coefficients over shared prototypes) on a backbone of the same blocks
as the other embedded networks; assignment as in detection_losses.py; masks by cross entropy in the box and dice.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.nn import functional

from placegraph.tools.training.detection_losses import AnchorLosses
from placegraph.tools.training.networks import Backbone, BoxExport, Conv, upsample

PROTOTYPES = 32  # as in the YOLO-seg layout
BOX_WEIGHT, CLASS_WEIGHT, MASK_WEIGHT, DICE_WEIGHT = 2.5, 1.0, 1.5, 1.5
MAX_MASKS = 64  # anchors per batch with a mask loss; bounds the time of a step


class LocationNetwork(Backbone):
    """Bird's-eye image (B, 3, H, W), 0..1, to boxes and masks of locations.

    Outputs raw distances (B, 4, A), logits (B, 1, A), coefficients (B, 32, A) and prototypes (B, 32, H / 4, W / 4).
    """

    WIDTHS = (64, 80, 96)

    def __init__(self) -> None:
        super().__init__(96, 128, (2, 1, 1))
        self.prototypes = nn.Sequential(Conv(64 + 32, 48), nn.Conv2d(48, PROTOTYPES, 1))
        self.heads = nn.ModuleList(
            nn.Sequential(Conv(c, 64), Conv(64, 64), nn.Conv2d(64, 5 + PROTOTYPES, 1)) for c in self.WIDTHS
        )
        for head in self.heads:
            nn.init.constant_(head[-1].bias[4:5], -4.0)  # type: ignore[index]  # most cells hold no location

    def forward(self, image: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """See the class."""
        c4, features = self.features(image)
        prototypes = self.prototypes(torch.cat((upsample(features[0]), c4), 1))
        raw = torch.cat([head(f).flatten(2) for head, f in zip(self.heads, features, strict=True)], 2)
        return raw[:, :4], raw[:, 4:5], raw[:, 5:], prototypes


class LocationExport(BoxExport):
    """LocationNetwork in the YOLO-seg export layout, for one input size."""

    def forward(self, image: Tensor) -> tuple[Tensor, Tensor]:
        """(1, 3, S, S) to (1, 4 + 1 + 32, A), cx cy w h in px, probability, coefficients; and (1, 32, S / 4, S / 4)."""
        distances, logits, coefficients, prototypes = self.network(image)
        return torch.cat((self.decode(distances), torch.sigmoid(logits), coefficients), 1), prototypes


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
    anchor_losses = AnchorLosses(distances, logits, size_px, size_px)
    mask_losses: list[Tensor] = []
    for k, image_targets in enumerate(shown):
        none = torch.zeros(len(image_targets.boxes), dtype=torch.long)
        assigned, owner, quality = anchor_losses.add(k, image_targets.boxes, none)
        if len(assigned):
            best = torch.argsort(-quality, stable=True)[: MAX_MASKS // len(shown) + 1]
            masks, boxes = image_targets.masks[owner[best]], image_targets.boxes[owner[best]]
            mask_losses.append(_mask_losses(coefficients[k][:, assigned[best]].T, prototypes[k], masks, boxes))
    box, word, total = anchor_losses.sums()
    entropy, dice = torch.cat(mask_losses, 1).mean(1) if mask_losses else torch.zeros(2)
    return {
        "box": BOX_WEIGHT * box / total,
        "class": CLASS_WEIGHT * word / total,
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
