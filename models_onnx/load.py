"""A network by name: find its weights, build its family, check its task."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TypeVar

from placegraph.models_onnx import Detector, InstanceSegmenter, LocationDetector, Segmenter, Tagger
from placegraph.models_onnx.manifest import find_weights
from placegraph.runtime.errors import ConfigError
from placegraph.runtime.node import Context, plugin

T = TypeVar("T")

TASKS: dict[type, str] = {
    Tagger: "tag images",
    Detector: "find boxes",
    Segmenter: "give masks for boxes",
    InstanceSegmenter: "give boxes with masks in one pass",
    LocationDetector: "find locations",
}


def load(name: str, model_dirs: Sequence[Path | str] = (), threads: int = 1) -> object:
    """Build the network `name`, an instance of its family.

    Raises:
        ModelError: its weights are absent, damaged, or not of the family's layout.
        ConfigError: the manifest names a family that does not exist.
    """
    weights = find_weights(name, model_dirs)
    network: object = plugin("placegraph.models_onnx", weights.family, "FAMILY", "model family")(weights, threads)
    return network


def load_for_node(task: type[T], name: str, node: str, context: Context) -> T:
    """The network that a node's setting `model` names; raises as `load`, and ConfigError when it does another task."""
    return require_task(load(name, context.model_dirs, context.threads), task, name, f"[nodes.{node}] model")


def require_task(network: object, task: type[T], name: str, where: str) -> T:
    """The network `name`, checked to implement an interface of TASKS; raises ConfigError that begins with `where`."""
    if not isinstance(network, task):
        family = type(network).__module__.rpartition(".")[2]
        raise ConfigError(f"{where}: {name!r} is of family {family!r}, which cannot {TASKS[task]}")
    return network
