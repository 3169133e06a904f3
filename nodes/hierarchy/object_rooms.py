"""Which room an object is in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from placegraph.nodes.hierarchy.floors import FloorSpan
from placegraph.nodes.hierarchy.plan_grid import PlanGrid
from placegraph.nodes.hierarchy.rooms import RoomArea
from placegraph.runtime.arrays import I32, Points


@dataclass(frozen=True, eq=False)
class FloorRoom:
    """A room with its id, and its floor's id, heights and grid."""

    id: str
    floor_id: str
    span: FloorSpan
    grid: PlanGrid
    area: RoomArea


def assign_rooms(objects: Sequence[Points], rooms: Sequence[FloorRoom]) -> list[FloorRoom]:
    """For each object the room that holds most of its points; without any, the nearest one of its floor.

    objects: points (N, 3), N >= 1, of each, metres, world frame; rooms: floor by floor, at least one if any object.
    """
    by_floor: dict[str, list[FloorRoom]] = {}
    for room in rooms:
        by_floor.setdefault(room.floor_id, []).append(room)
    floors = list(by_floor.values())
    zones = np.array([(floor[0].span.zone_low_m, floor[0].span.zone_high_m) for floor in floors]).reshape(-1, 2)
    labels = [_label_image(floor) for floor in floors]
    object_rooms = []
    for xyz in objects:
        center = xyz.mean(axis=0)
        # the zones of floors meet with a small gap, and an object may reach over it: its centre decides
        number = int(np.argmin(np.maximum(np.maximum(zones[:, 0] - center[2], center[2] - zones[:, 1]), 0)))
        floor = floors[number]
        counts = np.bincount(labels[number][floor[0].grid.cells(xyz)], minlength=len(floor) + 1)[1:]
        best = int(np.argmax(counts))
        object_rooms.append(floor[best] if counts[best] else _nearest(center, floor))
    return object_rooms


def _label_image(rooms: list[FloorRoom]) -> I32:
    """1 for the cells of the first room, 2 for those of the second, ...; rooms share no cells."""
    labels = np.zeros(rooms[0].grid.shape, np.int32)
    for number, room in enumerate(rooms, 1):
        labels[room.area.mask] = number
    return labels


def _nearest(xyz: Points, rooms: list[FloorRoom]) -> FloorRoom:
    def distance_m(room: FloorRoom) -> float:
        return float(np.linalg.norm(room.grid.centers(*np.nonzero(room.area.mask)) - xyz[:2], axis=1).min())

    return min(rooms, key=distance_m)
