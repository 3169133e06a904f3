"""`placegraph bench`: what the parts cost, how costs grow with the map, and whether hostile requests break replies."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from placegraph.tools.bench.map_growth import drawing, grow, growth_table, p95_by_floor
from placegraph.tools.bench.node_costs import cost_table, measure
from placegraph.tools.bench.reply_contract import fuzz

app = typer.Typer(help="Measure costs on this machine, or put hostile requests.", no_args_is_help=True)
Json = Annotated[bool, typer.Option("--json", help="Print JSON.")]


@app.command("nodes")
def bench_nodes(as_json: Json = False) -> None:
    """Measure each part: times, and ratios to baselines of the same run. Takes under a minute.

    Times are medians of CPU time, for the bus of elapsed time. They differ between machines; ratios can be compared.
    """
    costs = measure()
    if as_json:
        print(json.dumps([asdict(cost) | {"ratio": cost.ratio} for cost in costs], indent=1))
    else:
        print(cost_table(costs))


@app.command("growth")
def bench_growth(
    out: Annotated[Path, typer.Argument(metavar="SVG", help="The drawing to write.")],
    floors: Annotated[int, typer.Option(min=1, help="Floors of the building.")] = 10,
    rooms: Annotated[int, typer.Option(min=1, help="Rooms of each floor.")] = 20,
    as_json: Json = False,
) -> None:
    """Measure what keyframes cost as a generated building is mapped room by room."""
    samples = grow(floors, rooms)
    out.write_text(drawing(samples, rooms), encoding="utf-8")
    p95 = p95_by_floor(samples)
    document = {"p95_ms": p95, "keyframes": len(samples), "voxels": samples[-1].voxels, "ratio": p95[-1] / p95[0]}
    print(json.dumps(document, indent=1) if as_json else growth_table(samples))


@app.command("fuzz")
def bench_fuzz(
    requests: Annotated[int, typer.Argument(min=1, help="How many.")] = 2000,
    mode: Annotated[str, typer.Option(help="Of the requests: program, rules or deductive.")] = "program",
    seed: Annotated[int, typer.Option(min=0, help="Of the requests and of the house they are about.")] = 0,
) -> None:
    """Put broken and hostile requests, and check every reply.

    They go to the query server and the grounding node, in this process. Exit status: 1 when a reply broke its contract.
    """
    outcome = fuzz(requests, mode=mode, seed=seed)
    print(json.dumps(outcome.document(), indent=1))
    if outcome.faults:
        raise typer.Exit(1)
