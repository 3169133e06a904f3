"""Floor plans as one SVG: a drawing a floor, in metres: rooms, locations, objects, doors and stairs."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape
from pathlib import Path

import numpy as np

from placegraph.runtime.scene_graph import GraphNode, SceneGraph
from placegraph.runtime.scene_graph.place_graph import Connection

MARGIN_M = 0.6
TITLE_M = 0.7
TINTS = ("#dfe9f5", "#f6e7d3", "#e2eeda", "#eadff3", "#d6eeee", "#f3dfe6", "#ecebe3", "#e4efcf")
STYLE = (
    "text{font-family:sans-serif;text-anchor:middle;fill:#343236}"
    ".room{stroke:#4a484e;stroke-width:.06}"
    ".location{fill:none;stroke:#7a8fb0;stroke-width:.03;stroke-dasharray:.12 .08}"
    ".object{fill:#ffffffb0;stroke:#d6425f;stroke-width:.02}"
    ".door{fill:#d642b5a0;stroke:none}.stairs{stroke:#d6425f;stroke-width:.08}"
    ".title{font-size:.34px}.place{font-size:.24px;font-weight:bold}.name{font-size:.13px}"
)


def write(_: Path, graph: SceneGraph, out: Path) -> list[Path]:
    """Write the file; equal graphs give equal bytes."""
    out.write_text(drawing(graph), encoding="utf-8")
    return [out]


def drawing(graph: SceneGraph) -> str:
    """SVG of all floors, the lowest first; a unit is a metre, north (+y) is up."""
    floors = sorted(graph.layer("floor"), key=lambda floor: float(floor.box[0, 2]))
    parts: list[str] = []
    right, height = 0.0, TITLE_M
    for floor in floors:
        low, high = _extent(graph, floor)
        width, depth = (high - low + 2 * MARGIN_M).tolist()
        # x right from the sheet's corner, y down from the highest point
        x, y = right + MARGIN_M - low[0], TITLE_M + MARGIN_M + high[1]
        parts.append(f'<g transform="translate({x:.3f} {y:.3f}) scale(1 -1)">')
        parts += list(_shapes(graph, floor))
        parts.append("</g>")
        parts += list(_labels(graph, floor, x, y))
        parts.append(_text("title", right + width / 2, TITLE_M, f"{floor.id} {floor.name}"))
        right, height = right + width, max(height, TITLE_M + depth)
    size = f'viewBox="0 0 {right:.3f} {height:.3f}" width="{right * 60:.0f}" height="{height * 60:.0f}"'
    head = f'<svg xmlns="http://www.w3.org/2000/svg" {size}>'
    return "\n".join([head, f"<style>{STYLE}</style>", *parts, "</svg>", ""])


def _extent(graph: SceneGraph, floor: GraphNode) -> tuple[np.ndarray, np.ndarray]:
    boxes = np.array([node.box[:, :2] for node in [floor, *graph.descendants(floor.id, "room")]])
    return boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)


def _shapes(graph: SceneGraph, floor: GraphNode) -> Iterator[str]:
    for k, room in enumerate(graph.descendants(floor.id, "room")):
        yield _polygon("room", room, f' fill="{TINTS[k % len(TINTS)]}"')
    for location in graph.descendants(floor.id, "location"):
        yield _polygon("location", location)
    for thing in graph.descendants(floor.id, "object"):
        yield _polygon("object", thing)
    for connection in graph.connections.values():
        for room_id, end in zip(connection.rooms, connection.ends, strict=True):
            if graph.nodes[room_id].parent == floor.id:
                yield _passage(connection, end)
                if connection.kind != "stairs":  # both ends are the same, on the same floor
                    break


def _labels(graph: SceneGraph, floor: GraphNode, x: float, y: float) -> Iterator[str]:
    for thing in graph.descendants(floor.id, "object"):
        yield _text("name", x + thing.center[0], y - thing.center[1], thing.name)
    for room in graph.descendants(floor.id, "room"):
        yield _text("place", x + room.center[0], y - room.center[1], f"{room.id} {room.name}")


def _passage(connection: Connection, end: np.ndarray) -> str:
    """A disc of the passage's width; for stairs a line in plan from this floor's end to the other's."""
    title = f"<title>{escape(f'{connection.id} {connection.kind}')}</title>"
    if connection.kind != "stairs":
        x, y, radius = end[0], end[1], connection.width_m / 2
        return f'<circle class="door" cx="{x:.3f}" cy="{y:.3f}" r="{radius:.3f}">{title}</circle>'
    (x0, y0), (x1, y1) = connection.ends[:, :2].tolist()
    return f'<line class="stairs" x1="{x0:.3f}" y1="{y0:.3f}" x2="{x1:.3f}" y2="{y1:.3f}">{title}</line>'


def _polygon(kind: str, node: GraphNode, more: str = "") -> str:
    points = " ".join(f"{x:.3f},{y:.3f}" for x, y in node.footprint.tolist())
    title = f"<title>{escape(f'{node.id} {node.name}')}</title>"
    return f'<polygon class="{kind}" points="{points}"{more}>{title}</polygon>'


def _text(kind: str, x: float, y: float, text: str) -> str:
    return f'<text class="{kind}" x="{x:.3f}" y="{y:.3f}">{escape(text)}</text>'
