"""The paper's labelling recipe, and any other finder of locations, against the truth of houses: F1@delta.

Source: paper, "Dataset Labeling" (the recipe is nodes/hierarchy/locations.py without a model) and its metric F1@delta:
best pair first, a pair counts when its IoU exceeds delta, and each truth and each find is used once.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from placegraph.models_onnx import LocationDetector
from placegraph.nodes.hierarchy.floors import FloorSpan
from placegraph.nodes.hierarchy.locations import LocationConfig, find_locations
from placegraph.tools.house.build import build
from placegraph.tools.train.location_maps import RoomScan, degrade, scan_rooms

F64 = NDArray[np.float64]
Finder = Callable[[RoomScan], list[F64]]  # a room to outlines (K, 2) in metres, world frame

EVALUATION_SEEDS = range(9000, 9020)
DELTAS = (0.3, 0.5, 0.7)
RASTER_M = 0.02
SALT = 6_053  # of the mistakes made in the simulated maps


@dataclass(frozen=True)
class Count:
    """Finds that are right, all finds, all truths; added up over rooms and houses."""

    right: int = 0
    found: int = 0
    true: int = 0

    def __add__(self, other: Count) -> Count:
        return Count(self.right + other.right, self.found + other.found, self.true + other.true)

    @property
    def precision(self) -> float:
        """Share of finds that are right, 0..1; 1 where nothing was found."""
        return self.right / self.found if self.found else 1.0

    @property
    def recall(self) -> float:
        """Share of truths that were found, 0..1; 1 where there is none."""
        return self.right / self.true if self.true else 1.0

    @property
    def f1(self) -> float:
        """Harmonic mean of both, 0..1."""
        return 2 * self.right / (self.found + self.true) if self.found + self.true else 1.0


def with_config(config: LocationConfig, detector: LocationDetector | None = None) -> Finder:
    """A finder that works as the hierarchy does with these settings."""

    def find(scan: RoomScan) -> list[F64]:
        span = FloorSpan(scan.low_m, scan.high_m, scan.low_m, scan.high_m)
        return [area.outline for area in find_locations(scan.objects, span, config, detector)]

    return find


def evaluation_rooms(seed: int) -> list[RoomScan]:
    """The rooms of an evaluation house as one walk maps them, mistakes included."""
    random = np.random.default_rng([seed, SALT])
    return [degrade(scan, random) for scan in scan_rooms(build(seed))]


def count_house(rooms: Sequence[RoomScan], find: Finder, deltas: Sequence[float] = DELTAS) -> list[Count]:
    """The counts of a house, one for each delta."""
    totals = [Count() for _ in deltas]
    for scan in rooms:
        overlap = overlaps(find(scan), scan.outlines)
        totals = [total + matched(overlap, delta) for total, delta in zip(totals, deltas, strict=True)]
    return totals


def overlaps(found: Sequence[F64], true: Sequence[F64]) -> F64:
    """IoU (N, M) of outlines (K, 2), metres, on a common raster."""
    result = np.zeros((len(found), len(true)))
    if not result.size:
        return result
    every = np.concatenate([*found, *true])
    low = every.min(axis=0)
    columns, rows = (np.ceil((every.max(axis=0) - low) / RASTER_M).astype(int) + 1).tolist()

    def raster(outline: F64) -> NDArray[np.bool_]:
        pixels = np.round((outline - low) / RASTER_M).astype(np.int32)
        return np.asarray(cv2.fillPoly(np.zeros((rows, columns), np.uint8), [pixels], 1) > 0)

    masks = [raster(outline) for outline in true]
    for i, outline in enumerate(found):
        mine = raster(outline)
        result[i] = [(mine & mask).sum() / (mine | mask).sum() for mask in masks]
    return result


def matched(overlap: F64, delta: float) -> Count:
    """Greedy pairs of finds (N) and truths (M) by their IoU (N, M), best first, while it exceeds `delta`."""
    left, right = overlap.copy(), 0
    while left.size and left.max() > delta:
        i, j = np.unravel_index(int(left.argmax()), left.shape)
        left[i], left[:, j] = -1.0, -1.0
        right += 1
    return Count(right, *overlap.shape)


def comparison(
    finders: dict[str, Finder], seeds: Sequence[int] = EVALUATION_SEEDS, deltas: Sequence[float] = DELTAS
) -> str:
    """A table: F1@.5 of each finder by house, then precision, recall and F1 over all houses at each delta."""
    names = list(finders)
    totals = {name: [Count() for _ in deltas] for name in names}
    middle = deltas.index(0.5)
    lines = ["house   truths  " + "  ".join(f"{name:>16}" for name in names)]
    for seed in seeds:
        rooms = evaluation_rooms(seed)
        counts = {name: count_house(rooms, finders[name], deltas) for name in names}
        totals = {n: [a + b for a, b in zip(totals[n], counts[n], strict=True)] for n in names}
        shown = "  ".join(f"{counts[name][middle].f1:16.3f}" for name in names)
        lines.append(f"{seed:<7} {sum(len(scan.outlines) for scan in rooms):>6}  {shown}")
    for k, delta in enumerate(deltas):
        for what in ("precision", "recall", "f1"):
            shown = "  ".join(f"{getattr(totals[name][k], what):16.3f}" for name in names)
            lines.append(f"{what + '@' + format(delta, '.1f'):<14}  {shown}")
    return "\n".join(lines)
