"""Where the rooms of one floor meet: doors and openings.

Rooms end at walls and lintels, so that a passage between two of them belongs to neither. Both grow into it over
passable cells; where they meet is the opening. The paper has no such step.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from placegraph.nodes.hierarchy.traversability import TraversabilityConfig, TraversabilityMap
from placegraph.runtime.arrays import I32, I64, Bool

NO_ROOM = -1


@dataclass(frozen=True, eq=False)
class Opening:
    """Two rooms by their numbers in the list of masks, the cell (row, column) in the middle, and the width there."""

    rooms: tuple[int, int]
    cell: tuple[int, int]
    width_m: float
    boundary: Bool  # cells on both sides of the line where the rooms meet


def grow_rooms(masks: Sequence[Bool], floor: TraversabilityMap, config: TraversabilityConfig) -> I32:
    """(H, W) the room of each passable cell, by its number in `masks`, or NO_ROOM. Rooms grow by `wall_m` at most."""
    labels = np.zeros(floor.grid.shape, np.int32)
    for number, mask in enumerate(masks):
        labels[mask] = number + 1
    labels[~floor.passable] = 0
    cross = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    for _ in range(max(1, round(config.wall_m / floor.grid.cell_m))):
        grown = cv2.dilate(labels.astype(np.float32), cross).astype(np.int32)  # cv2.dilate does not accept int32
        reached = floor.passable & (labels == 0) & (grown > 0)
        if not reached.any():
            break
        labels[reached] = grown[reached]
    return labels - 1


def find_openings(room_of_cell: I32, floor: TraversabilityMap, config: TraversabilityConfig) -> list[Opening]:
    """Openings wide enough for the robot with standing room on both sides, by rooms, then rows."""
    sizes = _standable_sizes(room_of_cell, floor)
    openings = []
    for rooms, line in sorted(_boundaries(room_of_cell).items()):
        _, parts = cv2.connectedComponents(line.astype(np.uint8), connectivity=8)
        for part in range(1, int(parts.max()) + 1):
            boundary = parts == part
            usable = boundary & floor.standable
            entered = [sizes[usable & (room_of_cell == room)].max(initial=0) for room in rooms]
            if min(entered) * floor.grid.cell_m**2 < config.entry_m2:
                continue
            cell = np.unravel_index(int(np.argmax(np.where(usable, floor.clearance_m, -1))), room_of_cell.shape)
            # where only the camera's path shows a passage, it is at least as wide as the robot
            width = 2 * max(float(floor.clearance_m[cell]), config.robot_radius_m)
            openings.append(Opening(rooms, (int(cell[0]), int(cell[1])), width, boundary))
    return openings


def _boundaries(room_of_cell: I32) -> dict[tuple[int, int], Bool]:
    """For each two rooms that touch, the cells of both along the line between them."""
    boundaries: dict[tuple[int, int], Bool] = {}
    for first, second in ((np.s_[:, :-1], np.s_[:, 1:]), (np.s_[:-1], np.s_[1:])):
        a, b = room_of_cell[first], room_of_cell[second]
        touching = (a != b) & (a != NO_ROOM) & (b != NO_ROOM)
        low, high = np.minimum(a, b), np.maximum(a, b)
        for rooms in sorted(set(zip(low[touching].tolist(), high[touching].tolist(), strict=True))):
            pair = touching & (low == rooms[0]) & (high == rooms[1])
            line = boundaries.setdefault(rooms, np.zeros(room_of_cell.shape, bool))
            line[first] |= pair
            line[second] |= pair
    return boundaries


def _standable_sizes(room_of_cell: I32, floor: TraversabilityMap) -> I64:
    """For each cell where the robot can stand, the number of such cells of the same room that are connected to it."""
    sizes = np.zeros(room_of_cell.shape, np.int64)
    for room in range(int(room_of_cell.max(initial=NO_ROOM)) + 1):
        _, parts = cv2.connectedComponents((floor.standable & (room_of_cell == room)).astype(np.uint8), connectivity=8)
        counts = np.bincount(parts.ravel())
        counts[0] = 0
        sizes += counts[parts]
    return sizes
