"""Doors, archways and windows of a floor, and the leaves of doors. World frame, metres."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from placegraph.tools.simulator.floor_plan_rooms import HALLS, Rectangle
from placegraph.tools.simulator.floor_plan_walls import OUTSIDE, CellSide, FloorWalls
from placegraph.tools.simulator.house_model import WallOpening

DOOR_HIGH_M = 2.05
JAMB_M = 0.12  # smallest wall between an opening and a corner
APART_M = 0.25  # smallest wall between two openings
FREE_BEFORE_OPENING_M = 0.8  # kept free of stairs and leaves in front of an opening
LEAF_M = 0.04  # thickness of a door leaf
PASS_THROUGH_ROOMS = (
    "living room",
    "dining room",
    "kitchen",
    "office",
)  # rooms through which others may be entered, best first
JOINED_ROOMS = ("living room", "dining room", "kitchen")  # rooms that are joined to each other with a probability


@dataclass(frozen=True)
class DoorLeaf:
    """An open door leaf: centre of its footprint, yaw (hinges at the leaf's -x), width, room."""

    x: float
    y: float
    yaw: float
    width_m: float
    room: int
    box_around: Rectangle


@dataclass(eq=False)
class FloorOpenings:
    """The openings of a floor by wall line while they are chosen; coordinates are along the axis of the line."""

    grid: FloorWalls
    types: list[str]
    blocked: list[Rectangle]  # footprints of stairs, onto which no opening leads
    by_line: dict[int, list[WallOpening]] = field(default_factory=dict)
    doors: list[tuple[float, float, CellSide]] = field(default_factory=list)  # start, end, side of those to have a leaf
    leaves: list[DoorLeaf] = field(default_factory=list)

    def shared_spans(
        self, room: int, neighbor: int, margin_m: float = 0.0
    ) -> list[tuple[float, float, CellSide, CellSide]]:
        """Free spans of the walls that two rooms share, with both sides, the longest first."""
        spans = []
        for side in self._sides(room):
            for back in self._sides(neighbor):
                if back.line == side.line and back.inward == -side.inward:
                    for face in side.stretches:
                        if face.behind == neighbor:
                            ends = (max(face.start_m, back.start_m), min(face.end_m, back.end_m))
                            spans += [(a, b, side, back) for a, b in self.free_spans(ends, (side, back), margin_m)]
        return sorted(spans, key=lambda span: span[0] - span[1])

    def free_spans(
        self, ends: tuple[float, float], sides: tuple[CellSide, ...], margin_m: float = 0.0
    ) -> list[tuple[float, float]]:
        """A span of wall without existing openings and without the ground in front of stairs."""
        taken = [(hole.start_m - APART_M, hole.end_m + APART_M) for hole in self.by_line.get(sides[0].line, [])]
        for side in sides:
            before = side.strip(*ends, FREE_BEFORE_OPENING_M)
            taken += [
                (rectangle[side.axis] - margin_m, rectangle[side.axis + 2] + margin_m)
                for rectangle in self.blocked
                if rectangle.meets(before)
            ]
        spans = [ends]
        for low, high in taken:
            spans = [cut for a, b in spans for cut in ((a, min(b, low)), (max(a, high), b)) if cut[0] < cut[1]]
        return spans

    def add(self, side: CellSide, hole: WallOpening) -> None:
        """Cut an opening into the side's line."""
        self.by_line.setdefault(side.line, []).append(hole)

    def joined_rooms(self) -> set[tuple[int, ...]]:
        """The pairs of rooms that an opening joins."""
        return {hole.rooms for holes in self.by_line.values() for hole in holes if len(hole.rooms) == 2}

    def _sides(self, room: int) -> list[CellSide]:
        return [side for side in self.grid.sides if side.room == room and side.line >= 0]


def connect_rooms(random: np.random.Generator, openings: FloorOpenings) -> bool:
    """Joins every room to the hall, directly or through another room; False when one stays unreachable."""
    types = openings.types
    hall = next(room for room, name in enumerate(types) if name in HALLS)
    inside = [hall]
    for room, name in enumerate(types):
        if room != hall and _cut_opening(random, openings, room, hall, 0.5 if name == "living room" else 0.0):
            inside.append(room)
    for _ in types:
        for room in range(len(types)):
            hosts = sorted(
                (h for h in inside if types[h] in PASS_THROUGH_ROOMS),
                key=lambda h: (PASS_THROUGH_ROOMS.index(types[h]), h),
            )
            if room not in inside and any(_cut_opening(random, openings, room, host, 0.3) for host in hosts):
                inside.append(room)
    living_rooms = [room for room, name in enumerate(types) if name in JOINED_ROOMS]
    for first in living_rooms:
        for second in living_rooms:
            if first < second and (first, second) not in openings.joined_rooms() and random.random() < 0.65:
                _cut_opening(random, openings, first, second, 0.85)
    for start, end, side in openings.doors:  # after all openings are known, so that no leaf blocks one
        _hang_leaf(random, openings, start, end, side)
    return len(inside) == len(types)


def _cut_opening(
    random: np.random.Generator, openings: FloorOpenings, room: int, neighbor: int, archway: float
) -> bool:
    """Cuts a door or, with a probability, an archway between two rooms; False when they share too little wall."""
    rooms = (min(room, neighbor), max(room, neighbor))
    for low, high, side, back in openings.shared_spans(room, neighbor):
        length = high - low - 2 * JAMB_M
        if length >= 1.4 and random.random() < archway:
            width = random.uniform(1.4, min(2.6, length))
            start = low + JAMB_M + random.uniform(0, length - width)
            openings.add(
                side, WallOpening("archway", start, start + width, 0.0, float(random.uniform(2.05, 2.25)), rooms)
            )
            return True
        if length >= 0.85:
            width = random.uniform(0.85, min(0.95, length))
            start = _door_start(random, (low, high), width, side)
            openings.add(side, WallOpening("door", start, start + width, 0.0, DOOR_HIGH_M, rooms))
            if random.random() < 0.85:
                order = (side, back) if openings.types[neighbor] in HALLS or random.random() < 0.5 else (back, side)
                openings.doors.append((start, start + width, order[0]))
            return True
    return False


def _door_start(random: np.random.Generator, span: tuple[float, float], width: float, side: CellSide) -> float:
    """Mostly near a corner of the room, where the open leaf can stand along the wall."""
    gap = random.uniform(JAMB_M, 0.2)
    starts = []
    if abs(span[0] - side.start_m) < 0.05:
        starts.append(span[0] + gap)
    if abs(span[1] - side.end_m) < 0.05:
        starts.append(span[1] - gap - width)
    starts = [start for start in starts if span[0] + JAMB_M - 1e-9 <= start <= span[1] - JAMB_M - width + 1e-9]
    if starts and random.random() < 0.75:
        return float(random.choice(starts))
    return float(random.uniform(span[0] + JAMB_M, span[1] - JAMB_M - width))


def _hang_leaf(random: np.random.Generator, openings: FloorOpenings, start: float, end: float, side: CellSide) -> None:
    """Hangs the leaf in the room of `side` where it obstructs nothing, if there is such a position."""
    width = end - start - 0.03
    swing = float(random.uniform(90, 98))
    for hinge, way in ((start, 1), (end, -1)):
        corner = hinge - side.start_m if way > 0 else side.end_m - hinge
        if corner <= 0.3:  # opens along the wall at the corner, or slightly further
            beyond_right_angle = (
                float(np.degrees(np.arcsin(min((corner - 0.09) / width, 1.0)))) if corner > 0.09 else 0.0
            )
            angle = min(swing, 90 + beyond_right_angle)
        elif corner >= width + 0.1:
            angle = 175.0  # back against the wall beside the opening
        else:
            continue
        leaf = _leaf(side, hinge, way, np.radians(angle), width)
        if _is_clear(openings, side, leaf):
            openings.leaves.append(leaf)
            return


def _leaf(side: CellSide, hinge: float, way: int, angle: float, width: float) -> DoorLeaf:
    """A leaf hinged at a coordinate of a side and opened by an angle; `way` is the direction over the opening."""
    u, n = np.zeros(2), np.zeros(2)
    u[side.axis], n[1 - side.axis] = way, side.inward
    at = np.zeros(2)
    at[side.axis], at[1 - side.axis] = hinge, side.at_m
    along = np.cos(angle) * u + np.sin(angle) * n
    # beside the opening when it stands upright on the wall; before the wall's face when it lies back against it
    off = (0.05 * n) if angle > 2 else (0.02 * n - (LEAF_M / 2 + 0.01) * u)
    middle = at + off + along * width / 2
    reach = np.abs(along) * width / 2 + np.abs(along[::-1]) * (LEAF_M / 2 + 0.008)
    box_around = Rectangle(*(middle - reach).tolist(), *(middle + reach).tolist())
    yaw = float(np.arctan2(along[1], along[0]))
    return DoorLeaf(float(middle[0]), float(middle[1]), yaw, float(width), side.room, box_around)


def _is_clear(openings: FloorOpenings, side: CellSide, leaf: DoorLeaf) -> bool:
    """Whether a leaf is inside its room and clear of other leaves, stairs and the ground before other openings."""
    polygon = openings.grid.polygons[side.room]
    low, high = polygon.min(axis=0), polygon.max(axis=0)
    box = leaf.box_around
    if len(polygon) != 4 or box.x0 < low[0] or box.y0 < low[1] or box.x1 > high[0] or box.y1 > high[1]:
        return False
    zones = [other_leaf.box_around for other_leaf in openings.leaves] + openings.blocked
    for room_side in openings.grid.sides:
        if room_side.room == side.room:
            zones += [
                room_side.strip(hole.start_m, hole.end_m, FREE_BEFORE_OPENING_M)
                for hole in openings.by_line.get(room_side.line, [])
                if hole.end_m > room_side.start_m and hole.start_m < room_side.end_m
            ]
    return not any(zone.meets(box) for zone in zones)


def add_windows(random: np.random.Generator, openings: FloorOpenings) -> None:
    """Adds windows to outer walls, at least one in most rooms, none behind stairs or a leaf."""
    low, high = float(random.uniform(0.7, 1.0)), float(random.uniform(2.05, 2.3))
    for room, name in enumerate(openings.types):
        chance = 1.0
        spans = []
        for side in openings.grid.sides:
            if side.room == room and side.line >= 0:
                spans += [(f, side) for f in side.stretches if f.behind == OUTSIDE and f.end_m - f.start_m > 1.3]
        for face, side in sorted(spans, key=lambda span: span[0].start_m - span[0].end_m):
            for start, end in _window_spans(random, openings, (face.start_m, face.end_m), side, name):
                if random.random() < chance:
                    sill = max(low, 0.95) if name in ("bathroom", "kitchen", "laundry") else low
                    openings.add(side, WallOpening("window", start, end, sill, high, (room,)))
            chance = 0.55


def _window_spans(
    random: np.random.Generator, openings: FloorOpenings, ends: tuple[float, float], side: CellSide, name: str
) -> list[tuple[float, float]]:
    """The span of one window, or of two in a long wall."""
    count = 2 if ends[1] - ends[0] > 4.2 else 1
    max_width = 1.0 if name in ("bathroom", "laundry") else 2.0
    leaves = [leaf.box_around for leaf in openings.leaves if leaf.room == side.room]
    panes = []
    for k in range(count):
        part = (ends[1] - ends[0]) / count
        low, high = ends[0] + k * part + 0.3, ends[0] + (k + 1) * part - 0.3
        for a, b in openings.free_spans((low, high), (side,), 0.1):
            if b - a >= 0.8:
                width = random.uniform(0.8, min(max_width, b - a))
                start = a + random.uniform(0.3, 0.7) * (b - a - width)
                if not any(leaf.meets(side.strip(start - 0.1, start + width + 0.1, 0.3)) for leaf in leaves):
                    panes.append((start, start + width))
                break
    return panes
