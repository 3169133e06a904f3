"""Where a robot can stand to face an object: near it, in the same room, with nothing higher than it in between.

Source: issue 4, "approach poses". The paper has none.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from placegraph.nodes.hierarchy.traversability import LEVEL_M, Ground, TravelConfig
from placegraph.runtime.arrays import F64, U8, Bool, Points

MAX_TRIED = 400  # nearest cells from which the object is looked at; none of so many: it is taken to be hidden
OWN_M = 0.1  # around its footprint an object is not hidden by itself


@dataclass(frozen=True, eq=False)
class Target:
    """An object as seen from above: footprint (K, 2), middle (3,); metres, world frame."""

    footprint: Points
    middle: F64


@dataclass(frozen=True)
class Stand:
    """A cell (row, column) to stand in, and the yaw from there to the object."""

    cell: tuple[int, int]
    yaw_rad: float


def find_stand(target: Target, here: Bool, reached: Bool, ground: Ground, config: TravelConfig) -> Stand | None:
    """The cell nearest to an object's middle that is right for facing it; None where there is none.

    here: (H, W) the standing cells of the object's room; reached: those of them that a way leads to, which go first.
    """
    cell_m, origin = ground.grid.cell_m, ground.grid.origin
    far = config.reach_m + 2 * cell_m
    low = np.floor((target.footprint.min(axis=0) - far - origin) / cell_m).astype(int)
    high = np.ceil((target.footprint.max(axis=0) + far - origin) / cell_m).astype(int)
    (left, top), (right, bottom) = np.clip(low, 0, here.shape[::-1]), np.clip(high, 0, here.shape[::-1])
    window = np.s_[top:bottom, left:right]
    if not here[window].any():
        return None
    corner = origin + np.array([left, top]) * cell_m
    gap = _gap(target.footprint, corner, here[window].shape, cell_m)
    least = config.robot_radius_m + config.margin_m
    near = here[window] & (gap >= least) & (gap <= config.reach_m)
    clear = _clear(target, ground.tops[window], gap, ground, config)
    middle = (target.middle[:2] - corner) / cell_m - 0.5  # column, row
    # with some room to spare from all else if it can be: what was seen of things is uncertain by a cell or two
    roomy = ground.clearance_m[window] >= least
    here_reached = near & reached[window]
    for allowed in (here_reached & roomy, here_reached, near & ~reached[window]):
        rows, columns = np.nonzero(allowed)
        apart = np.hypot(columns - middle[0], rows - middle[1])
        for k in np.lexsort((columns, rows, apart))[:MAX_TRIED].tolist():
            if _in_sight((int(rows[k]), int(columns[k])), middle, clear):
                ahead = middle - (columns[k], rows[k])
                yaw = math.atan2(float(ahead[1]), float(ahead[0]))
                return Stand((int(rows[k]) + int(top), int(columns[k]) + int(left)), yaw)
    return None


def _gap(footprint: Points, corner: F64, shape: tuple[int, ...], cell_m: float) -> F64:
    """(H, W) metres from each cell's middle to the footprint."""
    outside = np.ones(shape, np.uint8)
    corners = np.rint((np.asarray(footprint, float) - corner) / cell_m - 0.5).astype(np.int32)
    cv2.fillPoly(outside, [corners.reshape(-1, 1, 2)], 0)
    return np.asarray(cv2.distanceTransform(outside, cv2.DIST_L2, cv2.DIST_MASK_PRECISE) * cell_m, np.float64)


def _clear(target: Target, tops: U8, gap: F64, ground: Ground, config: TravelConfig) -> Bool:
    """(H, W) cells over which the object's middle is seen: nothing there is higher, or it is the object itself."""
    # walls have no top: above the robot's height nothing was looked at, so higher objects count as that high
    height = min(target.middle[2] - ground.low, config.robot_height_m - 2 * LEVEL_M)
    return np.asarray((tops * LEVEL_M <= max(height, config.step_m) + LEVEL_M) | (gap <= OWN_M))


def _in_sight(cell: tuple[int, int], middle: F64, clear: Bool) -> bool:
    start, end = np.array(cell, float), middle[::-1]
    steps = 2 * int(np.ceil(np.abs(end - start).max())) + 1
    line = np.rint(start + (end - start) * np.linspace(0, 1, steps)[:, None]).astype(np.int64)
    inside = (line >= 0).all(axis=1) & (line < clear.shape).all(axis=1)
    return bool(clear[line[inside, 0], line[inside, 1]].all())
