"""Fitting parts into one item of a wanted size, and the solids that only things and decoration need."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from placegraph.runtime.arrays import F64
from placegraph.tools.simulator.house_model import Item, Material, Part, SupportSurface
from placegraph.tools.simulator.mesh_primitives import Point, extrude, lathe, moved, turned

Outline = Sequence[tuple[float, float]]
Random = np.random.Generator
Sizes = tuple[float | None, float | None, float | None]


class WantedSize(NamedTuple):
    """The sizes in metres that an item must have along x, y and z; the design chooses those that are None."""

    width_m: float | None = None
    depth_m: float | None = None
    height_m: float | None = None

    def fill(
        self, random: Random, *ranges: tuple[float, float], always_draw: bool = False
    ) -> tuple[float, float, float]:
        """Width, depth and height; missing ones are drawn from their ranges.

        always_draw: wanted sizes are drawn, too, so that they do not change the random numbers that follow.
        """
        filled = []
        for size_m, (low, high) in zip(self, ranges, strict=True):
            draw = random.uniform(low, high) if always_draw or size_m is None else size_m
            filled.append(float(draw if size_m is None else size_m))
        width, depth, height = filled
        return width, depth, height


def fitted(
    name: str, parts: Sequence[Part], sizes: Sizes, color_name: str = "", surfaces: Sequence[SupportSurface] = ()
) -> Item:
    """An item centred over its origin and stretched to the sizes (x, y, z) in metres that are not None."""
    vertices = np.concatenate([part.vertices for part in parts])
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    origin = np.array([(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, low[2]])
    spans = high - low
    stretch = np.array([1.0 if size is None else size / span for size, span in zip(sizes, spans, strict=True)])
    fit = [Part((part.vertices - origin) * stretch, part.faces, part.material) for part in parts]
    tops = []
    for top in surfaces:
        x0, y0, z = ((np.array([top.x0, top.y0, top.z]) - origin) * stretch).tolist()
        x1, y1, _ = ((np.array([top.x1, top.y1, top.z]) - origin) * stretch).tolist()
        tops.append(SupportSurface(x0, y0, x1, y1, z, top.clearance_m * float(stretch[2])))
    return Item(name, tuple(fit), color_name, tuple(tops))


def drawn(random: Random, size_m: float | None, low: float, high: float) -> float:
    """The size that is given, in metres, or else one from a range."""
    return float(random.uniform(low, high)) if size_m is None else size_m


def chance(random: Random, share: float) -> bool:
    """True in a share of all draws."""
    return bool(random.random() < share)


def merged(parts: Sequence[Part]) -> Part:
    """One part of many that share the first one's material."""
    starts = np.cumsum([0] + [len(part.vertices) for part in parts])
    faces = [part.faces + start for part, start in zip(parts, starts[:-1], strict=True)]
    stacked = np.concatenate(faces).astype(np.int32)
    return Part(np.concatenate([part.vertices for part in parts]), stacked, parts[0].material)


def loft(rings: F64, material: Material) -> Part:
    """A closed skin over a pile of rings (K, N, 3) in metres, each counterclockwise seen from the last one's side."""
    count, sides = rings.shape[:2]
    faces = []
    for k in range(count - 1):
        for i in range(sides):
            a, b = k * sides + i, k * sides + (i + 1) % sides
            faces += [(a, b, b + sides), (a, b + sides, a + sides)]
    last = (count - 1) * sides
    faces += [(0, i + 1, i) for i in range(1, sides - 1)]
    faces += [(last, last + i, last + i + 1) for i in range(1, sides - 1)]
    return Part(rings.reshape(-1, 3), np.array(faces, np.int32), material)


def hoop(center: Point, radius_m: float, thick_m: float, material: Material, sides: int = 16, rounds: int = 6) -> Part:
    """A ring of round section in the x-z plane around `center`; thick_m is the section's radius."""
    angles = np.linspace(-np.pi / 2, 1.5 * np.pi, rounds + 1)
    profile = [(radius_m + thick_m * float(np.cos(t)), thick_m * float(np.sin(t))) for t in angles]
    return moved(turned(lathe(profile, material, sides=sides), np.pi / 2, "x"), center)


def circle(
    radius_m: float, sides: int = 16, x: float = 0.0, y: float = 0.0, y_radius_m: float | None = None
) -> Outline:
    """A circle's outline, or an ellipse's, counterclockwise."""
    tall = radius_m if y_radius_m is None else y_radius_m
    angles = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    return [(x + radius_m * float(np.cos(a)), y + tall * float(np.sin(a))) for a in angles]


def rounded(width_m: float, height_m: float, radius_m: float, steps: int = 3) -> Outline:
    """A rectangle's outline around (0, 0) with round corners, counterclockwise."""
    points = []
    for k, (sx, sy) in enumerate([(1, 1), (-1, 1), (-1, -1), (1, -1)]):
        cx, cy = sx * (width_m / 2 - radius_m), sy * (height_m / 2 - radius_m)
        for t in np.linspace(k * np.pi / 2, (k + 1) * np.pi / 2, steps + 1):
            points.append((cx + radius_m * float(np.cos(t)), cy + radius_m * float(np.sin(t))))
    return points


def plate_xz(outline: Outline, y0: float, y1: float, material: Material) -> Part:
    """An upright plate facing -y over a convex (x, z) outline, counterclockwise seen from the front."""
    return turned(extrude(outline, -y1, -y0, material), np.pi / 2, "x")


def plate_yz(outline: Outline, x0: float, x1: float, material: Material) -> Part:
    """An upright plate facing +x over a convex (y, z) outline, counterclockwise seen from +x."""
    part = extrude(outline, x0, x1, material)
    return Part(part.vertices[:, [2, 0, 1]], part.faces, material)


def arc(center: Point, radii: tuple[float, float], start: float, end: float, steps: int = 6) -> list[Point]:
    """Points on an elliptic arc in the x-z plane, from one angle to another."""
    x, y, z = center
    angles = np.linspace(start, end, steps + 1)
    return [(x + radii[0] * float(np.cos(t)), y, z + radii[1] * float(np.sin(t))) for t in angles]


def assembled(
    name: str,
    parts: Sequence[Part],
    sizes: tuple[float, float, float],
    color_name: str,
    surfaces: Sequence[SupportSurface] = (),
) -> Item:
    """An item stretched to exactly its sizes in metres; of many parts, those of equal material become one."""
    if len(parts) <= 25:
        return fitted(name, parts, sizes, color_name, surfaces)
    groups: dict[Material, list[Part]] = {}
    for part in parts:
        groups.setdefault(part.material, []).append(part)
    joined: list[Part] = []
    for material, group in groups.items():  # a stretched texture (scale 0) must stay one per part
        joined += group if material.scale_m == 0 else [merged(group)]
    return fitted(name, joined, sizes, color_name, surfaces)
