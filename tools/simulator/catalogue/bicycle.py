"""Bicycles: a diamond frame, a step-through and a racing one."""

from __future__ import annotations

import numpy as np

from placegraph.tools.simulator.catalogue._item_assembly import (
    Random,
    WantedSize,
    chance,
    circle,
    drawn,
    fitted,
    hoop,
    merged,
    plate_xz,
)
from placegraph.tools.simulator.color_palette import METALS, VIVID, jitter, pick
from placegraph.tools.simulator.house_model import Item, Material, Part
from placegraph.tools.simulator.mesh_primitives import Point, block, ellipsoid, moved, tube

_BLACK = Material((30, 30, 32), gloss=0.2)
_STEEL = Material(METALS["gray"], gloss=0.7)
_WHEEL_M, _BASE_M = 0.34, 0.53  # a wheel's radius; the hubs' distance from the middle


def _wheel(x: float, thick_m: float) -> list[Part]:
    """Tyre, rim, nine pairs of spokes and a hub."""
    center = (x, 0.0, _WHEEL_M)
    tyre = hoop(center, _WHEEL_M - thick_m, thick_m, _BLACK, 18, 4)
    rim = hoop(center, _WHEEL_M - 2.2 * thick_m, 0.009, _STEEL, 18, 3)
    reach, spokes = _WHEEL_M - 2.2 * thick_m, []
    for k in range(9):
        turn = np.pi * k / 9
        dx, dz = reach * float(np.cos(turn)), reach * float(np.sin(turn))
        spokes.append(tube([(x - dx, 0, _WHEEL_M - dz), (x + dx, 0, _WHEEL_M + dz)], 0.0028, _STEEL, sides=3))
    hub = plate_xz(circle(0.03, 8, x, _WHEEL_M), -0.05, 0.05, _STEEL)
    return [tyre, rim, merged(spokes), hub]


def _frame(paint: Material, low: bool) -> list[Part]:
    """Front hub at +x: tubes between head, seat and crank; `low` steps the upper tube down to the crank."""
    rear, front = (-_BASE_M, _WHEEL_M), (_BASE_M, _WHEEL_M)
    crank, seat, head = (-0.08, 0.29), (-0.22, 0.78), (0.36, 0.8)
    neck = (0.39, 0.7)
    top = (-0.13, 0.45) if low else (-0.21, 0.74)
    lines = [(seat, crank), (crank, neck), (top, head), (head, neck)]
    tubes = [tube([(a[0], 0, a[1]), (b[0], 0, b[1])], 0.018, paint, sides=6) for a, b in lines]
    for y in (-0.045, 0.045):
        for a, b in (((-0.2, 0.7), rear), (crank, rear), (neck, front)):
            tubes.append(tube([(a[0], y * 0.4, a[1]), (b[0], y, b[1])], 0.011, paint, sides=5))
    return [merged(tubes), tube([(-0.21, 0, 0.74), (-0.24, 0, 0.9)], 0.013, _STEEL, sides=6)]


def _steering(kind: int) -> list[Part]:
    """Stem and handlebar with grips: swept back, straight, or dropped."""
    parts = [tube([(0.36, 0, 0.8), (0.34, 0, 0.95)], 0.014, _STEEL, sides=6)]
    for side in (-1, 1):
        if kind == 0:
            bar: list[Point] = [
                (0.34, 0, 0.95),
                (0.36, side * 0.12, 1.0),
                (0.28, side * 0.24, 1.02),
                (0.16, side * 0.28, 1.0),
            ]
        elif kind == 1:
            bar = [(0.34, 0, 0.95), (0.33, side * 0.15, 0.98), (0.3, side * 0.29, 0.98)]
        else:
            bar = [
                (0.38, 0, 0.95),
                (0.38, side * 0.2, 0.95),
                (0.5, side * 0.21, 0.93),
                (0.51, side * 0.21, 0.84),
                (0.4, side * 0.21, 0.8),
            ]
        parts.append(tube(bar, 0.012, _STEEL, sides=5))
        parts.append(tube(bar[-2:], 0.018, _BLACK, sides=5))
    return parts


def _drive(paint: Material) -> list[Part]:
    """Chain ring, chain, cranks and pedals, on the right side (-y when it drives to +x)."""
    ring = hoop((-0.08, -0.06, 0.29), 0.085, 0.008, _STEEL, 14, 3)
    spider = plate_xz(circle(0.04, 6, -0.08, 0.29), -0.065, -0.055, _STEEL)
    sprocket = plate_xz(circle(0.035, 6, -_BASE_M, _WHEEL_M), -0.065, -0.05, _STEEL)
    chain = [
        tube([(-0.08, -0.06, 0.29 + s * 0.085), (-_BASE_M, -0.06, _WHEEL_M + s * 0.035)], 0.005, _BLACK, sides=3)
        for s in (-1, 1)
    ]
    cranks = [
        tube([(-0.08, s * 0.075, 0.29), (-0.08 - s * 0.14, s * 0.085, 0.2 if s < 0 else 0.38)], 0.01, _STEEL, sides=4)
        for s in (-1, 1)
    ]
    pedals = [
        block((-0.08 - s * 0.14, s * 0.13, 0.19 if s < 0 else 0.37), (0.09, 0.08, 0.022), _BLACK) for s in (-1, 1)
    ]
    return [merged([ring, spider, sprocket]), merged([*chain]), merged(cranks), merged(pedals)]


def _extras(random: Random, paint: Material) -> list[Part]:
    """Mudguards, a lamp and a carrier or a basket, of a city bicycle."""
    parts = []
    for x, start, end in ((-_BASE_M, 0.1, 2.9), (_BASE_M, 0.9, 3.0)):
        steps = np.linspace(start, end, 7)
        reach = _WHEEL_M + 0.025
        path: list[Point] = [(x + reach * float(np.cos(t)), 0.0, _WHEEL_M + reach * float(np.sin(t))) for t in steps]
        parts.append(tube(path, 0.016, paint, sides=4))
    parts.append(
        ellipsoid((0.43, 0, 0.86), (0.05, 0.04, 0.04), Material((236, 232, 206), gloss=0.6, glow=0.3), sides=6)
    )
    if chance(random, 0.5):
        wicker = Material(jitter((176, 138, 88), random), "checks", (120, 88, 50), 0.04)
        parts.append(block((0.56, 0, 0.84), (0.24, 0.32, 0.2), wicker))
    else:
        parts.append(block((-0.55, 0, 0.74), (0.4, 0.13, 0.02), _BLACK))
        parts.append(tube([(-0.66, 0.05, 0.74), (-_BASE_M, 0.05, _WHEEL_M)], 0.006, _BLACK, sides=3))
    return parts


def bicycle(random: Random, wanted: WantedSize) -> Item:
    """A bicycle along x, its front wheel at +x: a city one with guards, a mountain bike or a racer."""
    kind = int(random.integers(3))
    name, color = pick(random, (*VIVID, "black", "white", "gray", "blue"))
    paint = Material(color, gloss=0.7)
    thick = (0.021, 0.029, 0.014)[kind]
    parts = [*_wheel(-_BASE_M, thick), *_wheel(_BASE_M, thick)]
    parts += _frame(paint, low=kind == 0 and chance(random, 0.6))
    parts += [*_steering(kind), *_drive(paint)]
    hide = Material(jitter((112, 66, 40), random)) if chance(random, 0.3) else _BLACK
    parts.append(ellipsoid((-0.27, 0, 0.92), (0.1, 0.07, 0.03), hide, sides=7))
    parts.append(ellipsoid((-0.17, 0, 0.92), (0.11, 0.025, 0.022), hide, sides=6))
    parts.append(tube([(-0.1, 0.03, 0.28), (-0.2, 0.15, 0.006)], 0.008, _STEEL, sides=4))
    if kind == 0:
        parts += _extras(random, paint)
    low = min(float(part.vertices[:, 2].min()) for part in parts)
    parts = [moved(part, (0, 0, -low)) for part in parts]
    width = drawn(random, wanted.width_m, 1.6, 1.82)
    height = wanted.height_m or width * float(random.uniform(0.58, 0.63))
    return fitted("bicycle", parts, (width, wanted.depth_m, height), name)


DESIGNS = {"bicycle": bicycle}
