"""Trains the segmenter: image and depth are encoded once per frame, then a mask is decoded for each box."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional

from placegraph.tools.training import training_loop as loop
from placegraph.tools.training.data_augmentation import Augmentation, TrainingSample, batches, load_shards
from placegraph.tools.training.detector_training import image_batch
from placegraph.tools.training.mask_networks import MaskDecoder, MaskEncoder

SIZE = (320, 416)  # height, width in px
BATCH = 4
BOXES = 8  # per image and step
RATE = 2e-3
BOX_JITTER = 0.06  # sigma of each side by the box's size: a detector's boxes are not exact
NO_DEPTH = 0.1  # share of images shown without depth: a camera may have none


class MaskNetwork(nn.Module):
    """Encoder and decoder together, as they are trained."""

    def __init__(self) -> None:
        super().__init__()
        self.encoder, self.decoder = MaskEncoder(), MaskDecoder()

    def forward(self, image: Tensor, depth: Tensor, boxes: list[Tensor]) -> tuple[Tensor, Tensor]:
        """Images, depths and the boxes (M, 4) of each as shares: logits and predicted IoU of all boxes in order."""
        embedding = self.encoder(image, depth).float()
        cells = [self.decoder.sample(embedding[k : k + 1], asked) for k, asked in enumerate(boxes)]
        masks: tuple[Tensor, Tensor] = self.decoder.decode(torch.cat(cells))
        return masks


@dataclass(frozen=True, eq=False)
class BoxPrompts:
    """Boxes of a batch: (M, 4) as shares of each image, and the true masks (N, 1, G, G) on their grids."""

    boxes: list[Tensor]
    masks: Tensor


def draw_box_prompts(
    samples: list[TrainingSample], line: np.ndarray[tuple[int], np.dtype[np.float32]], random: np.random.Generator
) -> BoxPrompts:
    """Draws boxes of objects that count, slightly inexact; line (G,) are the grid's positions relative to the box."""
    boxes, masks = [], []
    for sample in samples:
        height, width = sample.instance.shape
        chosen = random.permutation(np.flatnonzero(sample.counts))[:BOXES]
        size = sample.boxes[chosen, 2:] - sample.boxes[chosen, :2]
        off = random.normal(0, BOX_JITTER, (len(chosen), 4)) * (random.random((len(chosen), 1)) < 0.7)
        asked = sample.boxes[chosen] + off * np.concatenate((size, size), 1)
        asked = np.clip(asked, 0, [width, height, width, height]).astype(np.float32)
        asked[:, :2] = np.minimum(asked[:, :2], np.array([width, height]) - 2)
        asked[:, 2:] = np.maximum(asked[:, 2:], asked[:, :2] + 2)
        for box, item in zip(asked, sample.ids[chosen], strict=True):
            xs = np.clip(np.floor(box[0] + (box[2] - box[0]) * line), 0, width - 1).astype(int)
            ys = np.clip(np.floor(box[1] + (box[3] - box[1]) * line), 0, height - 1).astype(int)
            masks.append(sample.instance[np.ix_(ys, xs)] == item + 1)
        boxes.append(torch.from_numpy(asked / np.array([width, height, width, height], np.float32)))
    side = len(line)
    stacked = np.stack(masks) if masks else np.zeros((0, side, side), bool)
    return BoxPrompts(boxes, torch.from_numpy(stacked[:, None].astype(np.float32)))


def mask_losses(logits: Tensor, quality: Tensor, masks: Tensor, inside: Tensor) -> dict[str, Tensor]:
    """Cross entropy and dice of the masks, and the error of the predicted IoU. inside: (G, G), 1 within the box."""
    logits, quality = logits.float(), quality.float()
    entropy = functional.binary_cross_entropy_with_logits(logits, masks)
    share = torch.sigmoid(logits) * inside
    both = (share * masks).sum((1, 2, 3))
    dice = 1 - (2 * both + 1) / (share.sum((1, 2, 3)) + (masks * inside).sum((1, 2, 3)) + 1)
    with torch.no_grad():
        hit, true = (logits > 0) * inside, masks * inside
        true_iou = (hit * true).sum((1, 2, 3)) / ((hit + true) > 0).sum((1, 2, 3)).clamp(min=1)
    return {"entropy": entropy, "dice": dice.mean(), "quality": functional.l1_loss(quality[:, 0], true_iou) * 0.2}


def train_masks(data: Path, checkpoint: Path, steps: int, seed: int = 2, threads: int = 2) -> MaskNetwork:
    """Trains on the shards of `data`, resuming from `checkpoint`; returns the averaged network."""
    torch.manual_seed(seed)
    torch.set_num_threads(threads)
    network = MaskNetwork().to(memory_format=torch.channels_last)
    stream = batches(Augmentation(load_shards(data), *SIZE, seed), BATCH)
    random = np.random.default_rng(seed)
    line = network.decoder.line.numpy()
    within = ((line >= 0) & (line <= 1)).astype(np.float32)
    inside = torch.from_numpy(within[:, None] * within[None])

    def step(i: int) -> dict[str, Tensor]:
        samples = next(stream)
        asked = draw_box_prompts(samples, line, random)
        while not len(asked.masks):
            samples = next(stream)
            asked = draw_box_prompts(samples, line, random)
        depth = np.stack([s.depth for s in samples])[:, None] * (random.random((len(samples), 1, 1, 1)) > NO_DEPTH)
        with torch.autocast("cpu", dtype=torch.bfloat16):
            logits, quality = network(image_batch(samples), torch.from_numpy(depth.astype(np.float32)), asked.boxes)
        return mask_losses(logits, quality, asked.masks, inside)

    return loop.fit(network, step, steps=steps, rate=RATE, checkpoint=checkpoint)
