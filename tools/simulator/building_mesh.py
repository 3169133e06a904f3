"""Meshes of the building: walls with openings, parapets, slabs, ceilings, and the surface finish of each room.

World frame, metres. The faces of a wall's core lie a little behind the finish of the rooms, which is what a camera
sees.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from placegraph.runtime.arrays import F64
from placegraph.tools.simulator.floor_plan_openings import FloorOpenings
from placegraph.tools.simulator.floor_plan_rooms import Rectangle
from placegraph.tools.simulator.floor_plan_walls import CellSide, FloorWalls, WallLine
from placegraph.tools.simulator.house_model import Floor, Material, Part, WallOpening
from placegraph.tools.simulator.mesh_primitives import box, quads
from placegraph.tools.simulator.surface_finishes import Finish, building_material, room_finish, trim_material

BEHIND_M = 0.003  # the wall core behind the wall finish, the slab below the floor
PARAPET_HIGH_M = 1.0
BASEBOARD_M = (0.012, 0.07)  # thickness, height
CASING_M = (0.07, 0.016)  # of doors and archways: width, thickness
Band = tuple[float, float, float, float]  # start, end along a wall, low, high


@dataclass(frozen=True, eq=False)
class FloorShape:
    """One floor with its openings, the slab below it, and the stair wells in its own slab and in the one above."""

    floor: Floor
    grid: FloorWalls
    openings: FloorOpenings
    slab_m: float
    well: F64 | None
    well_above: F64 | None


def building_parts(random: np.random.Generator, shape: FloorShape) -> list[Part]:
    """All meshes of one floor."""
    plaster, trim = building_material(random), trim_material(random)
    parts = _slab(shape, plaster) + _ceiling(shape, building_material(random))
    for index, line in enumerate(shape.grid.lines):
        if line.parapet:
            parts += _parapet(line, shape.floor.z_m, plaster, trim)
        else:
            holes = shape.openings.by_line.get(index, [])
            parts += _wall_core(shape, line, holes, plaster)
    for k, room in enumerate(shape.floor.rooms):
        finish = room_finish(random, room.type)
        parts += _floor_cover(shape, k, finish) + _wall_linings(shape, k, finish)
        if finish.baseboard is not None:
            parts += _baseboards(shape, k, finish.baseboard)
        parts += _beams(shape, k, finish)
    return parts + _thresholds(shape, trim) + _casings(random, shape, trim)


def split_into_rectangles(polygon: F64, holes: tuple[F64, ...]) -> list[Rectangle]:
    """An axis-aligned polygon (N, 2) minus rectangular holes as rectangles, merged along y where possible."""
    corners = np.concatenate((polygon, *holes))
    xs, ys = np.unique(corners[:, 0]), np.unique(corners[:, 1])
    rectangles = []
    for x0, x1 in pairwise(xs.tolist()):
        start = None
        for y0, y1 in [*pairwise(ys.tolist()), (ys[-1], ys[-1])]:
            x, y = (x0 + x1) / 2, (y0 + y1) / 2
            solid = y1 > y0 and _contains(polygon, x, y) and not any(_contains(hole, x, y) for hole in holes)
            if solid and start is None:
                start = y0
            if not solid and start is not None:
                rectangles.append(Rectangle(float(x0), float(start), float(x1), float(y0)))
                start = None
    return rectangles


def _contains(polygon: F64, x: float, y: float) -> bool:
    a, b = polygon, np.roll(polygon, -1, axis=0)
    crossed = ((a[:, 1] > y) != (b[:, 1] > y)) & (a[:, 0] == b[:, 0]) & (a[:, 0] > x)
    return bool(crossed.sum() % 2)


def subtract_rectangles(whole: Band, holes: list[Band]) -> list[Band]:
    """A wall rectangle minus its openings, as rectangles."""
    start, end, low, high = whole
    cuts = sorted({start, end, *(min(max(value, start), end) for hole in holes for value in hole[:2])})
    pieces = []
    for a, b in pairwise(cuts):
        level = low
        spans = sorted((hole[2], hole[3]) for hole in holes if hole[0] < (a + b) / 2 < hole[1])
        for bottom, top in [*spans, (high, high)]:
            if min(bottom, high) > level:
                pieces.append((a, b, level, min(bottom, high)))
            level = max(level, top)
    return pieces


def _opening_bands(holes: list[WallOpening], z_m: float) -> list[Band]:
    return [
        (hole.start_m, hole.end_m, z_m + hole.low_m - (0.01 if hole.low_m == 0 else 0), z_m + hole.high_m)
        for hole in holes
    ]


def _wall_core(shape: FloorShape, line: WallLine, holes: list[WallOpening], material: Material) -> list[Part]:
    """The boxes of a wall around its openings, extended at both ends to fill the corners."""
    floor, half = shape.floor, line.thickness_m / 2 - BEHIND_M
    ends = [_reach_beyond_end(shape.grid, line, end) for end in (line.start_m, line.end_m)]
    whole = (line.start_m - ends[0], line.end_m + ends[1], floor.z_m - 0.002, floor.z_m + floor.height_m)
    parts = []
    for start, end, low, high in subtract_rectangles(whole, _opening_bands(holes, floor.z_m)):
        a, b = line.point(start, -half), line.point(end, half)
        parts.append(box((*a, low), (*b, high), material))
    return parts


def _reach_beyond_end(grid: FloorWalls, line: WallLine, end: float) -> float:
    """Half the thickness of the wall that crosses at the end of a line, so that corners are filled."""
    for crossing in grid.lines:
        crosses = crossing.start_m - 1e-6 <= line.at_m <= crossing.end_m + 1e-6
        if crossing.axis != line.axis and abs(crossing.at_m - end) < 1e-6 and crosses and not crossing.parapet:
            return crossing.thickness_m / 2 - BEHIND_M
    return 0.0


def _parapet(line: WallLine, z_m: float, body: Material, rail: Material) -> list[Part]:
    """A low wall with a rail on top."""
    half, top = line.thickness_m / 2, z_m + PARAPET_HIGH_M
    # extended by half its thickness, which closes the corner of two parapets
    low, high = line.point(line.start_m - half, -half), line.point(line.end_m, half)
    parts = [box((*low, z_m - 0.002), (*high, top - 0.04), body)]
    low, high = line.point(line.start_m - half, -half - 0.01), line.point(line.end_m, half + 0.01)
    return [*parts, box((*low, top - 0.04), (*high, top), rail)]


def _slab(shape: FloorShape, material: Material) -> list[Part]:
    z = shape.floor.z_m
    holes = () if shape.well is None else (shape.well,)
    return [
        box(
            (rectangle.x0, rectangle.y0, z - shape.slab_m + BEHIND_M),
            (rectangle.x1, rectangle.y1, z - BEHIND_M),
            material,
        )
        for rectangle in split_into_rectangles(shape.grid.outline, holes)
    ]


def _ceiling(shape: FloorShape, material: Material) -> list[Part]:
    z = shape.floor.z_m + shape.floor.height_m
    holes = () if shape.well_above is None else (shape.well_above,)
    return [_horizontal_mesh(split_into_rectangles(shape.grid.outline, holes), z, material, up=False)]


def _floor_cover(shape: FloorShape, room: int, finish: Finish) -> list[Part]:
    return [
        _horizontal_mesh(split_into_rectangles(shape.grid.polygons[room], ()), shape.floor.z_m, finish.floor, up=True)
    ]


def _horizontal_mesh(places: list[Rectangle], z_m: float, material: Material, up: bool) -> Part:
    """Level rectangles as one mesh, facing up or down."""
    corners = [[(p.x0, p.y0, z_m), (p.x1, p.y0, z_m), (p.x1, p.y1, z_m), (p.x0, p.y1, z_m)] for p in places]
    return quads([quad if up else quad[::-1] for quad in corners], material)


def _room_sides(shape: FloorShape, room: int) -> list[CellSide]:
    return [
        side
        for side in shape.grid.sides
        if side.room == room and side.line >= 0 and not shape.grid.lines[side.line].parapet
    ]


def _wall_linings(shape: FloorShape, room: int, finish: Finish) -> list[Part]:
    """The wall faces of a room: one material below finish.dado_m, another above."""
    z, top = shape.floor.z_m, shape.floor.z_m + shape.floor.height_m
    parts = []
    for material, low, high in ((finish.dado, z, z + finish.dado_m), (finish.wall, z + finish.dado_m, top)):
        corners = []
        for side in _room_sides(shape, room) if high > low else []:
            holes = _opening_bands(shape.openings.by_line.get(side.line, []), z)
            corners += [
                _vertical_quad(side, piece)
                for piece in subtract_rectangles((side.start_m, side.end_m, low, high), holes)
            ]
        if corners:
            parts.append(quads(corners, material))
    return parts


def _vertical_quad(side: CellSide, piece: Band, proud_m: float = 0.0) -> list[tuple[float, float, float]]:
    """A quad on the face of a side, or `proud_m` in front of it, that faces into the room."""
    start, end, low, high = piece
    across = side.at_m + side.inward * proud_m
    (ax, ay), (bx, by) = ((start, across), (end, across)) if side.axis == 0 else ((across, start), (across, end))
    quad = [(ax, ay, low), (bx, by, low), (bx, by, high), (ax, ay, high)]
    faces_right = (side.inward < 0) == (side.axis == 0)  # the quad as listed faces -y, or +x
    return quad if faces_right else quad[::-1]


def _strip_box(side: CellSide, piece: Band, thick_m: float, material: Material) -> Part:
    """A box on the face of a side."""
    ground = side.strip(piece[0], piece[1], thick_m)
    return box((ground.x0, ground.y0, piece[2]), (ground.x1, ground.y1, piece[3]), material)


def _baseboards(shape: FloorShape, room: int, material: Material) -> list[Part]:
    z, parts = shape.floor.z_m, []
    for side in _room_sides(shape, room):
        doors = [h for h in shape.openings.by_line.get(side.line, []) if h.low_m == 0]
        holes = [(a - CASING_M[0], b + CASING_M[0], low, high) for a, b, low, high in _opening_bands(doors, z)]
        for piece in subtract_rectangles((side.start_m, side.end_m, z, z + BASEBOARD_M[1]), holes):
            parts.append(_strip_box(side, piece, BASEBOARD_M[0], material))
    return parts


def _beams(shape: FloorShape, room: int, finish: Finish) -> list[Part]:
    """Ceiling beams across a rectangular room, if its finish has any; none across a stair well."""
    polygon = shape.grid.polygons[room]
    welled = shape.well_above is not None and _contains(polygon, *shape.well_above.mean(axis=0).tolist())
    if finish.beam is None or len(polygon) != 4 or welled:
        return []
    (x0, y0), (x1, y1) = polygon.min(axis=0), polygon.max(axis=0)
    along_x = x1 - x0 > y1 - y0
    length = x1 - x0 if along_x else y1 - y0
    top, count = shape.floor.z_m + shape.floor.height_m, max(1, int(length / 1.4) - 1)
    parts = []
    for k in range(count):
        middle = (x0 if along_x else y0) + (k + 1) * length / (count + 1)
        low = (middle - 0.06, y0) if along_x else (x0, middle - 0.06)
        high = (middle + 0.06, y1) if along_x else (x1, middle + 0.06)
        parts.append(box((*low, top - finish.beam_m), (*high, top), finish.beam))
    return parts


def _thresholds(shape: FloorShape, material: Material) -> list[Part]:
    """The floor within doors and archways."""
    places = []
    for index, line in enumerate(shape.grid.lines):
        for hole in shape.openings.by_line.get(index, []):
            if hole.low_m == 0:
                (ax, ay), (bx, by) = (
                    line.point(hole.start_m, -line.thickness_m / 2),
                    line.point(hole.end_m, line.thickness_m / 2),
                )
                places.append(Rectangle(min(ax, bx), min(ay, by), max(ax, bx), max(ay, by)))
    return [_horizontal_mesh(places, shape.floor.z_m, material, up=True)] if places else []


def _casings(random: np.random.Generator, shape: FloorShape, material: Material) -> list[Part]:
    """Frames around doors and most archways on both faces of the wall, and sills below windows."""
    z, (wide, thick), parts = shape.floor.z_m, CASING_M, []
    framed = bool(random.random() < 0.8)
    for side in shape.grid.sides:
        for hole in shape.openings.by_line.get(side.line, []):
            if not side.start_m <= hole.start_m < side.end_m:
                continue
            a, b, top = hole.start_m, hole.end_m, z + hole.high_m
            if hole.kind == "window":
                ends = (max(a - 0.06, side.start_m), min(b + 0.06, side.end_m))
                parts.append(_strip_box(side, (*ends, z + hole.low_m - 0.035, z + hole.low_m - 0.001), 0.06, material))
            elif hole.kind == "door" or framed:
                for piece in ((a - wide, a, z, top), (b, b + wide, z, top), (a - wide, b + wide, top, top + wide)):
                    parts.append(_strip_box(side, piece, thick, material))
    return parts
