"""`placegraph ask`: where something is, in a saved map or a running system."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Annotated, Any

import typer

from placegraph.runtime.bus.session import Bus, BusConfig
from placegraph.runtime.errors import QueryError
from placegraph.runtime.query.request import make_question
from placegraph.tools.query.offline_query import OfflineQuery

NOT_FOUND = 3


def ask(
    where: Annotated[
        str, typer.Argument(metavar="MAP|live", help="A map folder, a graph file, an object list; live: a running one.")
    ],
    text: Annotated[str, typer.Argument(metavar="TEXT", help='What to look for: "the vase near the window upstairs".')],
    as_json: Annotated[bool, typer.Option("--json", help="Print the reply as JSON.")] = False,
    k: Annotated[int, typer.Option(help="How many candidates to list.")] = 5,
    mode: Annotated[
        str, typer.Option(help="program: read by the model; rules: by phrases; deductive: a call for each level.")
    ] = "program",
    pose: Annotated[
        str, typer.Option(help="Where the asker stands: x,y,z[,yaw]; metres, degrees from x, world frame.")
    ] = "",
    endpoint: Annotated[str, typer.Option(help="live: where the hub listens.")] = BusConfig().endpoint,
    prefix: Annotated[str, typer.Option(help="live: first part of the keys.")] = BusConfig().prefix,
    timeout_s: Annotated[float, typer.Option(help="live: how long to wait for the reply.")] = 35.0,
) -> None:
    """Find an object in a saved map, an object list or the running system.

    Exit status: 0 found, 3 not in the map, 1 the question could not be answered, 2 wrong usage.
    """
    asker_pose = _pose(pose)
    question = make_question(text, question_id="Q1", k=k, mode=mode, pose=asker_pose)
    if where == "live":
        request = {"text": question.text, "k": k, "mode": mode, "pose": asker_pose}
        with Bus(BusConfig(endpoint=endpoint, prefix=prefix)) as bus:
            reply = json.loads(bus.ask(json.dumps(request).encode(), timeout_s, "ask"))
    else:
        with OfflineQuery() as query:
            reply = query.ask(Path(where), question)
    print(json.dumps(reply, sort_keys=True) if as_json else _in_words(reply))
    if reply["status"] != "found":
        raise typer.Exit(NOT_FOUND if reply["status"] == "not_in_map" else 1)


def _pose(text: str) -> list[float] | None:
    """x, y, z in metres and the yaw, where there is one, in radians; None without a text."""
    if not text:
        return None
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in (3, 4):
        raise QueryError(f"pose: expected x,y,z or x,y,z,yaw in metres and degrees, world frame, got {text!r}")
    return [*numbers[:3], *map(math.radians, numbers[3:])]


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
            lines.append(f"way:   {' > '.join(map(str, reply['route']))}, {reply['travel_m']} m")
    else:
        lines.append("not in the map")
    parse = reply["parse"] or {}
    if parse.get("text"):
        lines.append(f"read:  {parse['text']}")
    lines += [f"  - {sentence}" for sentence in reply["evidence"]]
    if len(reply["candidates"]) > 1:
        lines.append("candidates: " + ", ".join(f"{c['id']} {c['name']} {c['score']:.2f}" for c in reply["candidates"]))
    return "\n".join(lines)
