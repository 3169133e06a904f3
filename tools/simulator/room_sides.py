"""The sides of a room: where there is wall to place or hang items, and where there are openings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from placegraph.runtime.arrays import F64
from placegraph.tools.simulator.house_model import Floor, Room


@dataclass(frozen=True)
class WallGap:
    """An opening seen from a side of a room: metres along the side and above the floor."""

    kind: str
    start_m: float
    end_m: float
    low_m: float
    high_m: float


@dataclass(frozen=True, eq=False)
class RoomSide:
    """One edge of a room's polygon: start (2,), unit vectors along it and into the room, walls and openings."""

    start: F64
    along: F64
    inward: F64
    length_m: float
    walls: tuple[tuple[float, float], ...]  # metres along the side where a full-height wall is behind
    gaps: tuple[WallGap, ...]

    @property
    def yaw(self) -> float:
        """Of an item that stands with its back to this side, radians."""
        return float(np.arctan2(self.inward[0], -self.inward[1]))

    def at(self, along_m: float, inward_m: float = 0.0) -> F64:
        """(2,) the point so far along the side and into the room, world frame."""
        return np.asarray(self.start + self.along * along_m + self.inward * inward_m)

    def strip(self, start_m: float, end_m: float, depth_m: float) -> F64:
        """(4,) x0 y0 x1 y1 of the floor before a stretch of the side."""
        corners = np.stack((self.at(start_m), self.at(end_m, depth_m)))
        return np.concatenate((corners.min(axis=0), corners.max(axis=0)))

    def is_wall(self, start_m: float, end_m: float) -> bool:
        """Whether one wall is behind the whole stretch."""
        return any(a - 0.02 <= start_m and end_m <= b + 0.02 for a, b in self.walls)

    def is_closed(self, start_m: float, end_m: float, low_m: float, high_m: float, margin_m: float) -> bool:
        """Whether no opening is within a margin of a stretch between two heights above the floor."""
        return not any(
            start_m < gap.end_m + margin_m
            and gap.start_m < end_m + margin_m
            and low_m < gap.high_m + margin_m
            and gap.low_m < high_m + margin_m
            for gap in self.gaps
        )


def room_sides(room: Room, floor: Floor) -> tuple[RoomSide, ...]:
    """The sides of a room, in the order of its polygon."""
    sides = []
    for p, q in zip(room.polygon, np.roll(room.polygon, -1, axis=0), strict=True):
        length_m = float(np.linalg.norm(q - p))
        along = (q - p) / length_m
        inward = np.array([-along[1], along[0]])
        walls: list[tuple[float, float]] = []
        gaps: list[WallGap] = []
        for wall in floor.walls:
            a, b = np.array(wall.a), np.array(wall.b)
            beyond = -(a - p) @ inward, -(b - p) @ inward  # of the wall's middle line, outward from the side
            if max(beyond) > wall.thickness_m / 2 + 0.08 or min(beyond) < wall.thickness_m / 2 - 0.08:
                continue
            starts, ends = sorted((float((a - p) @ along), float((b - p) @ along)))
            if ends < 0.05 or starts > length_m - 0.05:
                continue
            walls.append((max(starts, 0.0), min(ends, length_m)))
            way = (b - a) / np.linalg.norm(b - a)
            for opening in wall.openings:
                t = sorted(float((a + way * m - p) @ along) for m in (opening.start_m, opening.end_m))
                if t[1] > 0.0 and t[0] < length_m:
                    gaps.append(WallGap(opening.kind, t[0], t[1], opening.low_m, opening.high_m))
        sides.append(RoomSide(p, along, inward, length_m, _merged(walls), tuple(gaps)))
    return tuple(sides)


def _merged(stretches: list[tuple[float, float]]) -> tuple[tuple[float, float], ...]:
    """Stretches that touch, merged."""
    merged: list[tuple[float, float]] = []
    for start, end in sorted(stretches):
        if merged and start <= merged[-1][1] + 0.3:  # a crossing wall's thickness may lie between
            merged[-1] = (merged[-1][0], max(end, merged[-1][1]))
        else:
            merged.append((start, end))
    return tuple(merged)
