"""Floors and rooms of a point cloud that another system made: metres, z up, without a camera path or free space.

Only where there are points, something was observed. The hierarchy needs a camera path to tell floors from other level
surfaces; here it is replaced by every place where a person could stand, a surface with a storey's height of free space.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from placegraph.nodes.hierarchy.floors import FloorConfig, FloorSpan, find_floors
from placegraph.nodes.hierarchy.plan_grid import PlanGrid
from placegraph.nodes.hierarchy.rooms import RoomArea, RoomConfig, find_rooms
from placegraph.runtime.arrays import F64
from placegraph.runtime.errors import ConfigError, SourceError
from placegraph.tools.map_files.ply import points_of, read_vertices

VOXEL_M = 0.05  # of our own maps' clouds, on which the room layer was tuned
COLUMN_M = 0.2  # plan cells in which heights are compared: wide enough that a sparse scan has ceiling points
EYE_HEIGHT_M = 1.2  # above the surface: the middle of the camera heights that FloorConfig allows
MIN_HEIGHT_PERCENT = 1.0  # of the standpoints: lower ones are noise; chosen by hand
MAX_EXTENT_M = 500.0  # a larger cloud is not a building, or not in metres
MAX_CELLS = 10_000  # a side: label images of 10^8 pixels


@dataclass(frozen=True, eq=False)
class FloorRooms:
    """One floor of a cloud: its heights, the grid of its label image, its rooms, largest first."""

    span: FloorSpan
    grid: PlanGrid
    rooms: list[RoomArea]


def read_point_cloud(path: Path) -> F64:
    """Points (N, 3), N >= 1, in metres of a PLY file. Raises SchemaError (damaged), SourceError (no building)."""
    xyz = points_of(read_vertices(path), path)
    if not len(xyz):
        raise SourceError(f"{path}: holds no points")
    size = np.ptp(xyz, axis=0)
    if size.max() > MAX_EXTENT_M:
        raise SourceError(f"{path}: its points lie {size.max():.0f} m apart: a building in metres was expected")
    return xyz


def voxel_centroids(xyz: F64, voxel_m: float) -> F64:
    """The centroid (P, 3) of the points (N, 3), N >= 1, in each occupied voxel, in metres."""
    cells = np.floor((xyz - xyz.min(axis=0)) / voxel_m).astype(np.int64)
    _, voxel, counts = np.unique(
        np.ravel_multi_index(tuple(cells.T), tuple(cells.max(axis=0) + 1)), return_inverse=True, return_counts=True
    )
    return np.stack([np.bincount(voxel, xyz[:, i]) / counts for i in range(3)], axis=1)


def floors_of_cloud(xyz: F64, cell_m: float) -> list[FloorRooms]:
    """Floors of a cloud (N, 3), N >= 1, metres, z up, from the lowest, with rooms on grids of `cell_m`.

    Source: nodes/hierarchy/floors.py and rooms.py with their defaults. Raises ConfigError for cells too small.
    """
    if not (cell_m > 0 and np.isfinite(cell_m)):
        raise ConfigError(f"--resolution: {cell_m} metres a pixel is not a positive length")
    size_m = float(np.ptp(xyz, axis=0).max())
    if size_m > MAX_CELLS * cell_m:
        raise ConfigError(f"--resolution: {size_m:.1f} m in pixels of {cell_m} m are more than {MAX_CELLS} a side")
    config, floor_config = RoomConfig(cell_m=cell_m), FloorConfig()
    xyz = voxel_centroids(xyz, min(VOXEL_M, cell_m))
    eyes, no_free_space = standpoints(xyz, floor_config), np.zeros((0, 3))
    if len(eyes):  # drop what lies below the lowest standpoints: foundations, the underside of a mesh
        xyz = xyz[
            xyz[:, 2] > np.percentile(eyes[:, 2], MIN_HEIGHT_PERCENT) - EYE_HEIGHT_M - floor_config.separation_m / 2
        ]
    floors = []
    for span in find_floors(xyz, eyes, floor_config):
        points = xyz[(xyz[:, 2] >= span.zone_low_m) & (xyz[:, 2] <= span.zone_high_m)]
        floors.append(FloorRooms(span, *find_rooms(points, no_free_space, cell_m, span, config)))
    return floors


def standpoints(xyz: F64, config: FloorConfig) -> F64:
    """Eye points (K, 3) above every place of a cloud (P, 3) where a person could stand: metres, z up.

    Such a place is a point without another one for `storey_m` above it in its column. The cloud must reach that high
    above it somewhere, which excludes roofs and the tops of walls. Source: ours.
    """
    columns = np.floor(xyz[:, :2] / COLUMN_M)
    order = np.lexsort((xyz[:, 2], columns[:, 1], columns[:, 0]))
    points, columns = xyz[order], columns[order]
    same = (columns[1:] == columns[:-1]).all(axis=1)
    clear = np.append(np.where(same, np.diff(points[:, 2]), np.inf), np.inf)
    clear = np.minimum(clear, np.percentile(points[:, 2], 99.5) - points[:, 2])
    return np.asarray(points[clear >= config.storey_m] + np.array([0.0, 0.0, EYE_HEIGHT_M]))
