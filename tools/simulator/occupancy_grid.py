"""Where a robot can be on a floor, on a grid: room floors and doorways minus walls, furniture and stair wells.

The centre of cell [row, column] is at `origin + (column + 0.5, row + 0.5) * cell_m`, world frame.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from placegraph.runtime.arrays import F64, Bool
from placegraph.runtime.errors import ConfigError
from placegraph.tools.simulator.house_model import Floor, House, PlacedItem, Wall, WallOpening

LOW_M, HIGH_M = 0.03, 1.6  # above the floor; lower items are stepped over, higher ones passed under
PASSAGE_KINDS = ("door", "archway")


def free_grid(house: House, floor_index: int, cell_m: float = 0.05, radius_m: float = 0.25) -> tuple[F64, Bool]:
    """Where the centre of a robot may be: origin (2,) in metres, world frame, and mask (rows along y, columns along x).

    Raises ConfigError when the house has no such floor.
    """
    origin, walkable = unfurnished_grid(house, floor_index, cell_m)
    floor = house.floors[floor_index]
    for placed in house.items:
        if blocks_robot(placed, floor):
            walkable[
                cells_in_polygon(expand_rectangle(placed.footprint, cell_m / 2), origin, walkable.shape, cell_m)
            ] = False
    return origin, erode_by_radius(walkable, cell_m, radius_m)


def unfurnished_grid(house: House, floor_index: int, cell_m: float) -> tuple[F64, Bool]:
    """The walkable floor without items and without robot radius: origin (2,) and mask."""
    if not 0 <= floor_index < len(house.floors):
        raise ConfigError(f"house {house.seed} has no floor {floor_index}; it has {len(house.floors)}")
    floor = house.floors[floor_index]
    corners = np.concatenate([floor.outline, *(room.polygon for room in floor.rooms)])
    origin = corners.min(axis=0) - 0.5
    columns, rows = np.ceil((corners.max(axis=0) + 0.5 - origin) / cell_m).astype(int).tolist()
    walkable = np.zeros((rows, columns), bool)
    for room in floor.rooms:
        walkable[cells_in_polygon(room.polygon, origin, walkable.shape, cell_m)] = True
    walkable &= ~_wall_cells(house, floor, origin, walkable.shape, cell_m)
    for wall in floor.walls:
        for opening in wall.openings:
            if opening.kind in PASSAGE_KINDS:
                walkable[
                    cells_in_polygon(opening_rectangle(wall, opening, 0.03, 0.05), origin, walkable.shape, cell_m)
                ] = True
    for stairs in house.stairs:
        if stairs.floor == floor_index - 1:
            walkable[cells_in_polygon(stairs.hole, origin, walkable.shape, cell_m)] = False
    return origin, walkable


def opening_rectangle(wall: Wall, opening: WallOpening, beyond_m: float = 0.0, inset_m: float = 0.0) -> F64:
    """The (4, 2) ground corners of an opening: through the wall and `beyond_m` out on both sides, counterclockwise."""
    a, along = np.array(wall.a), wall.direction
    across = np.array([-along[1], along[0]]) * (wall.thickness_m / 2 + beyond_m)
    start, end = a + along * (opening.start_m + inset_m), a + along * (opening.end_m - inset_m)
    return np.stack([start - across, end - across, end + across, start + across])


def blocks_robot(placed: PlacedItem, floor: Floor) -> bool:
    """Whether any of an item is between LOW_M and HIGH_M above the floor."""
    low, high = placed.item.extent[:, 2] + placed.z - floor.z_m
    return bool(low < HIGH_M and high > LOW_M)


def cells_in_polygon(
    polygon: F64, origin: F64, shape: tuple[int, ...], cell_m: float
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Rows and columns of the cells whose middle lies in a polygon (N, 2), world frame."""
    low = np.clip(np.floor((polygon.min(axis=0) - origin) / cell_m).astype(int), 0, [shape[1], shape[0]])
    high = np.clip(np.ceil((polygon.max(axis=0) - origin) / cell_m).astype(int), 0, [shape[1], shape[0]])
    rows, columns = np.mgrid[low[1] : high[1], low[0] : high[0]]
    middles = np.stack((columns + 0.5, rows + 0.5), axis=-1) * cell_m + origin
    hit = points_in_polygon(polygon, middles)
    return rows[hit], columns[hit]


def expand_rectangle(footprint: F64, by_m: float) -> F64:
    """A rectangle's corners (4, 2), counterclockwise, moved outward, so that a thin door leaf covers whole cells."""
    sides = np.roll(footprint, -1, axis=0) - footprint
    ways = sides / np.linalg.norm(sides, axis=1, keepdims=True)
    return np.asarray(footprint + (np.roll(ways, 1, axis=0) - ways) * by_m)


def points_in_polygon(polygon: F64, points: F64) -> Bool:
    """Which of the points (..., 2) are in a polygon (N, 2), by the parity of crossings."""
    x, y = points[..., 0], points[..., 1]
    result = np.zeros(points.shape[:-1], bool)
    for (ax, ay), (bx, by) in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        if ay != by:
            result ^= ((ay > y) != (by > y)) & (x < (bx - ax) * (y - ay) / (by - ay) + ax)
    return result


def erode_by_radius(walkable: Bool, cell_m: float, radius_m: float) -> Bool:
    """Cells whose centre is at least `radius_m` from everything that is not walkable."""
    padded = np.pad(walkable, 1).astype(np.uint8)  # nothing outside the grid is walkable
    distance = cv2.distanceTransform(padded, cv2.DIST_L2, 5)[1:-1, 1:-1] * cell_m
    return np.asarray(distance >= radius_m + cell_m / 2)  # an obstacle begins half a cell before its cell's middle


def _wall_cells(house: House, floor: Floor, origin: F64, shape: tuple[int, ...], cell_m: float) -> Bool:
    """Cells crossed by a vertical face of the building at the height of a robot, pilasters and parapets included."""
    triangles = np.concatenate([np.zeros((0, 3, 3)), *(part.vertices[part.faces] for part in house.structure)])
    heights = triangles[..., 2] - floor.z_m
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    upright = np.abs(normal[:, 2]) < 0.3 * np.linalg.norm(normal, axis=1)
    ground = triangles[upright & (heights.min(axis=1) < HIGH_M) & (heights.max(axis=1) > LOW_M)][..., :2]
    crossed = np.zeros(shape, bool)
    sides = np.concatenate((ground[:, [0, 1]], ground[:, [1, 2]], ground[:, [2, 0]]))
    if not len(sides):
        return crossed
    steps = int(np.ceil(np.linalg.norm(sides[:, 1] - sides[:, 0], axis=1).max() / cell_m * 2)) + 1
    for share in np.linspace(0, 1, steps):  # dense enough to hit every cell of the longest side
        points = sides[:, 0] * (1 - share) + sides[:, 1] * share
        columns, rows = np.floor((points - origin) / cell_m).astype(int).T
        in_grid = (rows >= 0) & (rows < shape[0]) & (columns >= 0) & (columns < shape[1])
        crossed[rows[in_grid], columns[in_grid]] = True
    return crossed
