"""`placegraph record`: a camera's frames into a recording, exactly and without mapping them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from placegraph.runtime.config import read
from placegraph.runtime.errors import ConfigError
from placegraph.tools.run import run_dataflow, source_settings, with_settings
from placegraph.tools.view import RECORDING


def record(
    config: Annotated[
        Path, typer.Argument(metavar="CONFIG", help="A dataflow file with a camera; its other nodes stay off.")
    ],
    out: Annotated[Path, typer.Option(help="Folder for the recording (run.rrd).")],
    source: Annotated[Path | None, typer.Option(help="Data set folder, for a camera that reads one.")] = None,
    limit: Annotated[int, typer.Option(min=0, help="Stop after so many frames (0: all, or until Ctrl-C).")] = 0,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress table.")] = False,
) -> None:
    """Record a camera's frames exactly, to be mapped later.

    `placegraph run CONFIG --source OUT/run.rrd` maps them.
    """
    settings = read(config)
    if "camera" not in settings.nodes:
        raise ConfigError(f"{config}: there is no [nodes.camera] to record")
    nodes: dict[str, dict[str, Any]] = {
        "camera": settings.nodes["camera"],
        "recorder": settings.nodes.get("recorder", {}) | {"frames": True, "file": RECORDING},
    }
    overrides = source_settings(settings, source) | ({"limit": limit} if limit else {})
    only_camera = with_settings(settings.model_copy(update={"nodes": nodes}), {"camera": overrides})
    folder = run_dataflow(only_camera, config.stem, out, inline=False, quiet=quiet)
    print(f"\nrecording  {folder / RECORDING}\nmap it     placegraph run {config} --source {folder / RECORDING}")
