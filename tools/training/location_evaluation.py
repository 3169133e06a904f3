"""Compares the paper's labelling recipe, and location networks, with the true locations of houses: F1@delta.

Source: paper, "Dataset Labeling" (the recipe is nodes/hierarchy/locations.py without a model); the metric is that of
tools/evaluate/place_overlap.py. Maps are simulated (room_scans.py), rooms are the true ones.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from placegraph.models_onnx import LocationDetector
from placegraph.nodes.hierarchy.floors import FloorSpan
from placegraph.nodes.hierarchy.locations import LocationConfig, find_locations
from placegraph.runtime.arrays import F64, Bool
from placegraph.runtime.vision.area_overlap import overlaps
from placegraph.tools.evaluate.place_overlap import CELL_M, match_scores
from placegraph.tools.simulator.house_frames import generate_house
from placegraph.tools.training.room_scans import RoomScan, add_mapping_errors, scan_rooms

LocationFinder = Callable[[RoomScan], list[F64]]  # a room to outlines (K, 2) in metres, world frame

EVALUATION_SEEDS = range(9000, 9020)
DELTAS = (0.3, 0.5, 0.7)
SEEN_SHARE = 0.5  # of a location's members that must be in the map for it to count as seen
SALT = 6_053  # a random stream of its own, for mapping errors


@dataclass(frozen=True, eq=False)
class MappedRoom:
    """One room as it was mapped, and which of its true locations (scan.outlines) were seen."""

    scan: RoomScan
    seen: Bool  # (T,)


def finder_for(config: LocationConfig, detector: LocationDetector | None = None) -> LocationFinder:
    """A finder that works as the hierarchy node does with these settings."""

    def find(scan: RoomScan) -> list[F64]:
        span = FloorSpan(scan.low_m, scan.high_m, scan.low_m, scan.high_m)
        return [area.outline for area in find_locations(scan.objects, span, config, detector)]

    return find


def mapped_rooms(seed: int) -> list[MappedRoom]:
    """The rooms of a house as one walk maps them, mistakes included."""
    house = generate_house(seed)
    random = np.random.default_rng([seed, SALT])
    rooms = []
    for room, whole in zip(house.rooms, scan_rooms(house), strict=True):
        scan = add_mapping_errors(whole, random)
        members = np.array([len(location.members) for location in house.locations if location.room == room.id])
        mapped = np.bincount([location for location in scan.location if location >= 0], minlength=len(members))
        rooms.append(MappedRoom(scan, (mapped > 0) & (mapped >= SEEN_SHARE * members)))
    return rooms


def house_iou(rooms: Sequence[MappedRoom], find: LocationFinder) -> F64:
    """IoU (F, T) of all predicted with all true locations of a house; 0 across rooms."""
    predicted = [(number, outline) for number, room in enumerate(rooms) for outline in find(room.scan)]
    true = [(number, outline) for number, room in enumerate(rooms) for outline in room.scan.outlines]
    return overlaps(predicted, true, CELL_M).iou


def comparison(
    finders: dict[str, LocationFinder], seeds: Sequence[int] = EVALUATION_SEEDS, deltas: Sequence[float] = DELTAS
) -> str:
    """A table: F1@.5 of each finder by house, then the scores over all houses, for all locations and for those seen."""
    ious: dict[str, list[F64]] = {name: [] for name in finders}
    seen: list[Bool] = []
    lines = [_row("house", "truths", *finders)]
    for seed in seeds:
        rooms = mapped_rooms(seed)
        seen.append(np.concatenate([room.seen for room in rooms]))
        for name, find in finders.items():
            ious[name].append(house_iou(rooms, find))
        house_scores = [f"{match_scores(ious[name][-1], 0.5).f1:.3f}" for name in finders]
        lines.append(_row(str(seed), str(len(seen[-1])), *house_scores))
    for words, counted in (("all", np.ones(sum(map(len, seen)), bool)), ("seen", np.concatenate(seen))):
        for delta in deltas:
            scores = [match_scores(block_diag(*ious[name])[:, counted], delta) for name in finders]
            listed = [f"{score.precision:.3f} {score.recall:.3f} {score.f1:.3f}" for score in scores]
            lines.append(_row(f"{words} @{delta:g}", str(int(counted.sum())), *listed))
    return "\n".join([*lines, "by house F1@.5; below precision, recall and F1"])


def _row(first: str, second: str, *rest: str) -> str:
    return f"{first:<9}{second:>7}" + "".join(f"{cell:>20}" for cell in rest)
