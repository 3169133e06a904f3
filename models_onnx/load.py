"""A network by name: find its weights, build its family."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from placegraph.models_onnx.manifest import find_weights
from placegraph.runtime.errors import ConfigError
from placegraph.runtime.node import plugin


def load(name: str, model_dirs: Sequence[Path | str] = (), threads: int = 1) -> object:
    """Build the network `name`, an instance of its family; callers check which task interfaces it implements.

    Raises:
        ModelError: its weights are absent, damaged, or not of the family's layout.
        ConfigError: the manifest names a family that does not exist.
    """
    weights = find_weights(name, model_dirs)
    network: object = plugin("placegraph.models_onnx", weights.family, "FAMILY", "model family")(weights, threads)
    return network


def wrong_task(node: str, name: str, model: object, task: str) -> ConfigError:
    """The error of a node that was given a network for another task; `task` completes "which cannot ..."."""
    family = type(model).__module__.rpartition(".")[2]
    return ConfigError(f"[nodes.{node}] model: {name!r} is of family {family!r}, which cannot {task}")
