"""Run the graph again from a recording, or the message that stopped a process from its crash file."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import msgpack
import typer

from placegraph.runtime import log, messages
from placegraph.runtime.codec import decode
from placegraph.runtime.config import RunConfig, read
from placegraph.runtime.errors import ConfigError, SchemaError
from placegraph.runtime.node import Context, build_node
from placegraph.tools.map_folder import RUN, read_run
from placegraph.tools.run import run_dataflow

BEFORE_KEYFRAMES = ("camera", "pose", "keyframe")


def replay(
    recording: Annotated[Path, typer.Argument(metavar="RECORDING", help="A run.rrd, or a crash/<node>.rec.")],
    config: Annotated[
        Path | None, typer.Option(help="Dataflow file (default: the run.json beside the recording).")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Map folder to write (default: out/replay-<number>).")] = None,
    inline: Annotated[bool, typer.Option(help="One thread instead of a process for each node.")] = False,
    quiet: Annotated[bool, typer.Option(help="No progress table.")] = False,
) -> None:
    """Run everything behind the keyframes again from a recording: same recording, same graph.

    With a crash file: build the node as it was and step the messages that led to its end.
    """
    if recording.suffix == ".rec":
        replay_crash(recording)
        return
    settings = read(config) if config else _settings_of(recording)
    nodes = {name: values for name, values in settings.nodes.items() if name not in BEFORE_KEYFRAMES}
    nodes["playback"] = {"path": str(recording.resolve())}
    folder = run_dataflow(settings.model_copy(update={"nodes": nodes}), "replay", out, inline, quiet)
    print(f"\nmap        {folder}")


def _settings_of(recording: Path) -> RunConfig:
    if not (recording.parent / RUN).exists():
        raise ConfigError(f"{recording}: there is no {RUN} beside it; name a dataflow file with --config")
    return RunConfig.model_validate(read_run(recording.parent)["config"])


def replay_crash(path: Path) -> None:
    """Step the kept messages of a crash file here; the same error comes out unless it depends on older state."""
    try:
        spec_text, trace, parcels = msgpack.unpackb(path.read_bytes())
        spec = json.loads(spec_text)
    except (OSError, ValueError, msgpack.UnpackException) as error:
        raise SchemaError(f"{path}: not a crash file: {error}") from None
    log.configure(spec["node"], "DEBUG")
    print(f"{spec['node']} ended with:\n{trace}")
    node = build_node(spec["node"], spec["settings"], Context.model_validate_json(json.dumps(spec["context"])))
    try:
        node.start()
        for name, payload in parcels:
            message = decode(getattr(messages, name), payload)
            print(f"step {name} of frame {message.frame_id}")
            for given in node.step(message):
                print(f"  gives {type(given).__name__} of frame {given.frame_id}")
    finally:
        node.stop()
