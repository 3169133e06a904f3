"""Trains the ObjectNetwork: detector and dense head together, with words drawn for each batch."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from placegraph.models_onnx.text_encoder import TextEncoder
from placegraph.tools.simulator.object_classes import CLASSES
from placegraph.tools.training import training_loop as loop
from placegraph.tools.training.batch_norm_folding import fold_batch_norm
from placegraph.tools.training.data_augmentation import Augmentation, TrainingSample, batches, load_shards
from placegraph.tools.training.detection_losses import detection_targets, losses
from placegraph.tools.training.networks import ObjectNetwork
from placegraph.tools.training.word_projection import OTHER_WORDS

# height and width in px of most steps, which are cheaper, and of the last ones; the network runs at the last size
FIRST_SIZES = (256, 320), (320, 416)
SIZES = (384, 512), (480, 640)
SMALL_SHARE = 0.8  # of all steps
BATCH = 16
COMMON = 0.1  # classes that a smaller share of views show (a toilet: .02) are shown more often
FIRST_RATE, RATE = 1.5e-3, 8e-4
TEXT_NOISE = (
    0.03  # sigma added to each number of a word's vector (unit length, 256 numbers): words nearby mean the same
)
OTHERS = 10  # of the words of things never shown, in a batch


class Prompts:
    """Words for a batch: one training word of each class, then words of things that are never shown."""

    def __init__(self, seed: int) -> None:
        encoder = TextEncoder()
        self._said = [encoder.encode(object_class.training_words) for object_class in CLASSES]
        self._others = encoder.encode(OTHER_WORDS)
        self._random = np.random.default_rng(seed)

    def draw(self) -> Tensor:
        """(classes + OTHERS, 256) unit rows."""
        random = self._random
        # the class name in half of the draws, because the tagger uses it
        rows = [words[0 if random.random() < 0.5 else random.integers(len(words))] for words in self._said]
        rows += list(self._others[random.permutation(len(self._others))[:OTHERS]])
        text = np.stack(rows) + random.normal(0, TEXT_NOISE, (len(rows), rows[0].shape[0]))
        text /= np.linalg.norm(text, axis=1, keepdims=True)
        return torch.from_numpy(text.astype(np.float32))


def image_batch(samples: list[TrainingSample]) -> Tensor:
    """(B, 3, H, W) in 0..1, channels last."""
    stacked = np.stack([sample.color for sample in samples])
    return torch.from_numpy(stacked).permute(0, 3, 1, 2).float().div_(255)


def read_refined(checkpoint: Path) -> ObjectNetwork:
    """The averaged network that refining left in `checkpoint`."""
    return loop.read_average(checkpoint, fold_batch_norm(ObjectNetwork()))


def train_objects(
    data: Path, checkpoint: Path, steps: int, start: ObjectNetwork | None = None, seed: int = 1, threads: int = 2
) -> ObjectNetwork:
    """Trains on the shards of `data`, resuming from `checkpoint`; returns the averaged network.

    start: a folded network that is refined on larger images; None trains from scratch.
    """
    torch.manual_seed(seed)
    torch.set_num_threads(threads)
    network = (start or ObjectNetwork()).to(memory_format=torch.channels_last)  # type: ignore[call-overload]
    sizes, rate = (SIZES, RATE) if start else (FIRST_SIZES, FIRST_RATE)
    shards = load_shards(data)
    prompts = Prompts(seed)
    augments = [Augmentation(shards, *size, seed + sum(size), common=COMMON, with_depth=False) for size in sizes]
    streams = [batches(augment, BATCH) for augment in augments]

    def step(i: int) -> dict[str, Tensor]:
        large = i >= SMALL_SHARE * steps
        samples = next(streams[large])
        text = prompts.draw()
        with torch.autocast("cpu", dtype=torch.bfloat16):
            outputs = network(image_batch(samples), text.expand(len(samples), -1, -1))
        return losses(outputs, detection_targets(samples, len(text)), *sizes[large])

    return loop.fit(network, step, steps=steps, rate=rate, checkpoint=checkpoint)
