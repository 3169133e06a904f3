"""Which rooms a floor has and where: two rows of rooms along a hall, a room at its end, a corner left out.

Metres, between the middle lines of walls, with the hall along x; `FrameTransform` takes this to the world frame.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

PARAPET_M = 0.08  # thickness of the low wall around a stair hole
LANDING_M = 1.0  # free at the foot and at the head of a flight
TRIALS = 600  # of choices of rooms for a floor
ACCESS_M = 1.25  # of wall that a room shares with the hall: a door and what is left on its two sides
WALL_M = 0.2  # about what walls take from a room's width and depth

# inner area at least and at most in square metres, shortest inner side
ROOM_SIZES = {
    "living room": (16.6, 31.0, 3.3),
    "kitchen": (8.3, 15.3, 2.2),
    "dining room": (9.2, 15.7, 2.6),
    "bathroom": (4.3, 8.5, 1.6),
    "laundry": (4.3, 8.0, 1.6),
    "office": (7.0, 14.0, 2.2),
    "bedroom": (10.3, 17.4, 2.6),
    "playroom": (9.2, 15.7, 2.6),
}
ONE_FLOOR_ROOMS = (("living room", "kitchen", "bathroom", "bedroom"), ("bedroom", "office", "dining room", "laundry"))
GROUND_FLOOR_ROOMS = (("living room", "kitchen"), ("bathroom", "dining room", "office", "laundry", "bedroom"))
UPPER_FLOOR_ROOMS = (("bedroom", "bathroom"), ("bedroom", "bedroom", "office", "playroom", "bathroom", "office"))
HALLS = ("hallway", "corridor")
HALL_ENTERED_ROOMS = ("bedroom", "bathroom", "playroom", "living room")  # never entered through any room but the hall


class Rectangle(NamedTuple):
    """An axis-aligned rectangle in metres."""

    x0: float
    y0: float
    x1: float
    y1: float

    def meets(self, other: Rectangle) -> bool:
        """Whether the two share more than an edge."""
        return self.x0 < other.x1 and other.x0 < self.x1 and self.y0 < other.y1 and other.y0 < self.y1


@dataclass(frozen=True)
class RoomCell:
    """A room between the middle lines of its walls."""

    type: str
    place: Rectangle


@dataclass(frozen=True)
class Flight:
    """A straight flight of stairs from `floor` up: its treads' rectangle, and the well in the floor above."""

    floor: int
    foot: tuple[float, float]
    head: tuple[float, float]
    treads: Rectangle
    well: Rectangle  # to wall middle lines, the parapet's middle line, and the head


@dataclass(frozen=True)
class HouseShell:
    """What all floors share: depths of the south row, the hall and the north row (0: none), and the stairs."""

    width_m: float
    south_m: float
    hall_m: float
    north_m: float
    north_from_m: float  # the north row begins here: what lies before is left out
    outer_m: float  # thickness of the walls
    inner_m: float
    flights: tuple[Flight, ...]

    @property
    def depth_m(self) -> float:
        """Of all rows."""
        return self.south_m + self.hall_m + self.north_m


class RowExtent(NamedTuple):
    """How far the two rows of a floor reach along x, in metres."""

    south_to: float
    north_to: float


@dataclass(frozen=True)
class FrameTransform:
    """From the frame of the hall to the world: x and y swapped, then mirrored."""

    swap: bool
    mirror_x: bool
    mirror_y: bool
    width_m: float
    depth_m: float

    def point(self, x: float, y: float) -> tuple[float, float]:
        """A point in world coordinates, rounded to 1 mm so that equal lines have equal numbers."""
        x = self.width_m - x if self.mirror_x else x
        y = self.depth_m - y if self.mirror_y else y
        return (round(y, 3) + 0.0, round(x, 3) + 0.0) if self.swap else (round(x, 3) + 0.0, round(y, 3) + 0.0)

    def rectangle(self, rectangle: Rectangle) -> Rectangle:
        """A rectangle in world coordinates."""
        (ax, ay), (bx, by) = self.point(rectangle.x0, rectangle.y0), self.point(rectangle.x1, rectangle.y1)
        return Rectangle(min(ax, bx), min(ay, by), max(ax, bx), max(ay, by))

    def flight(self, flight: Flight) -> Flight:
        """A flight in world coordinates."""
        turned = (self.rectangle(flight.treads), self.rectangle(flight.well))
        return Flight(flight.floor, self.point(*flight.foot), self.point(*flight.head), *turned)


def house_shell(random: np.random.Generator, floors: int) -> HouseShell:
    """The dimensions of a house; with stairs the hall is wide enough for a flight, a parapet and a passage."""
    outer, inner = round(random.uniform(0.2, 0.3), 2), round(random.uniform(0.1, 0.15), 2)
    if floors == 1:
        south, hall, north = random.uniform(3.2, 4.2), random.uniform(1.55, 1.95), random.uniform(3.0, 4.2)
        return HouseShell(random.uniform(8.5, 13.5), south, hall, north, 0.0, outer, inner, ())
    stair, passage, run = random.uniform(0.92, 1.08), random.uniform(1.2, 1.4), random.uniform(3.25, 3.6)
    parapet = outer / 2 + passage + PARAPET_M / 2
    hall = parapet + PARAPET_M / 2 + 0.01 + stair + 0.01 + outer / 2
    behind = LANDING_M + outer / 2 + run  # what lies beside the first flight
    kind = str(random.choice(["row", "corner", "none"] if floors == 2 else ["row", "none", "none"]))
    width = random.uniform(9.0, 13.8) if floors == 2 else random.uniform(11.6, 13.9)
    # a room beside the flight is entered beyond the head, so it is long; a small depth keeps it a bedroom's size
    south = random.uniform(4.6, 5.0) if kind == "none" else random.uniform(3.3, 4.3)
    north = {"row": random.uniform(2.8, 3.1), "corner": random.uniform(3.0, 4.1), "none": 0.0}[kind]
    if floors == 3:
        width = max(width, 2 * behind + 2 * ACCESS_M) if kind == "row" else width
    begin = behind + random.uniform(0.0, 0.6) if kind == "corner" else 0.0
    flights = _flights(floors, width, south, (parapet, hall), stair, run, outer)
    return HouseShell(width, south, hall, north, begin, outer, inner, flights)


def _flights(
    floors: int, width: float, south: float, band: tuple[float, float], stair: float, run: float, outer: float
) -> tuple[Flight, ...]:
    """The first flight rises from one end of the hall, the second from the other end."""
    low, high = south + band[0] + PARAPET_M / 2 + 0.01, south + band[0] + PARAPET_M / 2 + 0.01 + stair
    middle, flights = (low + high) / 2, []
    for floor in range(floors - 1):
        near = outer / 2 + LANDING_M
        foot, head, end = near, near + run, 0.0
        if floor == 1:
            foot, head, end = width - near, width - near - run, width
        treads = Rectangle(min(foot, head), low, max(foot, head), high)
        well = Rectangle(min(end, head), south + band[0], max(end, head), south + band[1])
        flights.append(Flight(floor, (foot, middle), (head, middle), treads, well))
    return tuple(flights)


def row_extents(random: np.random.Generator, shell: HouseShell, floors: int) -> list[RowExtent]:
    """How far the rows reach on each floor; a corner may be left out, and nothing is built above it."""
    row_ends = [RowExtent(shell.width_m, shell.width_m)]
    for floor in range(floors):
        last = row_ends[-1]
        if floor or random.random() < 0.3:
            cut = random.uniform(2.2, 0.35 * shell.width_m) if random.random() < 0.35 else 0.0
            whole = last.south_to == last.north_to == shell.width_m and shell.north_from_m == 0
            if cut and whole:
                shorter = shell.width_m - cut
                last = RowExtent(shorter, shell.width_m)
                if shell.north_m and random.random() < 0.5:
                    last = RowExtent(shell.width_m, shorter)
        row_ends.append(last)
    return row_ends[1:]


def arrange_rooms(
    random: np.random.Generator, shell: HouseShell, extent: RowExtent, floor: int, floors: int
) -> list[RoomCell] | None:
    """The rooms of one floor, the hall first; None when no choice of rooms fits."""
    required, extra = ONE_FLOOR_ROOMS if floors == 1 else UPPER_FLOOR_ROOMS if floor else GROUND_FLOOR_ROOMS
    ended = bool(random.random() < 0.75) and not any(flight.well.x1 == shell.width_m for flight in shell.flights)
    for trial in range(TRIALS):
        count = int(random.integers(0, min(len(extra), 7 - len(required)) + 1))
        chosen = list(required) + [extra[k] for k in random.permutation(len(extra))[:count].tolist()]
        names = [chosen[k] for k in random.permutation(len(chosen)).tolist()]
        if "kitchen" in names and random.random() < 0.7:  # beside the living room, to be joined by an archway
            names.remove("kitchen")
            names.insert(names.index("living room") + int(random.integers(2)), "kitchen")
        cells = _fill_rows(random, shell, extent, names, ended and trial < TRIALS // 2)
        if cells is not None:
            hall = "corridor" if floor else "hallway"
            end = min([shell.width_m, *(c.place.x0 for c in cells if c.place.y0 < shell.south_m + 0.1 < c.place.y1)])
            place = Rectangle(0.0, shell.south_m, end, shell.south_m + shell.hall_m)
            if all(_has_hall_access(cell, place, shell, floor) for cell in cells):
                return [RoomCell(hall, place), *cells]
    return None


def _fill_rows(
    random: np.random.Generator, shell: HouseShell, extent: RowExtent, names: list[str], ended: bool
) -> list[RoomCell] | None:
    """The named rooms in order as south and north row; `ended`: the last room of a row lies across the hall's end."""
    split = int(random.integers(1, len(names))) if shell.north_m else len(names)
    rows, far = (names[:split], names[split:]), list(extent)
    cells = []
    if ended:
        row = int(random.integers(2)) if shell.north_m else 0
        if far[row] < shell.width_m or len(rows[row]) < 2:
            return None
        end = _end_block(random, shell, rows[row].pop(), row)
        if end is None:
            return None
        far[row], cells = end.place.x0, [end]
    begins = (0.0, shell.north_from_m)
    depths = ((0.0, shell.south_m), (shell.south_m + shell.hall_m, shell.depth_m))
    for row, row_names in enumerate(rows):
        if row_names:
            filled = _fill_row(random, row_names, (begins[row], far[row]), depths[row])
            if filled is None:
                return None
            cells += filled
    return cells


def _end_block(random: np.random.Generator, shell: HouseShell, name: str, row: int) -> RoomCell | None:
    """A room across the end of the hall and of the south (0) or north (1) row; None when it does not fit."""
    low, high = (shell.south_m, shell.depth_m) if row else (0.0, shell.south_m + shell.hall_m)
    min_width, max_width = _width_range_m(name, high - low)
    beyond = [shell.width_m - flight.head[0] - LANDING_M - shell.outer_m for flight in shell.flights]
    max_width = min([max_width, 0.5 * shell.width_m, *beyond])
    if max_width < min_width:
        return None
    return RoomCell(name, Rectangle(shell.width_m - random.uniform(min_width, max_width), low, shell.width_m, high))


def _width_range_m(name: str, depth_m: float) -> tuple[float, float]:
    """Smallest and largest width between wall middle lines of a room of a given depth."""
    min_area, max_area, side = ROOM_SIZES[name]
    inner = depth_m - WALL_M
    return max(min_area / inner, side, inner / 2.8) + WALL_M, min(max_area / inner, 2.3 * inner) + WALL_M


def _fill_row(
    random: np.random.Generator, names: list[str], along: tuple[float, float], across: tuple[float, float]
) -> list[RoomCell] | None:
    """Rooms side by side that fill a row; None when they cannot."""
    low, high = np.array([_width_range_m(name, across[1] - across[0]) for name in names]).T
    length = along[1] - along[0]
    if np.any(low > high) or not low.sum() <= length <= high.sum():
        return None
    widths = low + (high - low) * random.random(len(names))
    slack = (high - widths) if length > widths.sum() else (widths - low)
    widths += slack * (length - widths.sum()) / max(float(slack.sum()), 1e-9)
    edges = np.concatenate(([along[0]], along[0] + np.cumsum(widths)))
    edges[-1] = along[1]
    return [
        RoomCell(name, Rectangle(float(a), across[0], float(b), across[1]))
        for name, a, b in zip(names, edges[:-1], edges[1:], strict=True)
    ]


def _has_hall_access(cell: RoomCell, hall: Rectangle, shell: HouseShell, floor: int) -> bool:
    """Whether a room that must open to the hall shares enough wall with it, clear of stairs, for a door."""
    place = cell.place
    if cell.type not in HALL_ENTERED_ROOMS or place.x0 == hall.x1:
        return True
    low, high = max(place.x0, hall.x0), min(place.x1, hall.x1)
    spans = [(low, high)]
    if place.y0 > shell.south_m:  # the flights stand on the north side
        for flight in shell.flights:
            if flight.floor in (floor, floor - 1):
                taken = flight.treads if flight.floor == floor else flight.well
                spans = [cut for a, b in spans for cut in ((a, min(b, taken.x0)), (max(a, taken.x1), b))]
    return max(b - a for a, b in spans) >= ACCESS_M
