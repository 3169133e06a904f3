"""Where the rooms of one floor meet: doors and openings.

Rooms end at walls and lintels, so that between two of them lies a passage that is neither's. Both grow into it over
passable cells; where they meet, the middle is the connection.
Source: issue 4, place graph. The paper has none.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from placegraph.nodes.hierarchy.traversability import Ground, TravelConfig
from placegraph.runtime.arrays import I32, I64, Bool

NOBODY = -1


@dataclass(frozen=True, eq=False)
class Opening:
    """Two rooms by their numbers in the list of masks, the cell (row, column) in the middle, and the width there."""

    rooms: tuple[int, int]
    cell: tuple[int, int]
    width_m: float
    meeting: Bool  # cells on both sides of the line where the rooms meet


def owners(masks: Sequence[Bool], ground: Ground, config: TravelConfig) -> I32:
    """The room of each passable cell, by its number in `masks`; NOBODY of others. Each grows by `wall_m` at most."""
    labels = np.zeros(ground.grid.shape, np.int32)
    for number, mask in enumerate(masks):
        labels[mask] = number + 1
    labels[~ground.passable] = 0
    cross = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    for _ in range(max(1, round(config.wall_m / ground.grid.cell_m))):
        spread = cv2.dilate(labels.astype(np.float32), cross).astype(np.int32)  # dilation knows no int32
        reached = ground.passable & (labels == 0) & (spread > 0)
        if not reached.any():
            break
        labels[reached] = spread[reached]
    return labels - 1


def find_openings(owner: I32, ground: Ground, config: TravelConfig) -> list[Opening]:
    """Openings wide enough for the robot with standing room behind both sides, by rooms, then rows."""
    sizes = _standing_sizes(owner, ground)
    found = []
    for rooms, line in sorted(_meetings(owner).items()):
        _, parts = cv2.connectedComponents(line.astype(np.uint8), connectivity=8)
        for part in range(1, int(parts.max()) + 1):
            meeting = parts == part
            usable = meeting & ground.standing
            entered = [sizes[usable & (owner == room)].max(initial=0) for room in rooms]
            if min(entered) * ground.grid.cell_m**2 < config.entry_m2:
                continue
            cell = np.unravel_index(int(np.argmax(np.where(usable, ground.clearance_m, -1))), owner.shape)
            # of a narrow track that the camera alone showed, the robot's own width is known
            width = 2 * max(float(ground.clearance_m[cell]), config.robot_radius_m)
            found.append(Opening(rooms, (int(cell[0]), int(cell[1])), width, meeting))
    return found


def _meetings(owner: I32) -> dict[tuple[int, int], Bool]:
    """For each two rooms that touch the cells of both along the line between them."""
    found: dict[tuple[int, int], Bool] = {}
    for one, other in ((np.s_[:, :-1], np.s_[:, 1:]), (np.s_[:-1], np.s_[1:])):
        a, b = owner[one], owner[other]
        touch = (a != b) & (a != NOBODY) & (b != NOBODY)
        for low, high in sorted(
            set(zip(np.minimum(a, b)[touch].tolist(), np.maximum(a, b)[touch].tolist(), strict=True))
        ):
            pair = touch & (np.minimum(a, b) == low) & (np.maximum(a, b) == high)
            line = found.setdefault((low, high), np.zeros(owner.shape, bool))
            line[one] |= pair
            line[other] |= pair
    return found


def _standing_sizes(owner: I32, ground: Ground) -> I64:
    """For each cell where the robot can stand, how many such cells of the same room hang together with it."""
    sizes = np.zeros(owner.shape, np.int64)
    for room in range(int(owner.max(initial=NOBODY)) + 1):
        _, parts = cv2.connectedComponents((ground.standing & (owner == room)).astype(np.uint8), connectivity=8)
        counts = np.bincount(parts.ravel())
        counts[0] = 0
        sizes += counts[parts]
    return sizes
