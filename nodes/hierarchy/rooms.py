"""Rooms of one floor from the walls seen from above.

Source: paper, room layer (bird's-eye view, min-max, threshold, walls, distance field, Otsu seeds, watershed), with
HOV-SG's working values. Not as in the paper: a wall is whatever fills a little of the slice's height in a piece of some
length, so that the lintel of a door or archway separates rooms, however few points it has; rooms are limited to what
was observed (rays and points); seeds are the maxima of the distance field that a doorway separates, since Otsu's single
threshold hides a narrow corridor beside a hall.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from pydantic import BaseModel

from placegraph.nodes.hierarchy.floors import FloorSpan
from placegraph.nodes.hierarchy.plan_grid import PlanGrid, close_gaps, floor_grid
from placegraph.nodes.hierarchy.watershed import Neck, watershed
from placegraph.runtime.arrays import F32, F64, I32, Bool, Points


class RoomConfig(BaseModel, frozen=True, strict=True, extra="forbid"):
    """Parameters of the room layer. Values without a source were chosen by hand."""

    cell_m: float = 0.05  # HOV-SG
    slice_low_m: float = 1.5  # above the floor, HOV-SG
    slice_high_m: float = 0.1  # below the ceiling; HOV-SG's .3 cuts off the lintels that a low camera sees
    min_slice_m: float = 0.3  # a scan that shows less than this of the slice takes walls from lower down, ...
    partial_low_m: float = 1.0  # ... namely from here, above tables and the backs of chairs
    level_m: float = 0.1  # a wall counts by the levels of this height that it fills
    wall_fill_m: float = 0.2  # filled height that makes a wall; HOV-SG's .25 of the fullest cell excludes lintels
    smooth_m: float = 0.1  # the distance field is smoothed over this; HOV-SG's .5 m closes corridors
    seed_min_m: float = 0.5  # HOV-SG: drop seeds under .5 m across
    door_m: float = 1.6  # openings up to this width separate rooms; best of 1.2, 1.4, 1.6 on 8 real maps (ipa)
    neck_share: float = 0.7  # ... if they are this much narrower than the smaller room
    close_m: float = 0.3  # half the width of gaps in what was observed that are closed
    room_min_m2: float = 1.0
    wall_min_m: float = 1.0  # shorter pieces are furniture and lamps; with less wall in all, the floor is one room


@dataclass(frozen=True, eq=False)
class RoomArea:
    """One room: its mask on the floor's grid and its outline (K, 2) in metres, world frame."""

    mask: Bool
    outline: F64


def find_rooms(
    points_world: Points, free_points_world: Points, free_cell_m: float, span: FloorSpan, config: RoomConfig
) -> tuple[PlanGrid, list[RoomArea]]:
    """Rooms of one floor, largest first; at least one.

    points_world: (P, 3), P >= 1, and free_points_world: (F, 3) centres of cells seen through, of this floor's zone,
    metres, world frame; free_cell_m: size of those cells in plan.
    Source: paper, section "Room Layer"; differences at the head of this file.
    """
    grid = floor_grid(np.concatenate((points_world[:, :2], free_points_world[:, :2])), config.cell_m)
    walls = wall_mask(points_world, span, grid, config)
    observed = observed_mask(points_world, free_points_world, free_cell_m, grid, config)
    areas = room_areas(segment_rooms(walls, observed, config), grid, config)
    return grid, areas or [RoomArea(observed, grid.outline(observed))]


def room_areas(labels: I32, grid: PlanGrid, config: RoomConfig) -> list[RoomArea]:
    """Rooms of a label image, largest first, without those under `room_min_m2` unless all are; then the largest."""
    masks = [labels == i for i in range(1, int(labels.max()) + 1)]
    masks = sorted(masks, key=lambda mask: -int(mask.sum()))  # stable: equals keep the order of their labels
    large = [mask for mask in masks if mask.sum() * config.cell_m**2 >= config.room_min_m2]
    return [RoomArea(mask, grid.outline(mask)) for mask in large or masks[:1]]


def wall_mask(points_world: Points, span: FloorSpan, grid: PlanGrid, config: RoomConfig) -> Bool:
    """Cells where the slice between furniture and ceiling is filled: walls, and the lintels of open doors."""
    above = points_world[:, 2] - span.low_m
    low, high = config.slice_low_m, span.high_m - span.low_m - config.slice_high_m
    if high - low < config.min_slice_m:
        low, high = config.partial_low_m, max(span.high_m - span.low_m, config.partial_low_m + config.level_m)
    tall = (above >= low) & (above <= high)
    points = points_world[tall]
    levels = np.floor((above[tall] - low) / config.level_m).astype(np.int64)
    kernel = np.ones((3, 3), np.uint8)
    filled = np.zeros(grid.shape, np.uint8)  # a cell's number of levels
    for level in range(int(levels.max(initial=-1)) + 1):
        # a wall seen from a few places has holes: it is dilated here, and eroded by as much below
        filled += np.asarray(cv2.dilate(grid.image(points[levels == level]), kernel), np.uint8)
    wide = (filled >= round(config.wall_fill_m / config.level_m)).astype(np.uint8)
    walls = cv2.erode(cv2.morphologyEx(wide, cv2.MORPH_CLOSE, kernel), kernel)
    return keep_walls(np.asarray(walls, bool), config)


def observed_mask(points: Points, free_points: Points, free_cell_m: float, grid: PlanGrid, config: RoomConfig) -> Bool:
    """Cells that a ray crossed or that hold a point, small gaps closed."""
    observed = grid.image(free_points, free_cell_m) | grid.image(points)
    return close_gaps(observed, max(1, round(config.close_m / grid.cell_m)))


def keep_walls(occupied: Bool, config: RoomConfig) -> Bool:
    """Walls: the occupied pieces of `wall_min_m` or more; shorter ones are furniture and lamps."""
    _, pieces, boxes, _ = cv2.connectedComponentsWithStats(occupied.astype(np.uint8), connectivity=8)
    sides = boxes[:, [cv2.CC_STAT_WIDTH, cv2.CC_STAT_HEIGHT]].max(axis=1)
    is_wall = sides * config.cell_m >= config.wall_min_m
    is_wall[0] = False  # the label of cells that are not occupied
    return np.asarray(is_wall[pieces])


def segment_rooms(walls: Bool, observed: Bool, config: RoomConfig) -> I32:
    """Label image of rooms (0: none) from masks of walls and of what was observed, in cells of `cell_m`."""
    open_space = observed & ~walls
    if not open_space.any() or walls.sum() * config.cell_m < config.wall_min_m:
        return observed.astype(np.int32)
    field = distance_field(walls, config)
    field[~open_space] = 0
    labels = watershed(field, open_space, config.cell_m, config.seed_min_m / 2, lambda neck: _is_door(neck, config))
    return labels if labels.any() else open_space.astype(np.int32)  # everything is narrower than a seed


def _is_door(neck: Neck, config: RoomConfig) -> bool:
    """Whether a neck is at most as wide as a door and narrower than the rooms on both sides."""
    return 2 * neck.level <= config.door_m and neck.level <= config.neck_share * min(neck.seed_levels)


def distance_field(walls: Bool, config: RoomConfig) -> F32:
    """Metres to the nearest wall, lightly smoothed. Source: paper, room layer (EDF)."""
    field = cv2.distanceTransform((~walls).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE) * config.cell_m
    return np.asarray(cv2.GaussianBlur(field, (0, 0), config.smooth_m / config.cell_m), np.float32)
