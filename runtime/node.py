"""The contract of a node, and how nodes are found by name."""

from __future__ import annotations

import importlib
import importlib.util
import pkgutil
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, ClassVar

from pydantic import BaseModel, ConfigDict, ValidationError

from placegraph.runtime.arrays import F64
from placegraph.runtime.errors import ConfigError
from placegraph.runtime.messages import Message
from placegraph.runtime.renamed_settings import setting_error

NODES = "placegraph.nodes"
EXTRAS = {"depthai": "oak", "embreex": "demo"}  # which extra brings an optional package


class NodeConfig(BaseModel):
    """Base of every node's settings: frozen, strict, unknown keys refused."""

    model_config = ConfigDict(frozen=True, strict=True, extra="forbid")


class Node:
    """One step of the dataflow: `takes` kinds, `gives` kinds, `step` from one to the other.

    `step` may change the node's own state and nothing else: no bus, file, clock, print or unseeded randomness.
    A module under `nodes/` exports its class as `NODE`; it is built with the node's settings and the run's `Context`.
    """

    config_type: ClassVar[type[NodeConfig]] = NodeConfig
    inputs: tuple[type[Message], ...] = ()  # on the class; set in __init__ only where it depends on settings
    outputs: tuple[type[Message], ...] = ()
    # Kinds taken from further down the dataflow. A giver does not wait for this node to take them, which is what keeps
    # a cycle from blocking; without these edges the dataflow has no cycle (checked when it is built).
    feedback: ClassVar[tuple[type[Message], ...]] = ()
    optional: tuple[type[Message], ...] = ()  # kinds taken if some node gives them
    restartable: ClassVar[bool] = False  # live: a crash loses nothing but the message in hand (no state to lose)
    # (question kind, answer kind): served as a queryable.
    serves: ClassVar[tuple[type[Message], type[Message]] | None] = None

    def __init__(self, config: Any, context: Context) -> None:
        self.config = config
        self.context = context

    def start(self) -> None:
        """Load what is slow to load (models). Called once, in the node's own process, before the first `step`."""

    def step(self, message: Message) -> Sequence[Message]:
        """Take one message of `takes`; return messages of `gives` in the order they are to be published."""
        raise NotImplementedError

    def stop(self) -> None:
        """Release what `start` took; called once after the last `step`, also when a step failed."""


class Source(Node):
    """A node that takes nothing and gives messages by itself: a camera, or a recording."""

    ending: bool = False  # set by the shell: give what says the end and return

    def is_lossless(self) -> bool:
        """Whether every message must arrive (data sets, recordings) or the newest wins (a live camera)."""
        raise NotImplementedError

    def given_poses(self) -> dict[int, F64] | None:
        """stamp_ns to (4, 4) world_from_camera that the data bring, for evaluation; None when they bring none."""
        return None

    def messages(self) -> Iterator[Message]:
        """What it gives, ending with the message that says so."""
        raise NotImplementedError

    def step(self, message: Message) -> Sequence[Message]:
        """A source takes nothing."""
        raise NotImplementedError


class Context(BaseModel):
    """What a node may know of the run it is part of."""

    model_config = ConfigDict(frozen=True, strict=True, extra="forbid")

    lossless: bool = True  # replay: nothing may be dropped; live: the newest wins
    threads: int = 1  # for each library that has threads of its own
    model_dirs: tuple[str, ...] = ()  # where weights are looked for, after the packaged ones
    out_dir: str = ""  # the run's folder; only sinks write
    given: tuple[str, ...] = ()  # names of the kinds that some node of the dataflow gives, for those with a choice


def plugin(package: str, name: str, export: str, what: str) -> Any:
    """Import `<package>.<name>` and return its `export`; raises ConfigError naming the choices when there is none."""
    choices = available(package)
    if name not in choices:
        raise ConfigError(f"no {what} named {name!r}; there are: {', '.join(choices)}")
    try:
        module = importlib.import_module(f"{package}.{name}")
    except ModuleNotFoundError as error:
        if error.name is None or error.name.startswith("placegraph."):
            raise
        package_name = error.name.split(".")[0]
        extra = EXTRAS.get(package_name)
        how = f"pip install 'placegraph[{extra}]'" if extra else "see the extras in README"
        raise ConfigError(f"{what} {name!r} needs the package {package_name!r}: {how}") from error
    found = getattr(module, export, None)
    if found is None:
        raise ConfigError(f"{package}.{name} exports no {export}")
    return found


def available(package: str) -> list[str]:
    """Names of the plug-in modules in a package folder (private ones left out), without importing them."""
    spec = importlib.util.find_spec(package)
    paths: Iterable[str] = (spec.submodule_search_locations or ()) if spec else ()
    return sorted(module.name for module in pkgutil.iter_modules(paths) if not module.name.startswith("_"))


def build_node(name: str, settings: dict[str, Any], context: Context) -> Node:
    """Find a node by name and build it with checked settings; raises ConfigError `[nodes.<name>] key: what`."""
    node_type: type[Node] = plugin(NODES, name, "NODE", "node")
    try:
        config = node_type.config_type.model_validate(settings)
    except ValidationError as error:
        first = error.errors()[0]
        raise ConfigError(setting_error(name, tuple(map(str, first["loc"])), first["msg"])) from None
    return node_type(config, context)
