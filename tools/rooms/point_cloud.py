"""Floors and rooms of a point cloud that another system made: metres, z up, no camera path and no free space.

What was observed is what holds points. Which layer is a floor is told in the hierarchy by the camera's path; of a cloud
that is stood in for by every place where someone could stand: a surface with a storey's height of nothing above it.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from placegraph.nodes.hierarchy.floors import FloorConfig, FloorSpan, find_floors
from placegraph.nodes.hierarchy.rooms import Grid, RoomArea, RoomConfig, find_rooms
from placegraph.runtime.arrays import F64
from placegraph.runtime.errors import ConfigError, SourceError
from placegraph.tools.map_files.ply import points_of, read_vertices

VOXEL_M = 0.05  # of the map's cloud, METHOD section 2
COLUMN_M = 0.2  # plan cells in which surfaces lie above each other: wide enough for a thin scan to show a ceiling
EYE_M = 1.2  # above what is stood on: midway in the heights that a camera may have (FloorConfig)
LOWEST_PERCENT = 1.0  # of the places to stand; fewer and lower ones are noise
LARGEST_M = 500.0  # more is no building, or not in metres
MAX_CELLS = 10_000  # a side: label images of 10^8 pixels


@dataclass(frozen=True, eq=False)
class FloorRooms:
    """One floor of a cloud: its heights, the grid of its label image, its rooms, largest first."""

    span: FloorSpan
    grid: Grid
    rooms: list[RoomArea]


def read_scan(path: Path) -> F64:
    """Points (N, 3), N >= 1, in metres of a PLY file. Raises SchemaError (damaged), SourceError (no building)."""
    xyz = points_of(read_vertices(path), path)
    if not len(xyz):
        raise SourceError(f"{path}: holds no points")
    size = np.ptp(xyz, axis=0)
    if size.max() > LARGEST_M:
        raise SourceError(f"{path}: its points lie {size.max():.0f} m apart: a building in metres was expected")
    return xyz


def thinned(xyz: F64, voxel_m: float) -> F64:
    """The centroids (P, 3) of points (N, 3), N >= 1, in each voxel that holds any, in metres."""
    cells = np.floor((xyz - xyz.min(axis=0)) / voxel_m).astype(np.int64)
    _, voxel, counts = np.unique(
        np.ravel_multi_index(tuple(cells.T), tuple(cells.max(axis=0) + 1)), return_inverse=True, return_counts=True
    )
    return np.stack([np.bincount(voxel, xyz[:, i]) / counts for i in range(3)], axis=1)


def floors_of_scan(xyz: F64, cell_m: float) -> list[FloorRooms]:
    """Floors of a cloud (N, 3), N >= 1, metres, z up, from the lowest, with rooms on grids of `cell_m`.

    Source: nodes/hierarchy/floors.py and rooms.py with their defaults. Raises ConfigError for cells too small.
    """
    if not (cell_m > 0 and np.isfinite(cell_m)):
        raise ConfigError(f"--resolution: {cell_m} metres a pixel is not a positive length")
    size_m = float(np.ptp(xyz, axis=0).max())
    if size_m > MAX_CELLS * cell_m:
        raise ConfigError(f"--resolution: {size_m:.1f} m in pixels of {cell_m} m are more than {MAX_CELLS} a side")
    config, floor_config = RoomConfig(cell_m=cell_m), FloorConfig()
    xyz = thinned(xyz, min(VOXEL_M, cell_m))
    eyes, nothing = standpoints(xyz, floor_config), np.zeros((0, 3))
    if len(eyes):  # what lies deeper than people stand is no floor: foundations, the underside of a mesh
        xyz = xyz[xyz[:, 2] > np.percentile(eyes[:, 2], LOWEST_PERCENT) - EYE_M - floor_config.separation_m / 2]
    floors = []
    for span in find_floors(xyz, eyes, floor_config):
        points = xyz[(xyz[:, 2] >= span.zone_low) & (xyz[:, 2] <= span.zone_high)]
        floors.append(FloorRooms(span, *find_rooms(points, nothing, cell_m, span, config)))
    return floors


def standpoints(xyz: F64, config: FloorConfig) -> F64:
    """Eye points (K, 3) above every place of a cloud (P, 3) where someone could stand: metres, z up.

    A place is a point with nothing for `storey_m` above it in its column, and with something as high above it anywhere
    in the cloud, or roofs and the tops of walls would carry people. Source: ours.
    """
    columns = np.floor(xyz[:, :2] / COLUMN_M)
    order = np.lexsort((xyz[:, 2], columns[:, 1], columns[:, 0]))
    points, columns = xyz[order], columns[order]
    same = (columns[1:] == columns[:-1]).all(axis=1)
    clear = np.append(np.where(same, np.diff(points[:, 2]), np.inf), np.inf)
    clear = np.minimum(clear, np.percentile(points[:, 2], 99.5) - points[:, 2])
    return np.asarray(points[clear >= config.storey_m] + np.array([0.0, 0.0, EYE_M]))
