"""An occupancy map of each floor as ROS's map_server reads it: FLOOR.pgm and FLOOR.yaml in a folder.

Occupied: what a robot up to `MAX_HEIGHT_M` tall would hit. Free: the rest of the rooms. Unknown: everything else.
"""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from placegraph.nodes.hierarchy.plan_grid import PlanGrid, floor_grid
from placegraph.runtime.arrays import F32, U8
from placegraph.runtime.errors import ConfigError
from placegraph.runtime.scene_graph import GraphNode, SceneGraph
from placegraph.tools.map_files.map_folder import make_empty_folder, read_cloud

CELL_M = 0.05
# Heights above the floor of what blocks a robot: below is noise of the floor, above are lamps and lintels. By hand.
MIN_HEIGHT_M, MAX_HEIGHT_M = 0.12, 1.6
FREE, OCCUPIED, UNKNOWN = 254, 0, 205


def write(folder: Path, graph: SceneGraph, out: Path) -> list[Path]:
    """Write a folder. Raises ConfigError when it is not empty, SchemaError when the map holds no cloud."""
    xyz, _ = read_cloud(folder)
    make_empty_folder(out)
    written = []
    for floor in graph.layer("floor"):
        grid, image = occupancy(xyz, floor, graph.descendants(floor.id, "room"))
        picture, description = out / f"{floor.id}.pgm", out / f"{floor.id}.yaml"
        if not cv2.imwrite(str(picture), image[::-1]):
            raise ConfigError(f"--out {out}: cannot write {picture}")
        x, y = np.round(grid.origin, 3).tolist()
        description.write_text(
            f"image: {picture.name}\nresolution: {CELL_M}\norigin: [{x}, {y}, 0.0]\n"
            "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
        )
        written += [picture, description]
    return written


def occupancy(xyz: F32, floor: GraphNode, rooms: list[GraphNode]) -> tuple[PlanGrid, U8]:
    """Grid and image (rows along +y) of one floor from the cloud (P, 3), metres, world frame."""
    above = xyz[:, 2] - floor.box[0, 2]
    solid = xyz[(above > MIN_HEIGHT_M) & (above < MAX_HEIGHT_M) & (xyz[:, 2] < floor.box[1, 2])]
    outlines = [room.footprint for room in rooms]
    grid = floor_grid(np.concatenate([solid[:, :2], floor.box[:, :2], *outlines]), CELL_M)
    image = np.full(grid.shape, UNKNOWN, np.uint8)
    for outline in outlines:
        corners = np.round((outline - grid.origin) / CELL_M - 0.5).astype(np.int32)
        cv2.fillPoly(image, [corners.reshape(-1, 1, 2)], FREE)
    image[grid.cells(solid)] = OCCUPIED
    return grid, image
