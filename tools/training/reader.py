"""Train the adapter that makes the packaged language model read requests into programs; on generated requests only.

Source: METHOD section 10 (rank 16 on all linear layers, sentences written by a program).
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import torch
from torch import Tensor, nn
from torch.nn import functional

from placegraph.nodes.grounding.llm_parser import OPENING, model_input, model_output
from placegraph.runtime.errors import ConfigError
from placegraph.runtime.language.language_model import LanguageModel, default_model_path
from placegraph.tools.training.adapter import write_adapter
from placegraph.tools.training.language import Example, examples
from placegraph.tools.training.loop import fit
from placegraph.tools.training.reader_network import ReaderNetwork

BATCH = 16  # sentences a step: the most of them in an hour of two cores, see README
RATE = 1e-3  # of AdamW, at its highest
WARM_UP = 50  # steps
CLIP = 1.0  # most norm of the gradient
SAVE_EVERY = 200  # steps
VALIDATION = 100  # held-out requests that each checkpoint is tried on
VALIDATION_SEED = 1_000_003  # no training run has it


class Sentences:
    """Requests with their replies as tokens, and where among them the replies are predicted."""

    def __init__(self, model: LanguageModel, requests: Sequence[Example]) -> None:
        self.tokens: list[list[int]] = []
        self.targets: list[list[int]] = []
        for request in requests:
            target = model.encode_reply(model_output(request.program))
            self.tokens.append(model.encode(model_input(request.text), OPENING) + target[:-1])
            self.targets.append(target)

    def logits(self, network: nn.Module) -> tuple[Tensor, Tensor]:
        """Logits (M, vocabulary) of all tokens of the replies, and those tokens (M,)."""
        wanted, end = [], 0
        for tokens, target in zip(self.tokens, self.targets, strict=True):
            end += len(tokens)
            wanted.append(torch.arange(end - len(target), end))
        logits: Tensor = network(self.tokens, torch.cat(wanted))
        return logits, torch.tensor([token for target in self.targets for token in target])


def train_reader(
    out: Path, steps: int, *, model_path: Path | None = None, seed: int = 0, batch: int = BATCH, threads: int = 2
) -> None:
    """Train to `steps` and write the adapter to `out`, which is there from the first checkpoint on.

    model_path: a GGUF of the family llama; None for the packaged model. Goes on from the checkpoint beside `out` where
    there is one. Raises ConfigError for an unusable seed or file name and ModelError for an unusable model.
    """
    if seed == VALIDATION_SEED:
        raise ConfigError(f"--seed: {seed} is set aside for validation")
    if out.suffix != ".gguf":
        raise ConfigError(f"--out {out}: a name that ends in .gguf expected")
    out.parent.mkdir(parents=True, exist_ok=True)
    torch.set_num_threads(threads)
    torch.manual_seed(seed)
    model = LanguageModel(model_path)
    model.load()
    network = ReaderNetwork(model_path or default_model_path())
    held_out = examples(VALIDATION_SEED, 0, VALIDATION, held_out=True)

    def step(i: int) -> dict[str, Tensor]:
        logits, targets = Sentences(model, examples(seed, i * batch, batch)).logits(network)
        return {"loss": functional.cross_entropy(logits, targets)}

    def at_save(done: int, average: nn.Module) -> None:
        card = {
            "name": "placegraph reader",
            "description": f"reads requests into programs; {done} of {steps} steps of {batch}, seed {seed}",
            "license": "apache-2.0",
        }
        write_adapter(average, out, card)
        right = sum(exact(model, average, held_out[i : i + batch]) for i in range(0, VALIDATION, batch))
        print(f"step {done}: {right} of {VALIDATION} held-out requests read exactly; {out}", flush=True)

    checkpoint = out.with_suffix(".pt")
    fit(
        network, step, steps=steps, rate=RATE, checkpoint=checkpoint, warm_up=WARM_UP, clip=CLIP,
        save_every=SAVE_EVERY, at_save=at_save,
    )  # fmt: skip
    model.close()


@torch.no_grad()
def exact(model: LanguageModel, network: nn.Module, requests: Sequence[Example]) -> int:
    """How many requests get their very reply token by token; greedy decoding writes just these, for it is what follows.

    A program with its conditions in another order counts as wrong here, and no grammar helps.
    """
    sentences = Sentences(model, requests)
    logits, targets = sentences.logits(network)
    hits = (logits.argmax(1) == targets).split([len(target) for target in sentences.targets])
    return sum(bool(hit.all()) for hit in hits)
