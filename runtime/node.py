"""The contract of a node, and how nodes are found by name."""

from __future__ import annotations

import importlib
import importlib.util
import pkgutil
import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, ClassVar

from pydantic import BaseModel, ConfigDict, ValidationError

from placegraph.runtime.arrays import F64
from placegraph.runtime.errors import ConfigError
from placegraph.runtime.messages import Message
from placegraph.runtime.setting_errors import node_setting_error

NODES = "placegraph.nodes"
EXTRAS = {"depthai": "oak", "embreex": "demo"}  # which extra brings an optional package


class NodeConfig(BaseModel):
    """Base of every node's settings: frozen, strict, unknown keys refused."""

    model_config = ConfigDict(frozen=True, strict=True, extra="forbid")


class Node:
    """One node of the dataflow: consumes messages of `inputs`, produces messages of `outputs`.

    `step` may change the node's own state and nothing else: no bus, file, clock, print or unseeded randomness.
    A module under `nodes/` exports its class as `NODE`; it is built with the node's settings and the run's `Context`.
    """

    config_type: ClassVar[type[NodeConfig]] = NodeConfig
    inputs: tuple[type[Message], ...] = ()  # set on the class; in __init__ only where they depend on settings
    outputs: tuple[type[Message], ...] = ()
    optional: tuple[type[Message], ...] = ()  # inputs that no node needs to produce
    # whether a live run starts it again after a crash: what comes later must not need what it knew before
    restartable: ClassVar[bool] = False
    # (question kind, answer kind): served as a queryable
    serves: ClassVar[tuple[type[Message], type[Message]] | None] = None

    def __init__(self, config: Any, context: Context) -> None:
        self.config = config
        self.context = context

    def start(self) -> None:
        """Load what is slow to load, such as models. Called once, in the node's process, before the first `step`."""

    def step(self, message: Message) -> Sequence[Message]:
        """Consume one message of `inputs`; returns messages of `outputs` in the order to publish them."""
        raise NotImplementedError

    def stop(self) -> None:
        """Release what `start` acquired. Called once after the last `step`, also when a step failed."""


class Source(Node):
    """A node without inputs that produces messages by itself: a camera, or a recording."""

    ending: bool = False  # set by the shell: produce the message that marks the end, and return

    def is_lossless(self) -> bool:
        """Whether every message must arrive (data sets, recordings), or old ones may be dropped (a live camera)."""
        raise NotImplementedError

    def given_poses(self) -> dict[int, F64] | None:
        """The data set's own poses for evaluation: stamp_ns to world_from_camera (4, 4), metres; None without any."""
        return None

    def messages(self) -> Iterator[Message]:
        """All messages of the source; the last one marks the end."""
        raise NotImplementedError

    def step(self, message: Message) -> Sequence[Message]:
        """Never called: a source has no inputs."""
        raise NotImplementedError


class Context(BaseModel):
    """What a node may know of its run."""

    model_config = ConfigDict(frozen=True, strict=True, extra="forbid")

    lossless: bool = True  # replay: nothing may be dropped; live: old frames may be
    threads: int = 1  # for each library that has threads of its own
    model_dirs: tuple[str, ...] = ()  # folders with weights, searched after the packaged ones
    out_dir: str = ""  # the run's folder, for the recorder and crash files
    produced_kinds: tuple[str, ...] = ()  # names of the message classes that some node of the dataflow publishes


def plugin(package: str, name: str, export: str, what: str) -> Any:
    """Import `<package>.<name>` and return its `export`; raises ConfigError listing the choices when it is unknown."""
    if name not in available(package):
        choices = [module for module in available(package) if _defines(f"{package}.{module}", export)]
        raise ConfigError(f"no {what} named {name!r}; there are: {', '.join(choices)}")
    try:
        module = importlib.import_module(f"{package}.{name}")
    except ModuleNotFoundError as error:
        if error.name is None or error.name.startswith("placegraph."):
            raise
        package_name = error.name.split(".")[0]
        extra = EXTRAS.get(package_name)
        hint = f"pip install 'placegraph[{extra}]'" if extra else "see docs/getting_started.md"
        raise ConfigError(f"{what} {name!r} needs the package {package_name!r}: {hint}") from error
    exported = getattr(module, export, None)
    if exported is None:
        raise ConfigError(f"{package}.{name} exports no {export}")
    return exported


def available(package: str) -> list[str]:
    """Names of the public modules in a package folder, without importing them."""
    spec = importlib.util.find_spec(package)
    paths: Iterable[str] = (spec.submodule_search_locations or ()) if spec else ()
    return sorted(module.name for module in pkgutil.iter_modules(paths) if not module.name.startswith("_"))


def _defines(module: str, export: str) -> bool:
    # By its text: importing a module may need a package that is not installed.
    spec = importlib.util.find_spec(module)
    text = Path(spec.origin).read_text() if spec and spec.origin else ""
    return re.search(rf"^(class )?{export}\b", text, re.MULTILINE) is not None


def build_node(name: str, settings: dict[str, Any], context: Context) -> Node:
    """Find a node by name and build it with checked settings; raises ConfigError naming the node and the key."""
    node_type: type[Node] = plugin(NODES, name, "NODE", "node")
    try:
        config = node_type.config_type.model_validate(settings)
    except ValidationError as error:
        raise ConfigError(node_setting_error(name, error, node_type.config_type)) from None
    return node_type(config, context)
