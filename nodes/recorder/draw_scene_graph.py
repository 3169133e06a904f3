"""Draw the scene graph (outlines of floors, rooms and locations, connections, the tree), questions and answers."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import rerun as rr

from placegraph.nodes.recorder.draw_map import named_box
from placegraph.nodes.recorder.drawing import Canvas, Color, color_of, markdown
from placegraph.runtime import messages as m
from placegraph.runtime.errors import SchemaError
from placegraph.runtime.scene_graph import GraphNode, SceneGraph

COLUMN_PX, ROW_PX = 150.0, 26.0  # the drawn tree: layers from left to right, leaves from top to bottom
LAYER_COLORS: dict[str, Color] = {
    "building": (230, 230, 230),
    "floor": (150, 170, 255),
    "room": (110, 220, 140),
    "location": (255, 190, 80),
}
OUTLINE_GROUPS = {"floor": "floors", "room": "rooms", "location": "locations"}
OUTLINE_RAISE_M = {"floor": 0.0, "room": 0.02, "location": 0.04}  # above the floor, so that none hides another
OUTLINE_RADIUS_M = {"floor": 0.01, "room": 0.02, "location": 0.012}
CONNECTION_COLORS: dict[str, Color] = {"door": (255, 120, 220), "opening": (255, 180, 235), "stairs": (255, 90, 90)}
ROUTE_SEGMENT_COLOR: Color = (200, 120, 190)
CONNECTION_RAISE_M = 0.06
ANSWER_COLOR: Color = (255, 230, 0)


def draw_graph(canvas: Canvas, graph: m.Graph | m.NamedGraph, pngs: dict[str, bytes]) -> None:
    """Outlines in the world and the whole tree; both replace those of the last graph."""
    scene = SceneGraph.from_json(graph.json, f"{type(graph).__name__} of revision {graph.revision}")
    outlines = {
        f"world/{OUTLINE_GROUPS[node.layer]}/{node.id}": _outline(node)
        for node in scene.nodes.values()
        if node.layer in OUTLINE_GROUPS
    }
    canvas.replace("outlines", outlines)
    draw_connections(canvas, scene)
    nodes = list(scene.nodes.values())
    positions = _tree_positions(scene)
    drawn = rr.GraphNodes(
        [node.id for node in nodes],
        positions=[positions[node.id] for node in nodes],
        labels=[_label(node) for node in nodes],
        colors=[LAYER_COLORS.get(node.layer) or color_of(node.name) for node in nodes],
        show_labels=True,
    )
    edges = rr.GraphEdges([(node.parent, node.id) for node in nodes if node.parent], graph_type="directed")
    canvas.log("graph", drawn, edges)


def draw_connections(canvas: Canvas, scene: SceneGraph) -> None:
    """Doors and openings as discs of their width, stairs as lines, route segments as thin lines."""
    drawn: dict[str, Any] = {}
    for connection in scene.connections.values():
        style: dict[str, Any] = {
            "colors": [CONNECTION_COLORS[connection.kind]],
            "labels": [f"{connection.id} {connection.kind}"],
            "show_labels": True,
        }
        ends = connection.ends + np.array([0, 0, CONNECTION_RAISE_M])
        path = f"world/connections/{connection.id}"
        if connection.kind == "stairs":
            drawn[path] = rr.LineStrips3D([ends], radii=[0.03], **style)
        else:
            half_sizes = np.array([[connection.width_m / 2, connection.width_m / 2, 0.01]])
            drawn[path] = rr.Ellipsoids3D(centers=ends[:1], half_sizes=half_sizes, **style)
    if scene.route_segments:
        strips = [
            np.column_stack(
                (segment.points, np.full(len(segment.points), scene.nodes[segment.room].box[0, 2] + CONNECTION_RAISE_M))
            )
            for segment in scene.route_segments
        ]
        drawn["world/ways"] = rr.LineStrips3D(strips, colors=[ROUTE_SEGMENT_COLOR], radii=[0.006])
    canvas.replace("connections", drawn)


def _label(node: GraphNode) -> str:
    return f"{node.id} {node.name}" if node.layer != "object" else f"{node.name} {node.id}"


def _outline(node: GraphNode) -> rr.LineStrips3D:
    (x0, y0, z0), (x1, y1, _) = node.box.tolist()
    corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
    outline = node.footprint.tolist() if len(node.footprint) >= 3 else corners
    strip = [(x, y, z0 + OUTLINE_RAISE_M[node.layer]) for x, y in [*outline, outline[0]]]
    return rr.LineStrips3D(
        [strip],
        colors=[LAYER_COLORS[node.layer]],
        radii=[OUTLINE_RADIUS_M[node.layer]],
        labels=[_label(node)],
        show_labels=True,
    )


def _tree_positions(scene: SceneGraph) -> dict[str, tuple[float, float]]:
    """Position (px) of each node in the drawn tree: a leaf has its own row, a parent the middle row of its children."""
    columns = {"building": 0, "floor": 1, "room": 2, "location": 3, "object": 4}
    positions: dict[str, tuple[float, float]] = {}
    rows = 0.0

    def place(node: GraphNode) -> float:
        nonlocal rows
        children = [place(child) for child in scene.children(node.id)]
        row = float(np.mean((children[0], children[-1]))) if children else rows
        if not children:
            rows += 1
        positions[node.id] = (columns[node.layer] * COLUMN_PX, row * ROW_PX)
        return row

    place(scene.building)
    return positions


def draw_question(canvas: Canvas, question: m.Question, pngs: dict[str, bytes]) -> None:
    """The question, until its answer comes."""
    canvas.questions[question.question_id] = question.text
    canvas.log("log/questions", rr.TextLog(f"{question.question_id}: {question.text}", level=rr.TextLogLevel.INFO))
    text = f"{markdown(question.text)}\n\n(thinking)"
    canvas.log("answers", rr.TextDocument(text, media_type="text/markdown"))


def draw_answer(canvas: Canvas, answer: m.Answer, pngs: dict[str, bytes]) -> None:
    """The answer as text, and a bright box around the object. Raises SchemaError if the reply is not a JSON object."""
    try:
        reply = json.loads(answer.json)
    except json.JSONDecodeError as error:
        raise SchemaError(f"Answer {answer.question_id}: not JSON: {error}") from None
    if not isinstance(reply, dict):
        raise SchemaError(f"Answer {answer.question_id}: expected a JSON object, found {type(reply).__name__}")
    question = canvas.questions.pop(answer.question_id, "") or str(reply.get("question", answer.question_id))
    canvas.log("answers", rr.TextDocument(_answer_text(question, reply), media_type="text/markdown"))
    outcome = str(reply.get("object_id") or reply.get("status", ""))
    canvas.log("log/questions", rr.TextLog(f"{answer.question_id}: {outcome}", level=rr.TextLogLevel.INFO))
    boxes = {}
    if reply.get("object_id") and reply.get("box"):
        low, high = np.array(reply["box"], float)
        oriented = np.array([*(low + high) / 2, *(high - low) + 0.06, 0.0])
        label = f"ANSWER: {reply.get('name', 'object')} {reply['object_id']}"
        boxes = {"world/answer": named_box(oriented, label, ANSWER_COLOR, radius_m=0.02)}
    canvas.replace("answer", boxes)


def _answer_text(question: str, reply: dict[str, Any]) -> str:
    lines = [markdown(question), ""]
    if reply.get("object_id"):
        sure = "" if reply.get("sure", True) else " (not sure)"
        lines.append(f"### {markdown(str(reply.get('name', 'object')))} {markdown(str(reply['object_id']))}{sure}")
        path = [f"{markdown(str(step.get('name', '')))} {step.get('id', '')}" for step in reply.get("path", ())]
        lines += ["", " › ".join(path)] if path else []
    else:
        lines.append(f"### {markdown(str(reply.get('status', 'no answer')).replace('_', ' '))}")
    if reply.get("error"):
        lines += ["", markdown(str(reply["error"]))]
    lines += ["", *(f"- {markdown(str(sentence))}" for sentence in reply.get("evidence", ()))]
    others = [c for c in reply.get("candidates", ()) if c.get("id") != reply.get("object_id")]
    if others:
        named = ", ".join(f"{markdown(str(c.get('name', '')))} {c.get('id')} ({c.get('score', 0):.2f})" for c in others)
        lines += ["", f"Others: {named}"]
    return "\n".join(lines)
