"""`placegraph house`: generate a furnished house from a seed and film it, as a folder to map and to score."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Annotated

import typer

from placegraph.runtime.errors import ConfigError
from placegraph.tools.simulator.ground_truth import HouseRun, read_house_run
from placegraph.tools.simulator.tum_export import HouseOrder, export


def house(
    out: Annotated[Path, typer.Option(help="Folder for the frames and the truth.")],
    seed: Annotated[int, typer.Option(min=0, help="Everything about the house follows from it.")] = 0,
    floors: Annotated[int | None, typer.Option(min=1, max=3, help="Floors (default: the seed chooses).")] = None,
    limit: Annotated[int, typer.Option(min=0, help="Stop after so many frames (0: the whole walk).")] = 0,
    width: Annotated[int, typer.Option(min=64, max=4096, help="Image width in px; the height is 3/4 of it.")] = 640,
    moved: Annotated[
        int, typer.Option(min=0, help="Move so many pieces of furniture after the walk, and film the house again.")
    ] = 0,
    workers: Annotated[
        int | None, typer.Option(min=1, help="Processes (default: one for each core); the result is the same.")
    ] = None,
    replace: Annotated[bool, typer.Option("--replace", help="Replace another house folder at --out.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress bar.")] = False,
) -> None:
    """Make a house and film it; `placegraph run CONFIG --source OUT` maps it."""
    order = HouseOrder(seed, floors, limit, width, width * 3 // 4, moved)
    existing = _already_there(out, order, replace)
    run = existing or export(order, out, workers, quiet)
    size = f"{run.width}x{run.height}"
    print(
        f"\n{'it is there already' if existing else 'written'}  {out}: {run.frames} frames of {size}, seed {run.seed}"
    )
    print(f"plan     {out / 'plan.png'}\ntruth    {out / 'truth'}")
    print(f"map it   placegraph run configs/demo.toml --source {out}")


def _already_there(out: Path, order: HouseOrder, replace: bool) -> HouseRun | None:
    """The run of an existing folder that matches the order; None when there is no folder yet.

    `replace` removes another house folder, complete or not. Raises ConfigError when `out` holds anything else.
    """
    if out.is_dir() and any(out.iterdir()):
        run = read_house_run(out)
        if run is None:
            raise ConfigError(f"{out}: exists and is not a house folder; choose another --out or remove it")
        if not order.is_made_by(run) and replace:
            shutil.rmtree(out)
            return None
        if not order.is_made_by(run):
            raise ConfigError(
                f"{out}: holds another house (seed {run.seed}, limit {run.limit}, {run.width}x{run.height}, "
                f"moved {run.moved}, generator "
                f"{run.version}); choose another --out or remove it"
            )
        return run
    if out.exists() and not out.is_dir():
        raise ConfigError(f"{out}: is a file; choose another --out")
    return None
