"""Read a dataflow file, build the nodes, check the wiring."""

from __future__ import annotations

import graphlib
import threading
import tomllib
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from placegraph.runtime.bus.session import BusConfig
from placegraph.runtime.errors import ConfigError
from placegraph.runtime.messages import Health, Message, Question
from placegraph.runtime.node import NODES, Context, Node, Source, available, build_node, plugin
from placegraph.runtime.setting_errors import first_problem

# Published by the shells, not by a node: requests from outside, and each process's report on itself.
PRODUCED_BY_SHELL: tuple[type[Message], ...] = (Health, Question)


class RunSettings(BaseModel):
    """`[run]` of a dataflow file."""

    model_config = ConfigDict(frozen=True, strict=True, extra="forbid")

    # runs are written to <out_dir>/<name>; relative to the current folder
    out_dir: str = Field(default="out", min_length=1)
    # for each library that has threads of its own; more than 1 can change the last bits
    threads: int = Field(default=1, ge=1)
    model_dirs: list[str] = []  # folders with weights, relative to the dataflow file
    # a question that takes longer is answered with an error
    question_timeout_s: float = Field(default=30.0, gt=0, allow_inf_nan=False, le=threading.TIMEOUT_MAX)
    log_level: Literal["DEBUG", "INFO", "WARNING", "ERROR"] = "INFO"


class RunConfig(BaseModel):
    """A whole dataflow file: which nodes run, and what differs from the defaults."""

    model_config = ConfigDict(frozen=True, strict=True, extra="forbid")

    run: RunSettings = RunSettings()
    bus: BusConfig = BusConfig()
    nodes: dict[str, dict[str, Any]]


def read(path: Path) -> RunConfig:
    """Read a dataflow file, by its path or by the name of a packaged one; raises ConfigError."""
    if not path.exists():
        packaged = Path(str(resources.files("placegraph.configs"))) / path.name
        if path.parent.name not in ("", "configs") or not packaged.exists():
            raise ConfigError(f"{path}: no such dataflow file; with placegraph come: {', '.join(packaged_names())}")
        path = packaged
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, OSError) as error:
        raise ConfigError(f"{path}: {error}") from None
    try:
        config = RunConfig.model_validate(data)
    except ValidationError as error:
        (section, *keys), reason = first_problem(error, RunConfig)
        raise ConfigError(f"{path}: [{section}]{' ' if keys else ''}{'.'.join(keys)}: {reason}") from None
    folders = [str((path.parent / folder).resolve()) for folder in config.run.model_dirs]
    return config.model_copy(update={"run": config.run.model_copy(update={"model_dirs": folders})})


def packaged_names() -> list[str]:
    """Names of the dataflow files that come with placegraph."""
    return sorted(item.name for item in resources.files("placegraph.configs").iterdir() if item.name.endswith(".toml"))


@dataclass(frozen=True)
class Dataflow:
    """The nodes, each after those whose messages it takes, and which node produces and consumes which message."""

    config: RunConfig
    context: Context
    nodes: dict[str, Node]

    @property
    def source(self) -> Source:
        """The one node without inputs."""
        return next(node for node in self.nodes.values() if isinstance(node, Source))

    def producer(self, kind: type[Message]) -> str | None:
        """Name of the node that produces a kind; None when no node does."""
        return next((name for name, node in self.nodes.items() if kind in node.outputs), None)

    def consumers(self, kind: type[Message]) -> list[str]:
        """Names of the nodes that consume a kind, in the order of the dataflow."""
        return [name for name, node in self.nodes.items() if kind in node.inputs]

    def awaited_consumers(self, name: str) -> dict[str, list[str]]:
        """For each kind that a node produces, by name: the consumers it waits for."""
        return {kind.__name__: self.consumers(kind) for kind in self.nodes[name].outputs}


def build(config: RunConfig, out_dir: Path | None = None) -> Dataflow:
    """Build every node without starting it and check the wiring; raises ConfigError naming the node."""
    base = Context(
        threads=config.run.threads,
        model_dirs=tuple(config.run.model_dirs),
        out_dir=str(out_dir) if out_dir else "",
    )
    nodes = {name: build_node(name, settings, base) for name, settings in config.nodes.items()}
    sources = [name for name, node in nodes.items() if isinstance(node, Source)]
    if len(sources) != 1:
        raise ConfigError(f"expected one source (camera or playback), found {', '.join(sources) or 'none'}")
    source = nodes[sources[0]]
    assert isinstance(source, Source)
    produced = sorted({kind.__name__ for node in nodes.values() for kind in node.outputs})
    context = base.model_copy(update={"lossless": source.is_lossless(), "produced_kinds": tuple(produced)})
    source.context = context
    # built again with what is produced now known: some nodes consume a kind only if another node produces it
    nodes = {
        name: nodes[name] if name == sources[0] else build_node(name, settings, context)
        for name, settings in config.nodes.items()
    }
    dataflow = Dataflow(config, context, {name: nodes[name] for name in _order(nodes)})
    _check_wiring(dataflow)
    return dataflow


def _order(nodes: dict[str, Node]) -> list[str]:
    feeds: dict[str, set[str]] = {name: set() for name in sorted(nodes)}
    for name, consumer in nodes.items():
        for kind in consumer.inputs:
            feeds[name] |= {producer for producer, node in nodes.items() if kind in node.outputs}
    try:
        return list(graphlib.TopologicalSorter(feeds).static_order())
    except graphlib.CycleError as error:
        raise ConfigError(f"the dataflow has a cycle: {' -> '.join(error.args[1])}") from None


def _check_wiring(dataflow: Dataflow) -> None:
    for kind in {kind for node in dataflow.nodes.values() for kind in node.outputs}:
        producers = [name for name, node in dataflow.nodes.items() if kind in node.outputs]
        if len(producers) > 1:
            raise ConfigError(f"{kind.__name__} is produced by {' and '.join(producers)}: switch one of them off")
    for name, node in dataflow.nodes.items():
        for kind in node.inputs:
            needed = kind not in PRODUCED_BY_SHELL and kind not in node.optional
            if needed and dataflow.producer(kind) is None:
                raise ConfigError(
                    f"{name} needs {kind.__name__}, which no node produces: add {_possible_producers(kind)}"
                )


def _possible_producers(kind: type[Message]) -> str:
    """The sections of a dataflow file that would produce a kind."""
    names = [name for name in available(NODES) if kind in plugin(NODES, name, "NODE", "node").outputs]
    return " or ".join(f"[nodes.{name}]" for name in names)
