"""Run a dataflow: as processes around a Zenoh hub, or inline in one thread."""

from __future__ import annotations

import queue
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Annotated, Any

import typer

from placegraph.nodes.camera import detect_source
from placegraph.runtime.config import Dataflow, RunConfig, build, read
from placegraph.runtime.errors import ConfigError, PlacegraphError
from placegraph.runtime.health import StepStats
from placegraph.runtime.inline import Inline
from placegraph.runtime.launcher import Launcher
from placegraph.runtime.messages import Correction, End, Frame, Health, Keyframe, Map, Message, Pose
from placegraph.tools.evaluate.trajectory_error import against_given
from placegraph.tools.map_files.map_folder import GRAPH, make_empty_folder, next_folder, write_run
from placegraph.tools.run.map_collector import MapCollector
from placegraph.tools.run.progress_table import ProgressTable

POLL_S = 0.1
FINISH_TIMEOUT_S = 300.0  # after Ctrl-C or a live source's end: for what is in flight to reach the map


def run(
    config: Annotated[Path, typer.Argument(metavar="CONFIG", help="A dataflow file, e.g. configs/replay.toml.")],
    source: Annotated[Path | None, typer.Option(help="Data set folder or recording; its format is recognised.")] = None,
    limit: Annotated[int, typer.Option(min=0, help="Stop after so many frames (0: all).")] = 0,
    out: Annotated[Path | None, typer.Option(help="Map folder to write (default: out/<config>-<number>).")] = None,
    inline: Annotated[
        bool, typer.Option("--inline", help="One thread in this process instead of a process for each node.")
    ] = False,
    stay: Annotated[
        bool, typer.Option("--stay", help="After the source's end keep answering questions until Ctrl-C.")
    ] = False,
    endpoint: Annotated[str, typer.Option(help="Where the Zenoh hub listens, e.g. tcp/127.0.0.1:7447.")] = "",
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress table.")] = False,
) -> None:
    """Map a source: build the scene graph, write the map folder and the recording.

    Ctrl-C ends the source in order and still writes the map; a second Ctrl-C stops at once.

    Exit status: 0 done, 1 failed, 2 wrong usage or config.
    """
    settings = read(config)
    camera = source_settings(settings, source) | ({"limit": limit} if limit else {})
    folder = run_dataflow(with_settings(settings, {"camera": camera}, endpoint), config.stem, out, inline, quiet, stay)
    print(f'\nmap        {folder}\nask        placegraph ask {folder} "which chair is closest to the table"')
    print(f"look       placegraph view {folder}")


def source_settings(config: RunConfig, source: Path | None) -> dict[str, Any]:
    """The camera settings that `--source` changes; raises SourceError, ConfigError when its format is not known.

    The path's own format replaces the config's source, so that a camera's config also maps a recording of that camera.
    """
    if source is None:
        return {}
    changes: dict[str, Any] = {"path": str(source)}
    configured = config.nodes.get("camera", {}).get("source", "auto")
    if configured != "auto" and configured != detect_source(str(source)).__module__.rpartition(".")[2]:
        changes |= {"source": "auto", "settings": {}}
    return changes


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
    make_empty_folder(folder)
    collector = MapCollector(dataflow)
    progress = ProgressTable(dataflow, quiet)
    try:
        with progress:
            if inline:
                nodes = _run_inline(dataflow, collector, progress)
            else:
                nodes = _run_processes(dataflow, folder, collector, progress, stay)
    except PlacegraphError as error:
        raise type(error)(f"{error}{_save_partial_map(collector, folder)}") from None
    summary = _summary(dataflow, collector, nodes)
    effective = {name: node.config.model_dump(mode="json") for name, node in dataflow.nodes.items()}
    try:
        collector.write(folder)
        write_run(folder, config, effective, summary)
    except OSError as error:
        raise PlacegraphError(f"the map cannot be written: {error}") from None
    progress.print_summary(summary)
    return folder


def _save_partial_map(collector: MapCollector, folder: Path) -> str:
    """Write the map of a run that failed, as far as it got; returns a sentence about it, "" without a graph."""
    if collector.graph is None:
        return ""
    try:
        collector.write(folder)
    except OSError as error:
        return f"\nthe map cannot be written either: {error}"
    which = "the last graph" if collector.complete else f"graph revision {collector.graph.revision}, not the last one"
    return f"\n{folder} holds {which}"


def _run_inline(dataflow: Dataflow, collector: MapCollector, progress: ProgressTable) -> list[Health]:
    last = time.monotonic()

    def observe(message: Message) -> None:
        nonlocal last
        collector.add(message)
        if isinstance(message, (Frame, Keyframe)) and time.monotonic() - last >= 1.0:
            _show_stats(shell.stats, progress, time.monotonic() - last)
            last = time.monotonic()

    shell = Inline(dataflow, observe)
    collector.timer.begin()
    with shell:
        collector.timer.ready()
        shell.run()
    collector.timer.done()
    return [stats.report(0.0, 0, 0.0) for stats in shell.stats.values()]


def _show_stats(stats: dict[str, StepStats], progress: ProgressTable, elapsed_s: float) -> None:
    for node_stats in stats.values():
        progress.add(node_stats.report(elapsed_s, 0, 0.0))
    progress.refresh()


@contextmanager
def _interrupts() -> Iterator[list[int]]:
    """Collect SIGINT and SIGTERM in a list; the second one raises PlacegraphError and so ends any waiting."""
    received: list[int] = []

    def on_signal(number: int, frame: FrameType | None) -> None:
        received.append(number)
        if len(received) == 2:
            raise PlacegraphError("stopped at once, before the run had ended in order")

    old = {number: signal.signal(number, on_signal) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield received
    finally:
        for number, handler in old.items():
            signal.signal(number, handler)


def _run_processes(
    dataflow: Dataflow, folder: Path, collector: MapCollector, progress: ProgressTable, stay: bool
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
        for kind in (Pose, Correction, Map, collector.graph_kind, Health, End):
            launcher.observe(kind, messages.put)
        collector.timer.begin()
        launcher.start(lambda: bool(interrupts))
        collector.timer.ready()
        give_up_at = float("inf")
        while not collector.complete or (stay and not interrupts):
            time.sleep(POLL_S)
            launcher.poll()
            drain()
            progress.refresh()
            if collector.complete:
                collector.timer.done()
            if stay and collector.complete and not (folder / GRAPH).exists():
                collector.write(folder)
                progress.say(f"mapped; answering questions at {dataflow.config.bus.endpoint} until Ctrl-C")
            if interrupts and give_up_at == float("inf"):
                progress.say(
                    "ending the source; what is in flight still goes into the map (Ctrl-C again: stop at once)"
                )
                launcher.stop_source()
                give_up_at = time.monotonic() + FINISH_TIMEOUT_S
            if collector.ended and not dataflow.context.lossless:  # the last keyframe may be lost
                give_up_at = min(give_up_at, time.monotonic() + FINISH_TIMEOUT_S)
            if time.monotonic() > give_up_at and not collector.complete:
                raise PlacegraphError(f"the last graph did not come within {FINISH_TIMEOUT_S:g} s of the source's end")
        launcher.stop()
        drain()
    return [health[name] for name in dataflow.nodes if name in health]


def _summary(dataflow: Dataflow, collector: MapCollector, nodes: list[Health]) -> dict[str, Any]:
    from placegraph.runtime.scene_graph import SceneGraph

    frames, poses = collector.frames, collector.poses
    estimated = {pose.stamp_ns: pose.world_from_camera[:3, 3] for pose in poses if pose.trusted}
    summary: dict[str, Any] = {
        "start_s": round(collector.timer.start_s, 2),
        "mapping_s": round(collector.timer.mapping_s, 2),
        "frames": frames,
        "frames_per_s": round(frames / collector.timer.mapping_s, 2) if frames else 0.0,
        "keyframes": collector.map.keyframes if collector.map else 0,
        "untrusted_poses": sum(not pose.trusted for pose in poses),
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
