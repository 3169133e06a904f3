"""Run a dataflow: as processes around a Zenoh hub, or inline in one thread."""

from __future__ import annotations

import queue
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer

from placegraph.runtime.config import Dataflow, RunConfig, build, read
from placegraph.runtime.errors import ConfigError, PlacegraphError
from placegraph.runtime.health import StepStats
from placegraph.runtime.inline import Inline
from placegraph.runtime.launch import Launcher
from placegraph.runtime.messages import End, Frame, Graph, Health, Keyframe, Map, Message, Pose
from placegraph.tools.evaluate import against_given
from placegraph.tools.map_folder import GRAPH, Collector, next_folder, prepare, write_run
from placegraph.tools.progress import Progress

POLL_S = 0.1
FINISH_TIMEOUT_S = 300.0  # after Ctrl-C: for what is in flight to reach the map


def run(
    config: Annotated[Path, typer.Argument(metavar="CONFIG", help="A dataflow file, e.g. configs/replay.toml.")],
    source: Annotated[Path | None, typer.Option(help="Data set folder or recording; its format is recognised.")] = None,
    limit: Annotated[int, typer.Option(min=0, help="Stop after so many frames (0: all).")] = 0,
    out: Annotated[Path | None, typer.Option(help="Map folder to write (default: out/<config>-<number>).")] = None,
    inline: Annotated[
        bool, typer.Option(help="One thread in this process instead of a process for each node.")
    ] = False,
    stay: Annotated[bool, typer.Option(help="After the source's end keep answering questions until Ctrl-C.")] = False,
    endpoint: Annotated[str, typer.Option(help="Where the Zenoh hub listens, e.g. tcp/127.0.0.1:7447.")] = "",
    quiet: Annotated[bool, typer.Option(help="No progress table.")] = False,
) -> None:
    """Map a source: build the scene graph, write the map folder and the recording.

    Ctrl-C ends the source in order and still writes the map; a second Ctrl-C stops at once. Exit status: 0 done,
    1 failed, 2 wrong usage or config.
    """
    overrides: dict[str, dict[str, Any]] = {"camera": {}}
    if source is not None:
        overrides["camera"]["path"] = str(source)
    if limit:
        overrides["camera"]["limit"] = limit
    folder = run_dataflow(with_settings(read(config), overrides, endpoint), config.stem, out, inline, quiet, stay)
    print(f'\nmap        {folder}\nask        placegraph ask {folder} "which chair is closest to the table"')
    print(f"look       placegraph view {folder}")


def with_settings(config: RunConfig, overrides: dict[str, dict[str, Any]], endpoint: str = "") -> RunConfig:
    """A config with node settings replaced; raises ConfigError when such a node is not in it."""
    nodes = dict(config.nodes)
    for name, settings in overrides.items():
        if not settings:
            continue
        if name not in nodes:
            raise ConfigError(f"[nodes.{name}] is not part of this dataflow, so {', '.join(settings)} has no use")
        nodes[name] = nodes[name] | settings
    bus = config.bus.model_copy(update={"endpoint": endpoint}) if endpoint else config.bus
    return config.model_copy(update={"nodes": nodes, "bus": bus})


def run_dataflow(config: RunConfig, name: str, out: Path | None, inline: bool, quiet: bool, stay: bool = False) -> Path:
    """Run to the end and write the map folder; returns it."""
    if inline and stay:
        raise ConfigError("--stay needs processes: an inline run has no bus to answer on")
    folder = (out or next_folder(Path(config.run.out_dir), name)).resolve()
    dataflow = build(config, folder)
    prepare(folder)
    collector = Collector(dataflow)
    progress = Progress(dataflow, quiet)
    began = time.monotonic()
    with progress:
        if inline:
            nodes = _run_inline(dataflow, collector, progress)
        else:
            nodes = _run_processes(dataflow, folder, collector, progress, stay)
    elapsed_s = time.monotonic() - began
    collector.write(folder)
    summary = _summary(dataflow, collector, nodes, elapsed_s)
    effective = {name: node.config.model_dump(mode="json") for name, node in dataflow.nodes.items()}
    write_run(folder, config, effective, summary)
    progress.print_summary(summary)
    return folder


def _run_inline(dataflow: Dataflow, collector: Collector, progress: Progress) -> list[Health]:
    last = time.monotonic()

    def observe(message: Message) -> None:
        nonlocal last
        collector.add(message)
        if isinstance(message, (Frame, Keyframe)) and time.monotonic() - last >= 1.0:
            _show_stats(shell.stats, progress, time.monotonic() - last)
            last = time.monotonic()

    shell = Inline(dataflow, observe)
    with shell:
        shell.run()
    return [stats.report(0.0, 0, 0.0) for stats in shell.stats.values()]


def _show_stats(stats: dict[str, StepStats], progress: Progress, elapsed_s: float) -> None:
    for one in stats.values():
        progress.add(one.report(elapsed_s, 0, 0.0))
    progress.refresh()


@contextmanager
def _interrupts() -> Iterator[list[int]]:
    """Collect SIGINT and SIGTERM in a list instead of breaking off."""
    received: list[int] = []
    old = {number: signal.signal(number, lambda n, _: received.append(n)) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield received
    finally:
        for number, handler in old.items():
            signal.signal(number, handler)


def _run_processes(
    dataflow: Dataflow, folder: Path, collector: Collector, progress: Progress, stay: bool
) -> list[Health]:
    messages: queue.SimpleQueue[Message] = queue.SimpleQueue()
    health: dict[str, Health] = {}

    def drain() -> None:
        while not messages.empty():
            message = messages.get()
            collector.add(message)
            if isinstance(message, Health):
                health[message.node] = message
                progress.add(message)

    with _interrupts() as interrupts, Launcher(dataflow, folder) as launcher:
        for kind in (Pose, Map, Graph, Health, End):
            launcher.observe(kind, messages.put)
        launcher.start()
        give_up_at = float("inf")
        while not collector.complete or (stay and not interrupts):
            time.sleep(POLL_S)
            launcher.poll()
            drain()
            progress.refresh()
            if stay and collector.complete and not (folder / GRAPH).exists():
                collector.write(folder)
                progress.say(f"mapped; answering questions at {dataflow.config.bus.endpoint} until Ctrl-C")
            if interrupts and give_up_at == float("inf"):
                progress.say(
                    "ending the source; what is in flight still goes into the map (Ctrl-C again: stop at once)"
                )
                launcher.stop_source()
                give_up_at = time.monotonic() + FINISH_TIMEOUT_S
            if len(interrupts) > 1 or time.monotonic() > give_up_at:
                raise PlacegraphError("stopped before the last graph was there")
        launcher.stop()
        drain()
    return [health[name] for name in dataflow.nodes if name in health]


def _summary(dataflow: Dataflow, collector: Collector, nodes: list[Health], elapsed_s: float) -> dict[str, Any]:
    from placegraph.runtime.scene_graph import SceneGraph

    frames = len(collector.poses)
    estimated = {pose.stamp_ns: pose.world_from_camera[:3, 3] for pose in collector.poses if pose.trusted}
    summary: dict[str, Any] = {
        "seconds": round(elapsed_s, 2),
        "frames": frames,
        "frames_per_s": round(frames / elapsed_s, 2),
        "keyframes": collector.map.keyframes if collector.map else 0,
        "untrusted_poses": sum(not pose.trusted for pose in collector.poses),
        "trajectory": against_given(estimated, dataflow.source.given_poses()),
        "nodes": {
            n.node: {
                "steps": n.steps,
                "p50_ms": round(n.step_p50_ms, 2),
                "p95_ms": round(n.step_p95_ms, 2),
                "drops": n.drops,
                "memory_mb": round(n.memory_mb),
            }
            for n in nodes
        },
    }
    if collector.graph is not None:
        graph = SceneGraph.from_json(collector.graph.json)
        summary["graph"] = {layer: len(graph.layer(layer)) for layer in ("floor", "room", "location", "object")}
    return summary
