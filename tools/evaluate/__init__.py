"""`placegraph evaluate`: maps, networks and grounding against ground truth."""

from __future__ import annotations

import typer

from placegraph.tools.evaluate.grounding_command import evaluate_grounding
from placegraph.tools.evaluate.map_command import evaluate_map
from placegraph.tools.evaluate.networks_command import evaluate_networks

app = typer.Typer(help="Compare maps, networks or answers with ground truth.", no_args_is_help=True)
app.command("map")(evaluate_map)
app.command("networks")(evaluate_networks)
app.command("grounding")(evaluate_grounding)
