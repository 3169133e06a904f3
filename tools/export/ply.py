"""The points of every node as PLY in a folder, ID.ply, for MeshLab, CloudCompare, Open3D and the like.

A floor has all points between its surface and the next one's; a room those of its floor within its outline, so that
of its walls only the inner faces are there; a location those of its objects; an object its own, in its median colour.
"""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from placegraph.nodes.hierarchy.plan_grid import floor_grid
from placegraph.runtime.arrays import F32, U8, Bool
from placegraph.runtime.errors import SchemaError
from placegraph.runtime.scene_graph import GraphNode, SceneGraph
from placegraph.tools.map_files.map_folder import RGB, make_empty_folder, read_cloud, read_object_clouds
from placegraph.tools.map_files.ply import write_points

Cloud = tuple[F32, U8]  # (P, 3) metres, world frame; (P, 3) sRGB

CELL_M = 0.05  # of the grid on which rooms are drawn to find their points; that of the room layer
BELOW_M = 0.1  # depth below a floor's surface that still belongs to it: noise
GRAY = (128, 128, 128)


def write(folder: Path, graph: SceneGraph, out: Path) -> list[Path]:
    """Write a file for each floor, room, location and object that has points, in the graph's order.

    Raises ConfigError when the folder is not empty, SchemaError when the map's clouds are missing or of another run.
    """
    clouds = _place_clouds(graph, *read_cloud(folder)) | _object_clouds(folder, graph)
    make_empty_folder(out)
    written = []
    for node in graph.nodes.values():
        xyz, rgb = clouds.get(node.id, (np.zeros((0, 3)), np.zeros((0, 3))))
        if len(xyz):
            written.append(out / f"{node.id}.ply")
            write_points(written[-1], xyz, dict(zip(RGB, rgb.T, strict=True)), [f"{node.id} {node.name}"])
    return written


def _place_clouds(graph: SceneGraph, xyz: F32, rgb: U8) -> dict[str, Cloud]:
    floors = sorted(graph.layer("floor"), key=lambda floor: float(floor.box[0, 2]))
    surfaces = np.array([floor.box[0, 2] for floor in floors]) - BELOW_M
    level = np.maximum(np.searchsorted(surfaces, xyz[:, 2], side="right") - 1, 0)
    clouds = {}
    for i, floor in enumerate(floors):
        points, colors = xyz[level == i], rgb[level == i]
        clouds[floor.id] = points, colors
        for room in graph.descendants(floor.id, "room"):
            inside = _inside(points, room)
            clouds[room.id] = points[inside], colors[inside]
    return clouds


def _inside(points: F32, room: GraphNode) -> Bool:
    grid = floor_grid(np.concatenate((points[:, :2], room.footprint)), CELL_M)
    mask = np.zeros(grid.shape, np.uint8)
    corners = np.round((room.footprint - grid.origin) / CELL_M - 0.5).astype(np.int32)
    cv2.fillPoly(mask, [corners.reshape(-1, 1, 2)], 1)
    return np.asarray(mask[grid.cells(points)] > 0)


def _object_clouds(folder: Path, graph: SceneGraph) -> dict[str, Cloud]:
    points = read_object_clouds(folder)
    clouds: dict[str, Cloud] = {}
    for thing in graph.layer("object"):
        if thing.id not in points:
            raise SchemaError(f"{folder}: no points of {thing.id}, which the graph holds; of another run?")
        color = np.array(thing.color or GRAY, np.uint8)
        clouds[thing.id] = points[thing.id], np.tile(color, (len(points[thing.id]), 1))
    for location in graph.layer("location"):
        parts = [clouds[thing.id] for thing in graph.descendants(location.id, "object")]
        if parts:
            clouds[location.id] = np.concatenate([xyz for xyz, _ in parts]), np.concatenate([rgb for _, rgb in parts])
    return clouds
