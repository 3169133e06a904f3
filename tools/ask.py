"""Ask a saved map or a running system where something is."""

from __future__ import annotations

import json
import math
import time
from pathlib import Path
from typing import Annotated, Any

import typer

from placegraph.runtime.bus import Bus, BusConfig
from placegraph.runtime.errors import QueryError
from placegraph.runtime.messages import Answer, Graph
from placegraph.runtime.node import Context, build_node
from placegraph.runtime.question import make_question
from placegraph.runtime.scene_graph import SceneGraph
from placegraph.tools.map_folder import RUN, find_graph, read_config

NOT_FOUND = 3


def ask(
    where: Annotated[
        str, typer.Argument(metavar="MAP|live", help="A map folder, a graph file, or `live`: the running system.")
    ],
    text: Annotated[
        str, typer.Argument(metavar="TEXT", help='What to look for, e.g. "the vase near the window upstairs".')
    ],
    as_json: Annotated[bool, typer.Option("--json", help="Print the reply as JSON (README, Asking).")] = False,
    k: Annotated[int, typer.Option(help="How many candidates to list.")] = 5,
    mode: Annotated[str, typer.Option(help="program: by rules first; model: by the language model.")] = "program",
    viewpoint: Annotated[str, typer.Option(help="Where the asker stands: x,y,z in metres, world frame.")] = "",
    endpoint: Annotated[str, typer.Option(help="live: where the hub listens.")] = BusConfig().endpoint,
    prefix: Annotated[str, typer.Option(help="live: first part of the keys.")] = BusConfig().prefix,
    timeout_s: Annotated[float, typer.Option(help="live: how long to wait for the reply.")] = 35.0,
) -> None:
    """Find an object in a saved map or in the running system.

    Exit status: 0 found, 3 not in the map, 1 the question could not be answered, 2 wrong usage.
    """
    position = _numbers(viewpoint) if viewpoint else None
    # refuses what no map can answer
    question = make_question(text, question_id="Q1", k=k, mode=mode, viewpoint=position)
    began = time.monotonic()
    if where == "live":
        request = {"text": question.text, "k": k, "mode": mode} | ({"viewpoint": position} if position else {})
        with Bus(BusConfig(endpoint=endpoint, prefix=prefix)) as bus:
            reply = json.loads(bus.ask(json.dumps(request).encode(), timeout_s, "ask"))
    else:
        reply = _ask_map(Path(where), question)
    reply["ms"] = round((time.monotonic() - began) * 1000)
    print(json.dumps(reply, sort_keys=True) if as_json else _in_words(reply))
    if reply["status"] != "found":
        raise typer.Exit(NOT_FOUND if reply["status"] == "not_in_map" else 1)


def _ask_map(path: Path, question: Any) -> dict[str, Any]:
    graph = SceneGraph.load(find_graph(path))
    settings: dict[str, Any] = {}
    context = Context()
    if path.is_dir() and (path / RUN).exists():  # ask the map the way its run would have answered
        config = read_config(path)
        settings = config.nodes.get("grounding", {})
        context = Context(model_dirs=tuple(config.run.model_dirs), threads=config.run.threads)
    node = build_node("grounding", settings, context)
    try:
        node.start()
        node.step(Graph(frame_id=-1, stamp_ns=0, revision=0, final=True, named=True, json=graph.to_json()))
        answers = [message for message in node.step(question) if isinstance(message, Answer)]
    finally:
        node.stop()
    if not answers:
        raise QueryError("the grounding node gave no answer")
    reply: dict[str, Any] = json.loads(answers[0].json)
    return reply


def _numbers(text: str) -> list[float]:
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        raise QueryError(f"viewpoint: expected x,y,z in metres, world frame, got {text!r}") from None
    return [x, y, z]


def _in_words(reply: dict[str, Any]) -> str:
    if reply["status"] == "error":
        return f"error: {reply.get('error', 'unknown')}"
    lines = []
    if reply["status"] == "found":
        low, high = reply["box"]
        path = " > ".join(f"{step['name']} ({step['id']})" for step in reply["path"])
        lines.append(f"{reply['object_id']}  {reply['name']}{'' if reply['sure'] else '  (not sure)'}")
        lines.append(f"where: {path}")
        lines.append(f"box:   {low} to {high} m")
        if reply["approach"]:
            degrees = math.degrees(reply["approach"]["yaw_rad"])
            lines.append(f"stand: at {reply['approach']['position']} m, looking to {degrees:.0f} degrees")
        if reply["route"]:
            lines.append(f"way:   {' > '.join(reply['route'])}, {reply['travel_m']} m")
    else:
        lines.append("not in the map")
    lines += [f"  - {sentence}" for sentence in reply["evidence"]]
    if len(reply["candidates"]) > 1:
        lines.append("candidates: " + ", ".join(f"{c['id']} {c['name']} {c['score']:.2f}" for c in reply["candidates"]))
    return "\n".join(lines)
