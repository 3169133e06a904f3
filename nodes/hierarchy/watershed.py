"""Watershed of a distance field in which two basins are merged or kept apart by the neck at which they meet.

Source: paper, room layer (watershed). Not as in the paper: the field is flooded level by level, since cv2.watershed
orders pixels by steps of colour; the neck decides whether basins stay apart, not seeds alone. Every cell is visited
once, so that a floor of a thousand square metres takes a fraction of a second.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from placegraph.runtime.arrays import F32, I32, I64, Bool


@dataclass(frozen=True)
class Neck:
    """The saddle point between two basins: a cell (row, column), the field there, and at each basin's seed (metres)."""

    cell: tuple[int, int]
    level: float
    seed_levels: tuple[float, float]


def watershed(field: F32, space: Bool, step_m: float, min_m: float, separates: Callable[[Neck], bool]) -> I32:
    """Label image (R, C), 1..n inside `space`, 0 elsewhere; every maximum of the field above `min_m` is a seed.

    field: (R, C) metres, 0 outside `space`; step_m: between levels. Basins that meet are merged unless `separates` says
    that their neck separates them. Parts of the space that no seed reaches have label 0. Deterministic.
    """
    basins = _Basins(field, space, separates)
    levels = np.arange(float(field.max(initial=0)), min_m, -step_m).tolist()
    cells, bounds = _level_bands(basins.field, basins.space, levels)
    for level, band in zip(levels, np.split(cells, bounds), strict=False):
        basins.add_seeds(basins.expand(band), level)
        basins.merge_touching(band, level)
    basins.expand(cells[basins.labels[cells] == 0])
    return basins.label_image(field.shape)


def _level_bands(field: F32, space: Bool, levels: list[float]) -> tuple[I64, I64]:
    """Cells of the space in falling order of the field, and where those of each level end."""
    cells = np.flatnonzero(space)
    cells = cells[np.argsort(-field[cells], kind="stable")]
    ends = np.searchsorted(-field[cells], -np.asarray(levels, field.dtype), side="right")
    return cells, ends


class _Basins:
    """Labels of a flat padded image, in which neighbours are constant steps away, and which basins are merged."""

    def __init__(self, field: F32, space: Bool, separates: Callable[[Neck], bool]) -> None:
        self.field, self.space = np.pad(field, 1).ravel(), np.pad(space, 1).ravel()
        self.labels = np.zeros(self.field.size, np.int32)
        self._width = field.shape[1] + 2
        self._neighbors = np.array([-self._width, -1, 1, self._width])
        self._position = np.zeros(self.field.size, np.int64)  # of a cell among those of `add_seeds`
        self._separates = separates
        self._seed_levels: list[float] = [0.0]  # by basin; there is no basin 0
        self._merged_into = [0]  # by basin: itself, or the basin that it was merged into
        self._separated: set[frozenset[int]] = set()

    def expand(self, cells: I64) -> I64:
        """Expand basins into cells, one ring at a time, and return the cells that none reaches.

        Of several basins that touch a cell the latest takes it.
        """
        waiting = np.zeros(self.labels.size, bool)
        waiting[cells] = True
        ring = cells
        while len(ring):
            touching = self.labels[ring[:, None] + self._neighbors].max(axis=1, initial=0)
            reached = ring[touching > 0]
            self.labels[reached] = touching[touching > 0]
            waiting[reached] = False
            beside = (reached[:, None] + self._neighbors).ravel()
            ring = np.unique(beside[waiting[beside]])
        return cells[waiting[cells]]

    def add_seeds(self, cells: I64, level: float) -> None:
        """Start a basin in each connected part of cells that no basin reaches."""
        if not len(cells):
            return
        cells = np.sort(cells)
        is_new = np.zeros(self.labels.size, bool)
        is_new[cells] = True
        self._position[cells] = np.arange(len(cells))
        links = []
        for step in (1, self._width):
            linked = cells[is_new[cells + step]]
            links.append((self._position[linked], self._position[linked + step]))
        a, b = (np.concatenate(ends) for ends in zip(*links, strict=True))
        count, part = connected_components(coo_matrix((np.ones(len(a), bool), (a, b)), (len(cells),) * 2), False)
        self.labels[cells] = part + len(self._seed_levels)
        self._merged_into += range(len(self._seed_levels), len(self._seed_levels) + count)
        self._seed_levels += [level] * count

    def merge_touching(self, new: I64, level: float) -> None:
        """Merge or separate the basins that new cells have brought together, in the order of their numbers."""
        cells = np.repeat(new, 4)
        labels = np.repeat(self.labels[new], 4)
        neighbors = self.labels[(new[:, None] + self._neighbors).ravel()]
        touching = (labels != neighbors) & (labels > 0) & (neighbors > 0)
        if not touching.any():
            return
        pairs = np.stack((np.minimum(labels, neighbors)[touching], np.maximum(labels, neighbors)[touching]), axis=1)
        # of the cells where two basins meet, the neck is the one furthest from a wall
        order = np.lexsort((cells[touching], -self.field[cells[touching]], pairs[:, 1], pairs[:, 0]))
        pairs, cells = pairs[order], cells[touching][order]
        first = np.flatnonzero(np.r_[True, (pairs[1:] != pairs[:-1]).any(axis=1)])
        for (a, b), cell in zip(pairs[first].tolist(), cells[first].tolist(), strict=True):
            self._merge_or_separate(self._root(a), self._root(b), cell, level)

    def _merge_or_separate(self, a: int, b: int, cell: int, level: float) -> None:
        pair = frozenset((a, b))
        if a == b or pair in self._separated:
            return
        row_column = (cell // self._width - 1, cell % self._width - 1)
        if self._separates(Neck(row_column, level, (self._seed_levels[a], self._seed_levels[b]))):
            self._separated.add(pair)
            return
        merged, kept = sorted(pair, key=lambda basin: (self._seed_levels[basin], -basin))
        self._merged_into[merged] = kept
        self._separated = {basins - {merged} | {kept} if merged in basins else basins for basins in self._separated}

    def _root(self, basin: int) -> int:
        while self._merged_into[basin] != basin:
            basin = self._merged_into[basin]
        return basin

    def label_image(self, shape: tuple[int, ...]) -> I32:
        """Labels 1..n of the basins that are left, in the order of their numbers."""
        roots = np.array([self._root(basin) for basin in range(len(self._merged_into))])
        _, numbers = np.unique(np.r_[0, roots], return_inverse=True)
        labels = numbers[1:].astype(np.int32)[self.labels]
        return np.asarray(labels.reshape(shape[0] + 2, shape[1] + 2)[1:-1, 1:-1])
