"""The training loop: AdamW, warm-up and cosine schedule, averaged weights, checkpoints."""

from __future__ import annotations

import copy
import math
import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import torch
from torch import Tensor, nn

from placegraph.runtime.errors import ConfigError

Network = TypeVar("Network", bound=nn.Module)

AVERAGE = 0.9995  # of the averaged weights, reached slowly
REPORT_EVERY = 50  # steps


def fit(
    network: nn.Module,
    step: Callable[[int], dict[str, Tensor]],
    *,
    steps: int,
    rate: float,
    checkpoint: Path,
    weight_decay: float = 0.02,
    warm_up: int = 200,
    clip: float = 10.0,
    save_every: int = 250,
    at_save: Callable[[int, nn.Module], None] | None = None,
) -> Any:
    """Trains to `steps`, resuming from `checkpoint`; returns the network of averaged weights.

    step(i) computes the losses of step i, in bfloat16 where that is safe; equal seeds and data give equal results.
    clip: largest norm of the gradient. at_save(steps done, network of averaged weights) is called after each
    checkpoint.
    """
    optimizer = torch.optim.AdamW(_parameter_groups(network, weight_decay), lr=rate, betas=(0.9, 0.99))
    average = copy.deepcopy(network).eval()
    done = _resume(checkpoint, network, average, optimizer)
    network.train()
    last_report = time.monotonic()
    mean: dict[str, float] = {}
    for i in range(done, steps):
        share = min((i + 1) / warm_up, 0.5 * (1 + math.cos(math.pi * i / steps)) * 0.98 + 0.02)
        for group in optimizer.param_groups:
            group["lr"] = rate * share
        parts = step(i)
        loss = sum(parts.values(), torch.zeros(()))
        optimizer.zero_grad(set_to_none=True)
        loss.backward()
        nn.utils.clip_grad_norm_(network.parameters(), clip)
        optimizer.step()
        _update_average(average, network, min(AVERAGE, (i + 1) / (i + 20)))
        for name, value in parts.items():
            mean[name] = 0.98 * mean.get(name, float(value.detach())) + 0.02 * float(value.detach())
        if (i + 1) % REPORT_EVERY == 0:
            pace = (time.monotonic() - last_report) / REPORT_EVERY
            last_report = time.monotonic()
            listed = " ".join(f"{name} {value:.3f}" for name, value in mean.items())
            print(f"step {i + 1} of {steps}: {listed}; {pace:.2f} s a step", flush=True)
        if (i + 1) % save_every == 0 or i + 1 == steps:
            _save(checkpoint, i + 1, network, average, optimizer)
            if at_save is not None:
                at_save(i + 1, average)
    return average.eval()


def read_average(checkpoint: Path, network: Network) -> Network:
    """Loads the averaged weights of a checkpoint into a network of the same kind; raises ConfigError when absent."""
    if not checkpoint.exists():
        raise ConfigError(f"{checkpoint}: not there; an earlier step of `placegraph train` writes it")
    network.load_state_dict(torch.load(checkpoint, weights_only=True)["average"])
    return network.eval()


def _parameter_groups(network: nn.Module, decay: float) -> list[dict[str, Any]]:
    """Weight decay applies to weights, not to biases, norms and scales."""
    shrink = [p for p in network.parameters() if p.requires_grad and p.ndim > 1]
    keep = [p for p in network.parameters() if p.requires_grad and p.ndim <= 1]
    return [{"params": shrink, "weight_decay": decay}, {"params": keep, "weight_decay": 0.0}]


@torch.no_grad()
def _update_average(average: nn.Module, network: nn.Module, share: float) -> None:
    for mean, now in zip(average.state_dict().values(), network.state_dict().values(), strict=True):
        if mean.dtype.is_floating_point:
            mean.mul_(share).add_(now, alpha=1 - share)
        else:
            mean.copy_(now)


def _save(
    checkpoint: Path, done: int, network: nn.Module, average: nn.Module, optimizer: torch.optim.Optimizer
) -> None:
    checkpoint.parent.mkdir(parents=True, exist_ok=True)
    partial = checkpoint.with_suffix(".part")
    state = {
        "done": done,
        "network": network.state_dict(),
        "average": average.state_dict(),
        "optimizer": optimizer.state_dict(),
    }
    torch.save(state, partial)
    os.replace(partial, checkpoint)


def _resume(checkpoint: Path, network: nn.Module, average: nn.Module, optimizer: torch.optim.Optimizer) -> int:
    if not checkpoint.exists():
        return 0
    state = torch.load(checkpoint, weights_only=True)
    network.load_state_dict(state["network"])
    average.load_state_dict(state["average"])
    optimizer.load_state_dict(state["optimizer"])
    return int(state["done"])
