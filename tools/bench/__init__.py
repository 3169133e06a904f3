"""`placegraph bench`: what the parts cost, how costs grow with the map, and whether hostile requests break replies."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from placegraph.tools.bench.map_growth import drawing, grow, growth_table, p95_by_floor
from placegraph.tools.bench.node_costs import measure, table
from placegraph.tools.bench.reply_contract import fuzz


def bench(
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
    growth: Annotated[
        Path | None, typer.Option(help="Instead: draw (SVG) what keyframes cost as a generated building is mapped.")
    ] = None,
    floors: Annotated[int, typer.Option(min=1, help="Of that building.")] = 10,
    rooms: Annotated[int, typer.Option(min=1, help="Of each of its floors.")] = 20,
    requests: Annotated[
        int, typer.Option("--fuzz", min=0, help="Instead: put so many broken and hostile requests to the reasoner.")
    ] = 0,
    mode: Annotated[str, typer.Option(help="Of those requests: program, rules or deductive.")] = "program",
    seed: Annotated[int, typer.Option(min=0, help="Of those requests and of the house they are about.")] = 0,
) -> None:
    """Measure each part on this machine: times, and ratios to baselines of the same run. Takes under a minute.

    Times are CPU time, for the bus elapsed time, medians of many. They differ between machines; ratios say whether a
    part has become worse. With --fuzz the exit status is 1 when a reply broke its contract.
    """
    if growth is not None:
        samples = grow(floors, rooms)
        growth.write_text(drawing(samples, rooms), encoding="utf-8")
        p95 = p95_by_floor(samples)
        document = {"p95_ms": p95, "keyframes": len(samples), "voxels": samples[-1].voxels, "ratio": p95[-1] / p95[0]}
        print(json.dumps(document, indent=1) if as_json else growth_table(samples))
        return
    if requests:
        outcome = fuzz(requests, mode=mode, seed=seed)
        print(json.dumps(outcome.document(), indent=1))
        if outcome.faults:
            raise typer.Exit(1)
        return
    costs = measure()
    if as_json:
        print(json.dumps([asdict(cost) | {"ratio": cost.ratio} for cost in costs], indent=1))
    else:
        print(table(costs))
