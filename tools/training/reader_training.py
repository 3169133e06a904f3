"""Trains the adapter with which the packaged language model reads requests into programs, on generated requests.

Source: LoRA of rank 16 on all linear layers, with sentences from a grammar (docs/method.md).
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
from placegraph.tools.training.lora_export import write_adapter
from placegraph.tools.training.reader_network import ReaderNetwork
from placegraph.tools.training.request_grammar import Example, examples
from placegraph.tools.training.training_loop import fit

BATCH = 16  # sentences per step; best use of an hour on two cores
RATE = 1e-3  # of AdamW, at its highest
WARM_UP = 50  # steps
CLIP = 1.0  # largest norm of the gradient
SAVE_EVERY = 200  # steps
VALIDATION = 100  # held-out requests that each checkpoint is tried on
VALIDATION_SEED = 1_000_003  # no training run has it


class TokenBatch:
    """Requests with their replies as tokens, and the positions at which the replies are predicted."""

    def __init__(self, model: LanguageModel, requests: Sequence[Example]) -> None:
        self.tokens: list[list[int]] = []
        self.targets: list[list[int]] = []
        for request in requests:
            target = model.tokenize_completion(model_output(request.program))
            self.tokens.append(model.tokenize_prompt(model_input(request.text), OPENING) + target[:-1])
            self.targets.append(target)

    def logits(self, network: nn.Module) -> tuple[Tensor, Tensor]:
        """Logits (M, vocabulary) of all tokens of the replies, and those tokens (M,)."""
        predicted_at, end = [], 0
        for tokens, target in zip(self.tokens, self.targets, strict=True):
            end += len(tokens)
            predicted_at.append(torch.arange(end - len(target), end))
        logits: Tensor = network(self.tokens, torch.cat(predicted_at))
        return logits, torch.tensor([token for target in self.targets for token in target])


def train_reader(
    out: Path, steps: int, *, model_path: Path | None = None, seed: int = 0, batch: int = BATCH, threads: int = 2
) -> None:
    """Trains to `steps` and writes the adapter to `out`, which exists from the first checkpoint on.

    model_path: a GGUF of the llama family; None for the packaged model. Resumes from the checkpoint beside `out`.
    Raises ConfigError for an unusable seed or file name and ModelError for an unusable model.
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
        logits, targets = TokenBatch(model, examples(seed, i * batch, batch)).logits(network)
        return {"loss": functional.cross_entropy(logits, targets)}

    def at_save(done: int, average: nn.Module) -> None:
        card = {
            "name": "placegraph reader",
            "description": f"reads requests into programs; {done} of {steps} steps of {batch}, seed {seed}",
            "license": "apache-2.0",
        }
        write_adapter(average, out, card)
        right = sum(count_exact(model, average, held_out[i : i + batch]) for i in range(0, VALIDATION, batch))
        print(f"step {done}: {right} of {VALIDATION} held-out requests read exactly; {out}", flush=True)

    checkpoint = out.with_suffix(".pt")
    fit(
        network, step, steps=steps, rate=RATE, checkpoint=checkpoint, warm_up=WARM_UP, clip=CLIP,
        save_every=SAVE_EVERY, at_save=at_save,
    )  # fmt: skip
    model.close()


@torch.no_grad()
def count_exact(model: LanguageModel, network: nn.Module, requests: Sequence[Example]) -> int:
    """How many requests get exactly their reply, token by token; equals what greedy decoding would write.

    A program with its conditions in another order counts as wrong, and no grammar is applied.
    """
    sentences = TokenBatch(model, requests)
    logits, targets = sentences.logits(network)
    hits = (logits.argmax(1) == targets).split([len(target) for target in sentences.targets])
    return sum(bool(hit.all()) for hit in hits)
