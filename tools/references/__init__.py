"""`placegraph references`: makes and checks the recording in tests/replay of what every node gives, step by step."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from placegraph.runtime.errors import ConfigError
from placegraph.tools.references.recorded_steps import ReferenceRecording, differences, summary
from placegraph.tools.references.reference_runs import make_recording

FOLDER = Path(__file__).parents[2] / "tests" / "replay"
RECORDING, SUMMARY = "house.rec", "house.txt"


def references(
    update: Annotated[bool, typer.Option("--update", help="Make the recording and its summary again.")] = False,
    folder: Annotated[Path, typer.Option(help="Their folder; by default in this source checkout.")] = FOLDER,
) -> None:
    """Compare the outputs of every node with the reference recording, or make it again.

    Exit status: 0 as recorded, 1 something differs.
    """
    if not folder.is_dir():
        raise ConfigError(f"{folder}: no such folder; references belong to a source checkout (--folder)")
    if update:
        recording = make_recording()
        recording.write(folder / RECORDING)
        (folder / SUMMARY).write_text(summary(recording), encoding="utf-8")
        print(f"{len(recording.messages)} messages, {(folder / RECORDING).stat().st_size / 1e6:.2f} MB in {folder}")
        return
    recording = ReferenceRecording.read(folder / RECORDING)
    lines = {name: differences(recording, name) for name in recording.steps}
    for name, different in lines.items():
        print(f"{name:<10} {len(recording.steps[name]):>4} steps  {'differs' if different else 'as recorded'}")
        print("".join(f"  {line}\n" for line in different), end="")
    if any(lines.values()):
        raise typer.Exit(1)
