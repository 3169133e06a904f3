"""The `placegraph` command: mounts the other tools and turns errors into one line and an exit status."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from typing import Any

import typer
from typer.core import TyperGroup

from placegraph.runtime import log
from placegraph.runtime.errors import ConfigError, PlacegraphError
from placegraph.tools import (
    ask,
    ask_batch,
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
from placegraph.tools.simulator.command import house
from placegraph.tools.training import command as train


class _TableOfContents(TyperGroup):
    """Lists the commands in the order of PANELS."""

    def list_commands(self, ctx: Any) -> list[str]:
        """The names of all commands."""
        return [name for commands in PANELS.values() for name in commands]


app = typer.Typer(
    cls=_TableOfContents,
    help="Hierarchical 3D scene graphs from RGB-D frames, and answers to questions about them.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
PANELS: dict[str, dict[str, Callable[..., None] | typer.Typer]] = {
    "Map": {"run": run.run, "record": record.record, "replay": replay.replay, "check": check.check},
    "Ask": {"ask": ask.ask, "ask-batch": ask_batch.ask_batch, "path": path.path},
    "Look": {"graph": graph.graph, "view": view.view, "perceive": perceive.perceive},
    "Exchange with other systems": {"export": export.export, "rooms": rooms.rooms},
    "Measure": {"evaluate": evaluate.app, "bench": bench.app},
    "Set up and develop": {
        "doctor": doctor.doctor,
        "models": models.app,
        "house": house,
        "train": train.app,
        "references": references.references,
    },
}
for panel, commands in PANELS.items():
    for name, command in commands.items():
        if isinstance(command, typer.Typer):
            app.add_typer(command, name=name, rich_help_panel=panel)
        else:
            app.command(name, rich_help_panel=panel)(command)

SUBCOMMANDS = {"evaluate": ("map", "networks", "grounding"), "bench": ("nodes", "growth", "fuzz")}


def replacement(arguments: Sequence[str]) -> str | None:
    """The command that replaced the one in these arguments; None when it is not an old one."""
    match arguments:
        case ["evaluate-networks" | "evaluate-grounding" as name, *_]:
            return f"evaluate {name.removeprefix('evaluate-')}"
        case ["ask", *rest] if any(word.split("=")[0] == "--batch" for word in rest):
            return "ask-batch QUESTIONS --out ANSWERS"
        case ["bench", *rest] if any(word.split("=")[0] == "--growth" for word in rest):
            return "bench growth SVG"
        case ["bench", *rest] if any(word.split("=")[0] == "--fuzz" for word in rest):
            return "bench fuzz REQUESTS"
        case ["evaluate" | "bench" as name, word, *_] if word not in (*SUBCOMMANDS[name], "-h", "--help"):
            return f"{name} {SUBCOMMANDS[name][0]}"
        case ["bench"]:
            return "bench nodes"
    return None


def main() -> None:
    """Entry point: exit status 2 for wrong settings, 1 for other errors that are ours; anything else is a bug."""
    log.configure("placegraph", "WARNING")
    try:
        if (new := replacement(sys.argv[1:])) is not None:
            raise ConfigError(f"this command is now `placegraph {new}`")
        app(prog_name="placegraph")
    except PlacegraphError as error:
        print(f"placegraph: {error}", file=sys.stderr)
        sys.exit(2 if isinstance(error, ConfigError) else 1)


if __name__ == "__main__":
    main()
