"""Where a robot can stand to face an object: near it, in the same room, with nothing higher than it in between.

The paper has no such step.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from placegraph.nodes.hierarchy.traversability import LEVEL_M, TraversabilityConfig, TraversabilityMap
from placegraph.runtime.arrays import F64, U8, Bool, Points

MAX_TRIED = 400  # nearest cells that are tried; an object that none of them sees is taken to be hidden
OWN_M = 0.1  # around its footprint an object does not hide itself; two cells


@dataclass(frozen=True, eq=False)
class ApproachTarget:
    """An object as seen from above: footprint (K, 2), centre (3,); metres, world frame."""

    footprint: Points
    center: F64


@dataclass(frozen=True)
class ApproachCell:
    """A cell (row, column) to stand in, and the yaw from there to the object."""

    cell: tuple[int, int]
    yaw_rad: float


def find_approach(
    target: ApproachTarget,
    room_cells: Bool,
    reachable: Bool,
    floor: TraversabilityMap,
    config: TraversabilityConfig,
) -> ApproachCell | None:
    """The cell nearest to an object's centre from which a robot can face it; None where there is none.

    room_cells: (H, W) where the robot can stand in the object's room; reachable: those that a path leads to, which are
    preferred.
    """
    cell_m, origin = floor.grid.cell_m, floor.grid.origin
    far = config.reach_m + 2 * cell_m
    low = np.floor((target.footprint.min(axis=0) - far - origin) / cell_m).astype(int)
    high = np.ceil((target.footprint.max(axis=0) + far - origin) / cell_m).astype(int)
    (left, top), (right, bottom) = np.clip(low, 0, room_cells.shape[::-1]), np.clip(high, 0, room_cells.shape[::-1])
    window = np.s_[top:bottom, left:right]
    if not room_cells[window].any():
        return None
    corner = origin + np.array([left, top]) * cell_m
    distance = _distance_to_footprint(target.footprint, corner, room_cells[window].shape, cell_m)
    min_distance = config.robot_radius_m + config.margin_m
    near = room_cells[window] & (distance >= min_distance) & (distance <= config.reach_m)
    see_over = _see_over(target, floor.obstacle_levels[window], distance, floor, config)
    center = (target.center[:2] - corner) / cell_m - 0.5  # column, row
    # cells with some room around them come first: positions of obstacles are uncertain by a cell or two
    roomy = floor.clearance_m[window] >= min_distance
    near_reachable = near & reachable[window]
    for candidates in (near_reachable & roomy, near_reachable, near & ~reachable[window]):
        rows, columns = np.nonzero(candidates)
        to_center = np.hypot(columns - center[0], rows - center[1])
        for k in np.lexsort((columns, rows, to_center))[:MAX_TRIED].tolist():
            if _is_visible((int(rows[k]), int(columns[k])), center, see_over):
                ahead = center - (columns[k], rows[k])
                yaw = math.atan2(float(ahead[1]), float(ahead[0]))
                return ApproachCell((int(rows[k]) + int(top), int(columns[k]) + int(left)), yaw)
    return None


def _distance_to_footprint(footprint: Points, corner: F64, shape: tuple[int, ...], cell_m: float) -> F64:
    """(H, W) metres from each cell's centre to the footprint."""
    outside = np.ones(shape, np.uint8)
    corners = np.rint((np.asarray(footprint, float) - corner) / cell_m - 0.5).astype(np.int32)
    cv2.fillPoly(outside, [corners.reshape(-1, 1, 2)], 0)
    return np.asarray(cv2.distanceTransform(outside, cv2.DIST_L2, cv2.DIST_MASK_PRECISE) * cell_m, np.float64)


def _see_over(
    target: ApproachTarget, obstacle_levels: U8, distance: F64, floor: TraversabilityMap, config: TraversabilityConfig
) -> Bool:
    """(H, W) cells over which the object's centre is seen: nothing there is higher, or it is the object itself."""
    # obstacles end at the robot's height, also walls, so higher objects count as that high
    height = min(target.center[2] - floor.low, config.robot_height_m - 2 * LEVEL_M)
    return np.asarray((obstacle_levels * LEVEL_M <= max(height, config.step_m) + LEVEL_M) | (distance <= OWN_M))


def _is_visible(cell: tuple[int, int], center: F64, see_over: Bool) -> bool:
    start, end = np.array(cell, float), center[::-1]
    steps = 2 * int(np.ceil(np.abs(end - start).max())) + 1
    line = np.rint(start + (end - start) * np.linspace(0, 1, steps)[:, None]).astype(np.int64)
    inside = (line >= 0).all(axis=1) & (line < see_over.shape).all(axis=1)
    return bool(see_over[line[inside, 0], line[inside, 1]].all())
