"""`placegraph check`: settings, wiring and model files of a dataflow file."""

from __future__ import annotations

import json
import os
import tempfile
from pathlib import Path
from typing import Annotated

import typer

from placegraph.runtime.config import build, read
from placegraph.tools.run import source_settings, with_settings


def check(
    config: Annotated[Path, typer.Argument(metavar="CONFIG", help="A dataflow file.")],
    source: Annotated[Path | None, typer.Option(help="Data set folder or recording to check it with.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the effective settings as JSON.")] = False,
) -> None:
    """Check a dataflow file: build its nodes, load their models, print all settings."""
    os.environ.setdefault("DEPTHAI_LEVEL", "error")  # its warnings go to standard output, amid our JSON
    settings = read(config)
    settings = with_settings(settings, {"camera": source_settings(settings, source)})
    with tempfile.TemporaryDirectory() as folder:  # a recorder opens its file
        dataflow = build(settings, Path(folder))
        for node in dataflow.nodes.values():
            try:
                node.start()
            finally:
                node.stop()
    effective = {name: node.config.model_dump(mode="json") for name, node in dataflow.nodes.items()}
    if as_json:
        print(json.dumps({"run": settings.run.model_dump(), "bus": settings.bus.model_dump(), "nodes": effective}))
        return
    print(f"{config}: {len(effective)} nodes, {'replay' if dataflow.context.lossless else 'live'}")
    for name, values in effective.items():
        print(f"[nodes.{name}]")
        for key, value in values.items():
            print(f"  {key} = {json.dumps(value)}")
