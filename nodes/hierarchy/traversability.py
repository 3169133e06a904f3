"""Where a robot can be on one floor: an image of the known free cells, on the grid of the floor's rooms.

A cell is passable when rays crossed it below the robot's height, nothing stands in it, and a floor was seen there, or
when the camera went through it. Unknown cells are not passable. Levels other than the floor's own (split levels,
stairs) are obstacles. The paper has no such step.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from pydantic import BaseModel, Field

from placegraph.nodes.hierarchy.floors import FloorSpan
from placegraph.nodes.hierarchy.plan_grid import PlanGrid, close_gaps
from placegraph.runtime.arrays import F32, F64, I64, U8, Bool, Points

LEVEL_M = 0.1  # step in which heights of obstacles are kept


class TraversabilityConfig(BaseModel, frozen=True, strict=True, extra="forbid"):
    """The robot, and parameters of free space, connections, stairs and approach poses."""

    robot_radius_m: float = Field(default=0.25, gt=0)  # a small service robot; the simulated house's walker has it, too
    robot_height_m: float = Field(default=1.5, gt=0)  # what hangs higher is passed under
    step_m: float = Field(default=0.15, gt=0)  # lower things are noise of the floor, rugs and thresholds
    solid_points: int = Field(default=2, ge=1)  # voxels of a column that make an obstacle
    # A column with less than this share of the fullest column within two cells is the noise of that wall. At .3, doors
    # of two simulated houses come out 4 and 7 cm wider, and .006 less of where the robot may stand is truly free.
    fringe_share: float = Field(default=0.3, ge=0, le=1)
    flat_cells: int = Field(default=7, ge=1, le=9)  # this many of 3 x 3 with a voxel: an obstacle, as a thin table top
    floor_band_m: float = Field(default=0.12, gt=0)  # points this near to the floor's height are of the floor
    close_m: float = Field(default=0.15, ge=0)  # half the width of gaps in the seen floor that are closed
    blind_m: float = Field(default=1.0, ge=0)  # floor this near to the camera's path counts as seen ...
    drop_m: float = Field(default=1.0, gt=0)  # ... unless points this far below it show the edge of a stair
    wall_m: float = Field(default=0.5, gt=0)  # rooms grow this far into a passage to meet there
    entry_m2: float = Field(default=0.1, gt=0)  # minimum standing room on both sides of a connection
    path_gap_m: float = Field(default=1.0, gt=0)  # camera positions further apart are no path
    stand_m: float = Field(default=0.15, gt=0)  # maximum difference from the camera's usual height: under a stair
    stairs_apart_m: float = Field(default=1.0, gt=0)  # climbs whose ends are nearer are one flight of stairs
    stairs_width_max_m: float = Field(default=3.0, gt=0)
    margin_m: float = Field(default=0.1, ge=0)  # between the robot and the object that it faces: two cells
    reach_m: float = Field(default=1.0, gt=0)  # maximum distance from the robot's centre to the object


@dataclass(frozen=True, eq=False)
class TraversabilityMap:
    """One floor: images (H, W) on its grid, rows along +y."""

    grid: PlanGrid
    low: float  # the floor's height, metres
    passable: Bool
    clearance_m: F32  # from a passable cell's centre to the edge of the nearest one that is not; 0 there
    standable: Bool  # where the robot's centre may be
    obstacle_levels: U8  # height of the highest thing below the robot's height, in steps of LEVEL_M from the floor


def compute_traversability(
    points_world: Points,
    drop_off_points_world: Points,
    free_points_world: Points,
    free_cell_m: float,
    path_segments_world: F64,
    grid: PlanGrid,
    span: FloorSpan,
    config: TraversabilityConfig,
) -> TraversabilityMap:
    """Where a robot can be on one floor.

    points_world (P, 3) and free_points_world (F, 3), centres of cells seen through, of the floor's zone;
    drop_off_points_world: (Q, 3), see `drop_off_points`; path_segments_world: (K, 2, 3) of the camera's path on this
    floor. All metres, world frame; free_cell_m: size of the free cells in plan.
    """
    above = points_world[:, 2] - span.low_m
    solid = (above > config.step_m) & (above < config.robot_height_m)
    obstacle_points = points_world[solid]
    obstacle = _obstacles(_count(obstacle_points, grid), config)
    path = _path_cells(path_segments_world, grid)
    free = _free_cells(free_points_world, free_cell_m, grid, span, config)
    floor_points = points_world[np.abs(above) <= config.floor_band_m]
    floor = close_gaps(grid.image(floor_points), round(config.close_m / grid.cell_m))
    floor |= _blind_spots(path, drop_off_points_world, grid, config)
    # the camera was carried here: the robot's width around its path is free, too, where nothing was seen to stand
    crossed = _dilate(path, config.robot_radius_m / grid.cell_m + 1)
    passable = ((floor & free) | crossed) & ~obstacle | path
    clearance = _clearance(passable, grid.cell_m)
    levels = _obstacle_levels(obstacle_points, above[solid], grid)
    return TraversabilityMap(grid, span.low_m, passable, clearance, (clearance >= config.robot_radius_m) | path, levels)


def drop_off_points(points_world: Points, span: FloorSpan, config: TraversabilityConfig) -> Points:
    """Of all points (P, 3) those (Q, 3) below the floor that show the ground falling away."""
    z = points_world[:, 2]
    return points_world[(z > span.low_m - config.drop_m) & (z < span.low_m - 2 * config.floor_band_m)]


def _count(points: Points, grid: PlanGrid) -> I64:
    rows, columns = grid.cells(points)
    flat = np.bincount(rows * grid.shape[1] + columns, minlength=grid.shape[0] * grid.shape[1])
    return flat.reshape(grid.shape)


def _obstacle_levels(points: Points, above_m: Points, grid: PlanGrid) -> U8:
    image = np.zeros(grid.shape, np.uint8)
    levels = np.ceil(above_m / LEVEL_M).astype(np.uint8)
    order = np.argsort(levels, kind="stable")  # of several values for a cell the last stays: the highest
    image[grid.cells(points[order])] = levels[order]
    return image


def _obstacles(count: I64, config: TraversabilityConfig) -> Bool:
    """Cells that something stands in or hangs over, from the number of voxels in their columns."""
    around = cv2.boxFilter((count > 0).astype(np.float32), -1, (3, 3), normalize=False)
    fullest = cv2.dilate(count.astype(np.float32), np.ones((5, 5), np.uint8))
    occupied = (count > 0) & (count >= config.fringe_share * fullest)
    return np.asarray(occupied & ((count >= config.solid_points) | (around > config.flat_cells - 0.5)))


def _path_cells(segments: F64, grid: PlanGrid) -> Bool:
    """The cells under the segments of a path (K, 2, 3)."""
    image = np.zeros(grid.shape, np.uint8)
    for (row0, row1), (column0, column1) in zip(
        *(axis.reshape(-1, 2).tolist() for axis in grid.cells(segments.reshape(-1, 3))), strict=True
    ):
        cv2.line(image, (column0, row0), (column1, row1), 1, 1)
    return image > 0


def _free_cells(points: Points, cell_m: float, grid: PlanGrid, span: FloorSpan, config: TraversabilityConfig) -> Bool:
    above = points[:, 2] - span.low_m
    return grid.image(points[(above > 0) & (above < config.robot_height_m)], cell_m) > 0


def _blind_spots(path: Bool, drop_offs: Points, grid: PlanGrid, config: TraversabilityConfig) -> Bool:
    """Cells near the path, except where the ground falls away: a downward stair shows its treads and sides."""
    drop = _dilate(grid.image(drop_offs) > 0, config.close_m / grid.cell_m)
    return _dilate(path, config.blind_m / grid.cell_m) & ~drop


def _dilate(mask: Bool, cells: float) -> Bool:
    distance = cv2.distanceTransform((~mask).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    return np.asarray(distance <= cells) & bool(mask.any())


def _clearance(passable: Bool, cell_m: float) -> F32:
    padded = np.pad(passable, 1).astype(np.uint8)  # beyond the grid nothing is known
    distance = cv2.distanceTransform(padded, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)[1:-1, 1:-1]
    # an obstacle begins half a cell before its cell's centre
    return np.where(passable, distance * cell_m - cell_m / 2, 0).astype(np.float32)
