"""`placegraph view`: open a recording in the Rerun viewer that comes with placegraph."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Annotated

import typer

from placegraph.runtime.errors import ConfigError, SourceError

RECORDING = "run.rrd"
WINDOW = "1400x900"  # of a screenshot, in px


def view(
    path: Annotated[Path, typer.Argument(help="A recording FILE.rrd, or the folder of a run that holds run.rrd.")],
    screenshot: Annotated[
        Path | None, typer.Option(help="Write a picture of the viewer to this PNG and end; needs a display (xvfb-run).")
    ] = None,
    web: Annotated[bool, typer.Option("--web", help="Serve the viewer to a browser on this machine only.")] = False,
) -> None:
    """Open the recording of a run in the Rerun viewer."""
    command = viewer_command(path, screenshot, web)
    try:
        code = subprocess.run(command, check=False).returncode
    except KeyboardInterrupt:  # the viewer received the same Ctrl-C and ends by itself
        code = 130
    raise typer.Exit(code)


def viewer_command(path: Path, screenshot: Path | None, web: bool) -> list[str]:
    """The command line of the viewer. Raises SourceError without a recording, ConfigError without a viewer."""
    recording = path / RECORDING if path.is_dir() else path
    if not recording.is_file():
        raise SourceError(f"{recording}: no such recording")
    if screenshot is not None and web:
        raise ConfigError("--screenshot and --web exclude each other: a picture is taken of the native viewer")
    viewer = Path(sys.executable).with_name("rerun")
    if not viewer.is_file():
        raise ConfigError(f"{viewer}: the Rerun viewer is missing: it comes with the package rerun-sdk")
    # Also the native viewer listens for data, and by default on every interface.
    command = [str(viewer), str(recording), "--bind", "127.0.0.1", "--port", "auto"]
    if screenshot is not None:
        command += ["--screenshot-to", str(screenshot), "--window-size", WINDOW]
    if web:
        command.append("--web-viewer")
    return command
