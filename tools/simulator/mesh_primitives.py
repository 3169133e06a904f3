"""Triangle meshes of simple solids from which furniture is assembled.

All functions return a Part in metres with outward faces; angles are radians. `moved` and `turned` place a Part.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from placegraph.runtime.arrays import I32
from placegraph.tools.simulator.house_model import Material, Part

Point = tuple[float, float, float]

_BOX_FACES = np.array(
    [[0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7], [0, 1, 5], [0, 5, 4],
     [1, 2, 6], [1, 6, 5], [2, 3, 7], [2, 7, 6], [3, 0, 4], [3, 4, 7]], np.int32
)  # fmt: skip


def box(low: Point, high: Point, material: Material) -> Part:
    """An axis-aligned box between two corners."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    ring = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
    return Part(np.array([(x, y, z) for z in (z0, z1) for x, y in ring], float), _BOX_FACES, material)


def block(center: Point, size: Point, material: Material) -> Part:
    """An axis-aligned box by the middle of its *bottom* face and its size."""
    (x, y, z), (w, d, h) = center, size
    return box((x - w / 2, y - d / 2, z), (x + w / 2, y + d / 2, z + h), material)


def lathe(
    profile: Sequence[tuple[float, float]], material: Material, center: Point = (0, 0, 0), sides: int = 16
) -> Part:
    """A solid of revolution about z: profile of (radius, height) from bottom to top; a radius of 0 closes an end."""
    angles = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    rings = np.array([[(r * np.cos(a), r * np.sin(a), z) for a in angles] for r, z in profile])
    faces = []
    for k in range(len(profile) - 1):
        for i in range(sides):
            a, b = k * sides + i, k * sides + (i + 1) % sides
            if profile[k][0] > 0:
                faces.append((a, b, b + sides))
            if profile[k + 1][0] > 0:
                faces.append((a, b + sides, a + sides))
    return Part(rings.reshape(-1, 3) + np.array(center), np.array(faces, np.int32), material)


def cylinder(
    center: Point,
    radius_m: float,
    height_m: float,
    material: Material,
    top_radius_m: float | None = None,
    sides: int = 16,
) -> Part:
    """An upright closed cylinder, or frustum, standing on `center`."""
    top = radius_m if top_radius_m is None else top_radius_m
    return lathe([(0, 0), (radius_m, 0), (top, height_m), (0, height_m)], material, center, sides)


def ellipsoid(center: Point, radii: Point, material: Material, sides: int = 14) -> Part:
    """An ellipsoid around `center`."""
    steps = np.linspace(-np.pi / 2, np.pi / 2, max(sides // 2, 4) + 1)
    profile = [
        (max(float(np.cos(t)), 0.0) if 0 < i < len(steps) - 1 else 0.0, float(np.sin(t))) for i, t in enumerate(steps)
    ]
    part = lathe(profile, material, sides=sides)
    return Part(part.vertices * np.array(radii) + np.array(center), part.faces, material)


def tube(points: Sequence[Point], radius_m: float, material: Material, sides: int = 8) -> Part:
    """A pipe along a polyline, closed at both ends."""
    path = np.array(points, float)
    angles = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    ways = np.diff(path, axis=0)
    ways = ways / np.linalg.norm(ways, axis=1, keepdims=True)
    side = np.cross(ways[0], (0.0, 0.0, 1.0) if abs(ways[0][2]) < 0.9 else (1.0, 0.0, 0.0))
    rings = []
    for i, point in enumerate(path):
        way = ways[max(i - 1, 0)] + ways[min(i, len(ways) - 1)]
        way = way / max(float(np.linalg.norm(way)), 1e-9)
        side = side - way * float(side @ way)  # carried along the path, so that the pipe does not twist
        side = side / np.linalg.norm(side)
        up = np.cross(side, way)
        rings.append(point + radius_m * (np.cos(angles)[:, None] * side + np.sin(angles)[:, None] * up))
    faces = []
    for k in range(len(path) - 1):
        for i in range(sides):
            a, b = k * sides + i, k * sides + (i + 1) % sides
            faces += [(a, b + sides, b), (a, a + sides, b + sides)]
    last = (len(path) - 1) * sides
    for i in range(1, sides - 1):
        faces += [(0, i, i + 1), (last, last + i + 1, last + i)]
    return Part(np.concatenate(rings), np.array(faces, np.int32), material)


def quads(corners: Sequence[Sequence[Point]], material: Material) -> Part:
    """Quads, each counterclockwise from outside, as one part."""
    faces = [(4 * k + a, 4 * k + b, 4 * k + c) for k in range(len(corners)) for a, b, c in ((0, 1, 2), (0, 2, 3))]
    return Part(np.array(corners, float).reshape(-1, 3), np.array(faces, np.int32).reshape(-1, 3), material)


def grid_faces(rows: int, columns: int) -> I32:
    """Faces of a grid of vertices, row by row, that face the viewer when columns run right and rows run up."""
    starts = [i * columns + j for i in range(rows - 1) for j in range(columns - 1)]
    triangles = [((a, a + 1, a + columns + 1), (a, a + columns + 1, a + columns)) for a in starts]
    return np.array(triangles, np.int32).reshape(-1, 3)


def extrude(outline: Sequence[tuple[float, float]], z0: float, z1: float, material: Material) -> Part:
    """An upright prism over a *convex* outline given counterclockwise."""
    n = len(outline)
    vertices = np.array([(x, y, z) for z in (z0, z1) for x, y in outline], float)
    faces = [(i, (i + 1) % n, n + (i + 1) % n) for i in range(n)] + [(i, n + (i + 1) % n, n + i) for i in range(n)]
    faces += [(0, i + 1, i) for i in range(1, n - 1)] + [(n, n + i, n + i + 1) for i in range(1, n - 1)]
    return Part(vertices, np.array(faces, np.int32), material)


def turned(part: Part, angle: float, axis: str = "z", about: Point = (0, 0, 0)) -> Part:
    """A part turned about an axis through `about`, right-handed."""
    i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    turn = np.eye(3)
    turn[i, i] = turn[j, j] = np.cos(angle)
    turn[i, j], turn[j, i] = -np.sin(angle), np.sin(angle)
    return Part((part.vertices - np.array(about)) @ turn.T + np.array(about), part.faces, part.material)


def moved(part: Part, by: Point) -> Part:
    """A part moved by a vector."""
    return Part(part.vertices + np.array(by), part.faces, part.material)
