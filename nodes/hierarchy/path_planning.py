"""Shortest paths of a robot inside one room, over the cells where it can stand.

Source: Dijkstra over a grid of 16 neighbours, whose paths are at most 2.8 % longer than the true ones, then
straightened.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from placegraph.nodes.hierarchy.plan_grid import PlanGrid
from placegraph.runtime.arrays import F64, I64, Bool

UNREACHED = -9999  # scipy's mark in predecessors
# Steps (row, column), and the cells beside each that must be free as well; the opposite steps are the other half.
STEPS: dict[tuple[int, int], tuple[tuple[int, int], ...]] = {
    (0, 1): (),
    (1, 0): (),
    (1, 1): ((0, 1), (1, 0)),
    (1, -1): ((0, -1), (1, 0)),
    (1, 2): ((0, 1), (1, 1)),
    (1, -2): ((0, -1), (1, -1)),
    (2, 1): ((1, 0), (1, 1)),
    (2, -1): ((1, 0), (1, -1)),
}


@dataclass(frozen=True, eq=False)
class ShortestPaths:
    """Distances (P, H, W) in metres from P start cells over a room's free cells; inf where there is no path."""

    starts: tuple[tuple[int, int], ...]  # row, column
    distance_m: F64
    _predecessors: I64  # (P, H, W) the cell before on the shortest path, flat
    _free: Bool
    _grid: PlanGrid

    def path(self, start: int, end: tuple[int, int]) -> F64:
        """Straightened path from start number `start` to a reached cell (row, column): (K, 2), K >= 2, metres."""
        width = self._free.shape[1]
        at, chain = end[0] * width + end[1], []
        while at >= 0:
            chain.append(divmod(at, width))
            at = int(self._predecessors[start].flat[at])
        corners = _straighten(np.array(chain[::-1]), self._free)
        return self._grid.centers(corners[:, 0], corners[:, 1])


def shortest_paths(starts: Sequence[tuple[int, int]], free: Bool, grid: PlanGrid) -> ShortestPaths:
    """Paths from cells (row, column), themselves free, over the free cells (H, W) of a room."""
    rows, columns = np.nonzero(free)
    top, left = (int(rows.min()), int(columns.min())) if len(rows) else (0, 0)
    part = free[top : top + int(np.ptp(rows)) + 1, left : left + int(np.ptp(columns)) + 1] if len(rows) else free[:0]
    number = np.full(part.shape, -1, np.int64)
    number[part] = np.arange(len(rows))
    start_numbers = [int(number[row - top, column - left]) for row, column in starts]
    distance = np.full((len(starts), *free.shape), np.inf)
    predecessors = np.full((len(starts), *free.shape), UNREACHED, np.int64)
    if starts:
        lengths, previous = dijkstra(
            _step_graph(part, number), directed=False, indices=start_numbers, return_predecessors=True
        )
        distance[:, rows, columns] = lengths * grid.cell_m
        flat = np.append(rows * free.shape[1] + columns, UNREACHED)
        predecessors[:, rows, columns] = flat[np.where(previous < 0, len(rows), previous)]
    return ShortestPaths(tuple(starts), distance, predecessors, free, grid)


def _step_graph(free: Bool, number: I64) -> csr_array:
    """Steps between free cells, each in one direction."""
    padded_free = np.pad(free, 2)
    padded_number = np.pad(number, 2, constant_values=-1)
    height, width = free.shape

    def shifted(padded: NDArray[np.generic], row: int, column: int) -> NDArray[np.generic]:
        return padded[2 + row : 2 + row + height, 2 + column : 2 + column + width]

    tails, heads, costs = [], [], []
    for (row, column), beside in STEPS.items():
        possible = np.logical_and.reduce([shifted(padded_free, *cell) for cell in ((0, 0), (row, column), *beside)])
        tails.append(number[possible])
        heads.append(shifted(padded_number, row, column)[possible])
        costs.append(np.full(int(possible.sum()), np.hypot(row, column)))
    count = int(free.sum())
    tail, head, cost = (np.concatenate(values) for values in (tails, heads, costs))
    return csr_array((cost, (tail, head)), shape=(count, count))


def _straighten(chain: I64, free: Bool) -> I64:
    """The corners of a chain of cells (N, 2): from each, the furthest later cell that a free straight line reaches."""
    corners, at = [0], 0
    while at < len(chain) - 1:
        # a line that is once blocked stays blocked, nearly always: bisection finds the last free one
        reached, blocked = at + 1, len(chain)
        while blocked - reached > 1:
            middle = (reached + blocked) // 2
            if is_line_free(chain[at], chain[middle], free):
                reached = middle
            else:
                blocked = middle
        at = reached
        corners.append(at)
    if len(corners) == 1:  # a path from a cell to itself
        corners.append(0)
    return chain[corners]


def is_line_free(start: I64, end: I64, free: Bool) -> bool:
    """Whether the straight line between the centres of two cells (row, column) runs over free cells alone."""
    steps = 4 * int(np.abs(end - start).max()) + 1  # a corner is cut by less than a quarter of a cell
    line = np.rint(start + (end - start) * np.linspace(0, 1, steps)[:, None]).astype(np.int64)
    return bool(free[line[:, 0], line[:, 1]].all())


def path_length_m(points: F64) -> float:
    """Length in metres of a path (K, 2)."""
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
