"""Trains the tagger: a trained ObjectNetwork tuned to whole, squashed images."""

from __future__ import annotations

import copy
from pathlib import Path

import torch
from torch import Tensor

from placegraph.models_onnx.text_encoder import TextEncoder
from placegraph.tools.simulator.object_classes import NAMES
from placegraph.tools.training import training_loop as loop
from placegraph.tools.training.data_augmentation import Augmentation, batches, load_shards
from placegraph.tools.training.detection_losses import tag_loss, tag_targets
from placegraph.tools.training.detector_training import COMMON, image_batch
from placegraph.tools.training.networks import ObjectNetwork, TaggerNetwork

SIZE = 448  # px, square: images are squashed, as RAM++ does
BATCH = 16
RATE = 3e-4


def train_tagger(
    data: Path, objects: ObjectNetwork, checkpoint: Path, steps: int, seed: int = 3, threads: int = 2
) -> TaggerNetwork:
    """Trains on the shards of `data`, resuming from `checkpoint`; returns the averaged network."""
    torch.manual_seed(seed)
    torch.set_num_threads(threads)
    text = torch.from_numpy(TextEncoder().encode(NAMES))
    network = TaggerNetwork(copy.deepcopy(objects), text).to(memory_format=torch.channels_last)
    stream = batches(
        Augmentation(load_shards(data), SIZE, SIZE, seed, squash=True, common=COMMON, with_depth=False), BATCH
    )

    def step(i: int) -> dict[str, Tensor]:
        samples = next(stream)
        normal = (image_batch(samples) - network.mean) / network.std
        with torch.autocast("cpu", dtype=torch.bfloat16):
            logits = network(normal).float()
        return {"tag": tag_loss(logits, tag_targets(samples))}

    return loop.fit(network, step, steps=steps, rate=RATE, checkpoint=checkpoint)
