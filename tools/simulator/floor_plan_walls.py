"""From the cells of a floor to its walls, and the sides and polygon of each room.

The cells are painted on a grid of all their edges; a wall runs where neighbouring fields differ. World frame, metres.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from placegraph.runtime.arrays import F64
from placegraph.tools.simulator.floor_plan_rooms import PARAPET_M, Rectangle, RoomCell

OUTSIDE, WELL = -1, -2  # labels of fields that are not rooms
OPEN = -1  # CellSide.line where a room ends at the head of stairs


@dataclass(frozen=True)
class WallLine:
    """A straight wall along x (axis 0) or y (axis 1), at `at_m` on the other axis, from start to end between joints."""

    axis: int
    at_m: float
    start_m: float
    end_m: float
    thickness_m: float
    parapet: bool = False

    def point(self, along_m: float, across_m: float = 0.0) -> tuple[float, float]:
        """The world point so far along the axis (a coordinate), `across_m` off the middle line."""
        across = self.at_m + across_m
        return (along_m, across) if self.axis == 0 else (across, along_m)


@dataclass(frozen=True)
class SideStretch:
    """A stretch of a room's side and what is behind the wall: a room, OUTSIDE or WELL."""

    behind: int
    start_m: float
    end_m: float


@dataclass(frozen=True)
class CellSide:
    """One straight side of a room; `inward` is the sign of the direction into the room on the other axis."""

    room: int
    line: int
    axis: int
    at_m: float  # of the face
    start_m: float
    end_m: float
    inward: int
    stretches: tuple[SideStretch, ...]

    def strip(self, start_m: float, end_m: float, depth_m: float) -> Rectangle:
        """The ground before a stretch of the side, so deep into the room."""
        low, high = sorted((self.at_m, self.at_m + self.inward * depth_m))
        return Rectangle(start_m, low, end_m, high) if self.axis == 0 else Rectangle(low, start_m, high, end_m)


@dataclass(frozen=True, eq=False)
class FloorWalls:
    """The walls of a floor, sides and polygons (N, 2) of its rooms, the outline, and the polygon of the stair well."""

    lines: tuple[WallLine, ...]
    sides: tuple[CellSide, ...]
    polygons: tuple[F64, ...]
    outline: F64
    well: F64 | None


class _LabelGrid:
    """The painted grid: `label` of every field, rows along y."""

    def __init__(self, cells: list[RoomCell], well: Rectangle | None, head: tuple[float, float] | None) -> None:
        places = [cell.place for cell in cells] + ([well] if well else [])
        self.coords = (
            np.unique([value for location in places for value in (location.x0, location.x1)]),
            np.unique([value for location in places for value in (location.y0, location.y1)]),
        )
        self.label = np.full((len(self.coords[1]) - 1, len(self.coords[0]) - 1), OUTSIDE)
        self.head = head
        for room, cell in enumerate(cells):
            self._paint(cell.place, room)
        if well:
            self._paint(well, WELL)

    def _paint(self, place: Rectangle, label: int) -> None:
        (i0, i1), (j0, j1) = (
            np.searchsorted(self.coords[0], [place.x0, place.x1]),
            np.searchsorted(self.coords[1], [place.y0, place.y1]),
        )
        self.label[j0:j1, i0:i1] = label

    def at(self, j: int, i: int) -> int:
        """The label of a field, OUTSIDE beyond the grid."""
        rows, columns = self.label.shape
        return int(self.label[j, i]) if 0 <= j < rows and 0 <= i < columns else OUTSIDE

    def pair(self, axis: int, at: int, k: int) -> tuple[int, int]:
        """The labels on the lower and the upper side of step k of grid line `at`."""
        return (self.at(at - 1, k), self.at(at, k)) if axis == 0 else (self.at(k, at - 1), self.at(k, at))

    def kind(self, axis: int, at: int, k: int, hall: int) -> str:
        """What stands there: a wall, a parapet, or nothing."""
        low, high = self.pair(axis, at, k)
        if low == high:
            return ""
        if {low, high} == {WELL, hall}:
            assert self.head is not None
            return "" if abs(float(self.coords[1 - axis][at]) - self.head[1 - axis]) < 1e-6 else "parapet"
        return "wall"


def trace_walls(
    cells: list[RoomCell], well: Rectangle | None, head: tuple[float, float] | None, outer_m: float, inner_m: float
) -> FloorWalls:
    """Walls and sides of a floor whose first cell is the hall; `well` is a stair well in it, open at `head`."""
    field = _LabelGrid(cells, well, head)
    lines, owner = _wall_lines(field, outer_m, inner_m)
    polygons, sides = [], []
    for room in range(len(cells)):
        polygon, room_sides = _trace_room(field, room, lines, owner)
        polygons.append(polygon)
        sides += room_sides
    well_polygon = _trace_room(field, WELL, lines, owner)[0] if well else None
    return FloorWalls(tuple(lines), tuple(sides), tuple(polygons), _outline(field, outer_m), well_polygon)


def _wall_lines(
    field: _LabelGrid, outer_m: float, inner_m: float
) -> tuple[list[WallLine], dict[tuple[int, int, int], int]]:
    """All walls, and the wall of each step (axis, grid line, step) of the grid; what is in one line is one wall."""
    lines: list[WallLine] = []
    owner: dict[tuple[int, int, int], int] = {}
    for axis in (0, 1):
        steps, across = len(field.coords[axis]) - 1, field.coords[1 - axis]
        for at in range(len(across)):
            kinds = [field.kind(axis, at, k, hall=0) for k in range(steps)]
            k = 0
            while k < steps:
                first = k
                while k < steps and kinds[k] == kinds[first]:
                    k += 1
                if kinds[first]:
                    outer = any(OUTSIDE in field.pair(axis, at, step) for step in range(first, k))
                    parapet = kinds[first] == "parapet"
                    thick = PARAPET_M if parapet else outer_m if outer else inner_m
                    ends = (float(field.coords[axis][first]), float(field.coords[axis][k]))
                    owner |= {(axis, at, step): len(lines) for step in range(first, k)}
                    lines.append(WallLine(axis, float(across[at]), *ends, thick, parapet))
    return lines, owner


def _contour(field: _LabelGrid, labels: tuple[int, ...]) -> list[tuple[int, int]]:
    """Grid nodes (column, row) around all fields of these labels, counterclockwise, one per corner."""
    after: dict[tuple[int, int], tuple[int, int]] = {}
    rows, columns = field.label.shape
    for j in range(rows):
        for i in range(columns):
            if field.at(j, i) in labels:
                for dj, di, start, end in (
                    (-1, 0, (i, j), (i + 1, j)),
                    (0, 1, (i + 1, j), (i + 1, j + 1)),
                    (1, 0, (i + 1, j + 1), (i, j + 1)),
                    (0, -1, (i, j + 1), (i, j)),
                ):
                    if field.at(j + dj, i + di) not in labels:
                        after[start] = end
    node = min(after)
    nodes = [node]
    while (node := after[node]) != nodes[0]:
        nodes.append(node)
    return [
        node_here
        for before, node_here, then in zip(nodes[-1:] + nodes[:-1], nodes, nodes[1:] + nodes[:1], strict=True)
        if (before[0] == node_here[0]) != (node_here[0] == then[0])
    ]


def _inset_contour(field: _LabelGrid, ring: list[tuple[int, int]], insets_m: list[float]) -> F64:
    """The corners (N, 2) of a contour in metres, each side moved inward (to its left) by its inset."""
    moved = []
    for (ai, aj), (bi, bj), inset in zip(ring, ring[1:] + ring[:1], insets_m, strict=True):
        if aj == bj:
            moved.append(float(field.coords[1][aj]) + inset * np.sign(bi - ai))
        else:
            moved.append(float(field.coords[0][ai]) - inset * np.sign(bj - aj))
    corners = []
    for k, (here, then) in enumerate(zip(ring, ring[1:] + ring[:1], strict=True)):
        corners.append((moved[k - 1], moved[k]) if here[1] == then[1] else (moved[k], moved[k - 1]))
    return np.array(corners, float)


def _outline(field: _LabelGrid, outer_m: float) -> F64:
    labels = tuple(int(label) for label in np.unique(field.label) if label != OUTSIDE)
    ring = _contour(field, labels)
    return _inset_contour(field, ring, [-outer_m / 2] * len(ring))


def _trace_room(
    field: _LabelGrid, room: int, lines: list[WallLine], owner: dict[tuple[int, int, int], int]
) -> tuple[F64, list[CellSide]]:
    """A room's polygon between the faces of its walls, and its sides."""
    ring = _contour(field, (room,))
    walls, insets = [], []
    for (ai, aj), (bi, bj) in zip(ring, ring[1:] + ring[:1], strict=True):
        key = (0, aj, min(ai, bi)) if aj == bj else (1, ai, min(aj, bj))
        walls.append(owner.get(key, OPEN))
        insets.append(lines[walls[-1]].thickness_m / 2 if walls[-1] != OPEN else 0.0)
    polygon = _inset_contour(field, ring, insets)
    sides = []
    for k, ((ai, aj), (bi, bj)) in enumerate(zip(ring, ring[1:] + ring[:1], strict=True)):
        axis = 0 if aj == bj else 1
        a, b = polygon[k], polygon[(k + 1) % len(ring)]
        inward = int(np.sign(bi - ai)) if axis == 0 else -int(np.sign(bj - aj))
        start, end = sorted((float(a[axis]), float(b[axis])))
        steps = range(*sorted((ai, bi))) if axis == 0 else range(*sorted((aj, bj)))
        stretches = _side_stretches(field, axis, aj if axis == 0 else ai, steps, inward, (start, end))
        sides.append(CellSide(room, walls[k], axis, float(a[1 - axis]), start, end, inward, stretches))
    return polygon, sides


def _side_stretches(
    field: _LabelGrid, axis: int, at: int, steps: range, inward: int, ends: tuple[float, float]
) -> tuple[SideStretch, ...]:
    """What lies behind a side, stretch by stretch, clipped to the side's ends."""
    stretches: list[SideStretch] = []
    for k in steps:
        behind = field.pair(axis, at, k)[0 if inward > 0 else 1]
        start = max(float(field.coords[axis][k]), ends[0])
        end = min(float(field.coords[axis][k + 1]), ends[1])
        if stretches and stretches[-1].behind == behind:
            stretches[-1] = SideStretch(behind, stretches[-1].start_m, end)
        else:
            stretches.append(SideStretch(behind, start, end))
    return tuple(stretches)
