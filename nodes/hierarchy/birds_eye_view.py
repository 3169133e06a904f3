"""A room's objects from above, as the image that the location network reads.

Source: paper, "Location Layer" (bird's-eye view of a height band). Departs: one room at a time, since no location
crosses a wall; objects' points instead of the cloud, so that neither walls nor the floor's noise need the band's lower
end, and carpets stay in; three channels that do not depend on how densely something was scanned.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from placegraph.nodes.hierarchy.floors import FloorSpan
from placegraph.nodes.hierarchy.rooms import Grid
from placegraph.runtime.arrays import U8, Points

CELL_M = 0.05  # of a pixel; in rooms that do not fit the canvas so much more that they do
SIZE_PX = 128  # of the square canvas: 6.4 m
MARGIN_PX = 4  # free on each side
FULL_M = 2.0  # height above the floor that is white
BELOW_M = 0.15  # noise below the floor still counts
MIN_LEVEL = 40  # of a cell with points: a carpet is not black
FOOTPRINT_LEVEL = 50  # of each object's footprint, summed
EDGE_LEVEL = 255


def bird_eye(objects: Sequence[Points], span: FloorSpan, band_high: float) -> tuple[U8, Grid]:
    """The image (SIZE_PX, SIZE_PX, 3) of one room's objects, and where it lies in the world.

    objects: points (N, 3) of each, metres, world frame; band_high: share of the floor's height above which nothing
    counts. Channels: highest point of a cell, its lowest point, and the objects' convex footprints with their edges.
    """
    top = min(band_high * (span.ceiling - span.low), FULL_M)
    kept = [xyz[(xyz[:, 2] >= span.low - BELOW_M) & (xyz[:, 2] <= span.low + top)] for xyz in objects]
    kept = [xyz for xyz in kept if len(xyz)]
    grid = _canvas(kept)
    image = np.zeros((SIZE_PX, SIZE_PX, 3), np.uint8)
    if not kept:
        return image, grid
    every = np.concatenate(kept)
    rows, columns = grid.cells(every)
    share = np.clip((every[:, 2] - span.low) / FULL_M, 0, 1)
    levels = np.round(MIN_LEVEL + (255 - MIN_LEVEL) * share).astype(np.uint8)
    highest, lowest = np.zeros((2, SIZE_PX, SIZE_PX), np.uint8)
    np.maximum.at(highest, (rows, columns), levels)
    np.maximum.at(lowest, (rows, columns), (255 - levels) + np.uint8(MIN_LEVEL))  # bright: it reaches down to the floor
    image[..., 0], image[..., 1] = _filled(highest), _filled(lowest)
    image[..., 2] = _footprints(kept, grid)
    return image, grid


def _canvas(objects: list[Points]) -> Grid:
    """The square of the world around the objects, its middle theirs."""
    if not objects:
        return Grid(np.zeros(2), CELL_M, (SIZE_PX, SIZE_PX))
    low = np.min([xyz[:, :2].min(axis=0) for xyz in objects], axis=0).astype(float)
    high = np.max([xyz[:, :2].max(axis=0) for xyz in objects], axis=0).astype(float)
    cell_m = max(CELL_M, float((high - low).max()) / (SIZE_PX - 2 * MARGIN_PX))
    return Grid((low + high) / 2 - SIZE_PX / 2 * cell_m, cell_m, (SIZE_PX, SIZE_PX))


def _filled(levels: U8) -> U8:
    """Cells between points of one surface take the level around them: a scan's voxels leave gaps in a turned grid."""
    return np.asarray(cv2.morphologyEx(levels, cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8)), np.uint8)


def _footprints(objects: list[Points], grid: Grid) -> U8:
    levels = np.zeros(grid.shape, np.uint16)
    edges = np.zeros(grid.shape, np.uint8)
    for xyz in objects:
        rows, columns = grid.cells(xyz)
        hull = cv2.convexHull(np.stack((columns, rows), axis=1).astype(np.int32))
        filled = cv2.fillConvexPoly(np.zeros(grid.shape, np.uint8), hull, 1)
        levels += np.asarray(filled, np.uint16) * np.uint16(FOOTPRINT_LEVEL)
        cv2.polylines(edges, [hull], True, EDGE_LEVEL)
    return np.maximum(np.minimum(levels, 200).astype(np.uint8), edges)
