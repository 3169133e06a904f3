"""The grid of a plan: where a bird's-eye image lies in the world, points as images, and outlines of their parts."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from placegraph.runtime.arrays import F64, I64, U8, Bool, Points


@dataclass(frozen=True, eq=False)
class PlanGrid:
    """Where a bird's-eye image lies: rows run along +y, columns along +x, in cells of `cell_m`."""

    origin: F64  # (2,) metres, world, of the corner of cell (0, 0)
    cell_m: float
    shape: tuple[int, int]

    def cells(self, xy: Points) -> tuple[I64, I64]:
        """Rows and columns of points (N, 2) or of more columns, clipped to the image."""
        cells = np.floor((np.asarray(xy[:, :2], float) - self.origin) / self.cell_m).astype(np.int64)
        return np.clip(cells[:, 1], 0, self.shape[0] - 1), np.clip(cells[:, 0], 0, self.shape[1] - 1)

    def centers(self, rows: I64, columns: I64) -> F64:
        """(..., 2) metres, world, of the centres of cells (...)."""
        return self.origin + (np.stack((columns, rows), axis=-1) + 0.5) * self.cell_m

    def image(self, points: Points, point_m: float = 0.0) -> U8:
        """(H, W) 1 where points (N, 2) or of more columns lie, 0 elsewhere; point_m: width of a square around each."""
        image = np.zeros(self.shape, np.uint8)
        image[self.cells(points)] = 1
        side = max(1, int(np.ceil(point_m / self.cell_m))) | 1
        return np.asarray(cv2.dilate(image, np.ones((side, side), np.uint8)), np.uint8)

    def outline(self, mask: Bool) -> F64:
        """Outer contour (K, 2) in metres, world, of the largest part of a mask, simplified to half a cell."""
        # a border and doubled pixels: contours run through pixel centres and would lose half a cell on each side
        doubled = cv2.resize(np.pad(mask.view(np.uint8), 1), None, fx=2, fy=2, interpolation=cv2.INTER_NEAREST)
        contours, _ = cv2.findContours(doubled, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
        contour = max(contours, key=cv2.contourArea)
        simplified = cv2.approxPolyDP(contour, 1.0, True)
        contour = simplified if len(simplified) >= 3 else contour  # a few cells would collapse to a line
        return np.asarray((contour.reshape(-1, 2) + 0.5) / 2 - 1, float) * self.cell_m + self.origin


def floor_grid(xy: Points, cell_m: float) -> PlanGrid:
    """A grid around points (N, 2) or of more columns, N >= 1, in metres, with a margin of two cells or more."""
    low = np.floor(xy[:, :2].min(axis=0).astype(float) / cell_m) - 2
    high = np.floor(xy[:, :2].max(axis=0).astype(float) / cell_m) + 3
    columns, rows = (high - low).astype(int)
    return PlanGrid(low * cell_m, cell_m, (int(rows), int(columns)))


def close_gaps(mask: Bool | U8, reach: int) -> Bool:
    """A mask (H, W) in which gaps up to twice `reach` cells wide are closed; beyond the mask nothing is set."""
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * reach + 1, 2 * reach + 1))
    closed = cv2.morphologyEx(np.pad(mask, reach).astype(np.uint8), cv2.MORPH_CLOSE, kernel)
    return np.asarray(closed[reach : reach + mask.shape[0], reach : reach + mask.shape[1]]) > 0
