"""A room's objects from above, as the image that the location network reads.

Source: paper, "Location Layer" (bird's-eye view of a height band). Not as in the paper: one room at a time, since no
location crosses a wall; the points of objects instead of the cloud, so that walls and the noise of the floor need no
lower end of the band, and carpets stay in; three channels that do not depend on how densely something was scanned.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from placegraph.nodes.hierarchy.floors import FloorSpan
from placegraph.nodes.hierarchy.plan_grid import PlanGrid
from placegraph.runtime.arrays import U8, Points

# The location network was trained on images drawn with these values; all were chosen by hand.
CELL_M = 0.05  # of a pixel; larger in rooms that would not fit the image
SIZE_PX = 128  # of the square image: 6.4 m
MARGIN_PX = 4  # free on each side
FULL_M = 2.0  # height above the floor that is white
BELOW_M = 0.15  # points so far below the floor are its noise and still count
MIN_LEVEL = 40  # grey level of a cell with points: a carpet is not black
FOOTPRINT_LEVEL = 50  # of each object's footprint, summed
EDGE_LEVEL = 255


def birds_eye_image(objects: Sequence[Points], span: FloorSpan, band_high_share: float) -> tuple[U8, PlanGrid]:
    """Image (SIZE_PX, SIZE_PX, 3) of one room's objects, and where it lies in the world.

    objects: points (N, 3) of each, metres, world frame; band_high_share: share of the floor's height above which points
    are left out. Channels: a cell's highest point, its lowest point, and the objects' convex footprints with edges.
    """
    top = min(band_high_share * (span.ceiling_m - span.low_m), FULL_M)
    kept = [xyz[(xyz[:, 2] >= span.low_m - BELOW_M) & (xyz[:, 2] <= span.low_m + top)] for xyz in objects]
    kept = [xyz for xyz in kept if len(xyz)]
    grid = _grid_around(kept)
    image = np.zeros((SIZE_PX, SIZE_PX, 3), np.uint8)
    if not kept:
        return image, grid
    points = np.concatenate(kept)
    rows, columns = grid.cells(points)
    share = np.clip((points[:, 2] - span.low_m) / FULL_M, 0, 1)
    levels = np.round(MIN_LEVEL + (255 - MIN_LEVEL) * share).astype(np.uint8)
    highest, lowest = np.zeros((2, SIZE_PX, SIZE_PX), np.uint8)
    np.maximum.at(highest, (rows, columns), levels)
    np.maximum.at(lowest, (rows, columns), (255 - levels) + np.uint8(MIN_LEVEL))  # bright: near the floor
    image[..., 0], image[..., 1] = _close_gaps(highest), _close_gaps(lowest)
    image[..., 2] = _footprints(kept, grid)
    return image, grid


def _grid_around(objects: list[Points]) -> PlanGrid:
    """A square grid centred on the objects."""
    if not objects:
        return PlanGrid(np.zeros(2), CELL_M, (SIZE_PX, SIZE_PX))
    low = np.min([xyz[:, :2].min(axis=0) for xyz in objects], axis=0).astype(float)
    high = np.max([xyz[:, :2].max(axis=0) for xyz in objects], axis=0).astype(float)
    cell_m = max(CELL_M, float((high - low).max()) / (SIZE_PX - 2 * MARGIN_PX))
    return PlanGrid((low + high) / 2 - SIZE_PX / 2 * cell_m, cell_m, (SIZE_PX, SIZE_PX))


def _close_gaps(levels: U8) -> U8:
    """Give cells between points of one surface the level around them: voxels leave gaps in a turned grid."""
    return np.asarray(cv2.morphologyEx(levels, cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8)), np.uint8)


def _footprints(objects: list[Points], grid: PlanGrid) -> U8:
    levels = np.zeros(grid.shape, np.uint16)
    edges = np.zeros(grid.shape, np.uint8)
    for xyz in objects:
        rows, columns = grid.cells(xyz)
        hull = cv2.convexHull(np.stack((columns, rows), axis=1).astype(np.int32))
        filled = cv2.fillConvexPoly(np.zeros(grid.shape, np.uint8), hull, 1)
        levels += np.asarray(filled, np.uint16) * np.uint16(FOOTPRINT_LEVEL)
        cv2.polylines(edges, [hull], True, EDGE_LEVEL)
    return np.maximum(np.minimum(levels, 200).astype(np.uint8), edges)
