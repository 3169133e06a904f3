"""Which room an object is in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from placegraph.nodes.hierarchy.floors import FloorSpan
from placegraph.nodes.hierarchy.rooms import Grid, RoomArea
from placegraph.runtime.arrays import I32, Points


@dataclass(frozen=True, eq=False)
class HomeRoom:
    """A room with its id, its floor's id, heights and grid."""

    id: str
    floor: str
    span: FloorSpan
    grid: Grid
    area: RoomArea


def find_homes(objects: Sequence[Points], rooms: Sequence[HomeRoom]) -> list[HomeRoom]:
    """The room that holds most of each object's points; without any, the nearest one of its floor.

    objects: points (N, 3), N >= 1, of each, metres, world frame; rooms: floor by floor, at least one if any object.
    """
    floors: dict[str, list[HomeRoom]] = {}
    for room in rooms:
        floors.setdefault(room.floor, []).append(room)
    here = list(floors.values())
    zones = np.array([(some[0].span.zone_low, some[0].span.zone_high) for some in here]).reshape(-1, 2)
    labels = [_label_image(some) for some in here]
    homes = []
    for xyz in objects:
        middle = xyz.mean(axis=0)
        # the zones of floors meet with a small gap, and an object may reach over it: its middle decides
        at = int(np.argmin(np.maximum(np.maximum(zones[:, 0] - middle[2], middle[2] - zones[:, 1]), 0)))
        counts = np.bincount(labels[at][here[at][0].grid.cells(xyz)], minlength=len(here[at]) + 1)[1:]
        best = int(np.argmax(counts))
        homes.append(here[at][best] if counts[best] else _nearest(middle, here[at]))
    return homes


def _label_image(rooms: list[HomeRoom]) -> I32:
    """1 for the cells of the first room, 2 for those of the second, ...; rooms share no cells."""
    labels = np.zeros(rooms[0].grid.shape, np.int32)
    for number, room in enumerate(rooms, 1):
        labels[room.area.mask] = number
    return labels


def _nearest(middle: Points, rooms: list[HomeRoom]) -> HomeRoom:
    def gap(room: HomeRoom) -> float:
        rows, columns = np.nonzero(room.area.mask)
        cells = room.grid.origin + (np.stack((columns, rows), axis=1) + 0.5) * room.grid.cell_m
        return float(np.linalg.norm(cells - middle[:2], axis=1).min())

    return min(rooms, key=gap)
