"""`placegraph replay`: a recording into a map again, or the messages of a crash file through their node again."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Annotated

import msgpack
import typer
from pydantic import ValidationError

from placegraph.runtime import log, messages
from placegraph.runtime.config import RunConfig, read
from placegraph.runtime.errors import ConfigError, SchemaError, SourceError
from placegraph.runtime.messages.codec import decode
from placegraph.runtime.node import build_node
from placegraph.runtime.process import ProcessSpec
from placegraph.tools.map_files.map_folder import RUN, read_config
from placegraph.tools.run import run_dataflow

BEFORE_KEYFRAMES = ("camera", "pose", "keyframe")


def replay(
    recording: Annotated[Path, typer.Argument(metavar="RECORDING", help="A run.rrd, or a crash/<node>.rec.")],
    config: Annotated[
        Path | None, typer.Option(help="Dataflow file (default: the run.json beside the recording).")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Map folder to write (default: out/replay-<number>).")] = None,
    inline: Annotated[bool, typer.Option("--inline", help="One thread instead of a process for each node.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress table.")] = False,
) -> None:
    """Map a recording again from its keyframes: the same recording gives the same graph.

    With a crash file: build the node with its settings and step the messages that led to the crash.
    """
    if recording.suffix == ".rec":
        replay_crash(recording)
        return
    if not recording.is_file():
        raise SourceError(f"{recording}: no such recording")
    settings = read(config) if config else _settings_of(recording)
    nodes = {name: values for name, values in settings.nodes.items() if name not in BEFORE_KEYFRAMES}
    nodes["playback"] = {"path": str(recording.resolve())}
    folder = run_dataflow(settings.model_copy(update={"nodes": nodes}), "replay", out, inline, quiet)
    print(f"\nmap        {folder}")


def _settings_of(recording: Path) -> RunConfig:
    if not (recording.parent / RUN).exists():
        raise ConfigError(f"{recording}: there is no {RUN} beside it; name a dataflow file with --config")
    return read_config(recording.parent)


def replay_crash(path: Path) -> None:
    """Step the messages of a crash file; the same error is raised unless it depends on older state."""
    spec, trace, kept = _read_crash(path)
    log.configure(spec.node, "DEBUG")
    print(f"{spec.node} ended with:\n{trace}")
    with tempfile.TemporaryDirectory() as folder:  # a recorder would overwrite the run's own file
        node = build_node(spec.node, spec.settings, spec.context.model_copy(update={"out_dir": folder}))
        try:
            node.start()
            for message in kept:
                print(f"step {type(message).__name__} of frame {message.frame_id}")
                for output in node.step(message):
                    print(f"  gives {type(output).__name__} of frame {output.frame_id}")
        finally:
            node.stop()


def _read_crash(path: Path) -> tuple[ProcessSpec, str, list[messages.Message]]:
    """What a node's process wrote when it crashed: its spec, the traceback, and the messages that led to it."""
    kinds = {kind.__name__: kind for kind in messages.all_kinds()}
    try:
        spec, trace, envelopes = msgpack.unpackb(path.read_bytes())
        kept = [decode(kinds[name], payload) for name, payload in envelopes]
        return ProcessSpec.model_validate_json(spec), str(trace), kept
    except OSError as error:
        raise SchemaError(f"{path}: cannot read: {error.strerror}") from None
    except SchemaError as error:
        raise SchemaError(f"{path}: {error}") from None
    except (ValidationError, ValueError, TypeError, KeyError, msgpack.UnpackException) as error:
        first = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise SchemaError(f"{path}: not a crash file: {first}") from None
