"""The `placegraph` command: mounts the other tools and turns errors into one line and an exit status."""

from __future__ import annotations

import sys
from collections.abc import Callable

import typer

from placegraph.runtime import log
from placegraph.runtime.errors import ConfigError, PlacegraphError
from placegraph.tools import (
    ask,
    bench,
    check,
    doctor,
    evaluate,
    export,
    graph,
    models,
    path,
    perceive,
    record,
    references,
    replay,
    rooms,
    run,
    view,
)
from placegraph.tools.evaluate.grounding_command import evaluate_grounding
from placegraph.tools.evaluate.networks_command import networks
from placegraph.tools.simulator.command import house
from placegraph.tools.training import command as train

app = typer.Typer(
    help="Hierarchical 3D scene graphs from RGB-D frames, and answers to questions about them.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
COMMANDS: tuple[Callable[..., None], ...] = (
    run.run,
    ask.ask,
    check.check,
    graph.graph,
    path.path,
    record.record,
    replay.replay,
    view.view,
    rooms.rooms,
    export.export,
    evaluate.evaluate,
    perceive.perceive,
    doctor.doctor,
    bench.bench,
    references.references,
    house,
)
for command in COMMANDS:
    app.command()(command)
app.command("evaluate-networks")(networks)
app.command("evaluate-grounding")(evaluate_grounding)
app.add_typer(models.app, name="models")
app.add_typer(train.app, name="train")


def main() -> None:
    """Entry point: exit status 2 for wrong settings, 1 for other errors that are ours; anything else is a bug."""
    log.configure("placegraph", "WARNING")
    try:
        app(prog_name="placegraph")
    except PlacegraphError as error:
        print(f"placegraph: {error}", file=sys.stderr)
        sys.exit(2 if isinstance(error, ConfigError) else 1)


if __name__ == "__main__":
    main()
