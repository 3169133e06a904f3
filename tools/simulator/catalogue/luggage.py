"""What one travels and goes to school with: suitcases and backpacks."""

from __future__ import annotations

import numpy as np

from placegraph.runtime.arrays import F64
from placegraph.tools.simulator.catalogue._item_assembly import (
    Random,
    WantedSize,
    arc,
    chance,
    drawn,
    fitted,
    loft,
    merged,
    plate_xz,
    rounded,
)
from placegraph.tools.simulator.color_palette import METALS, VIVID, darker, pick
from placegraph.tools.simulator.house_model import Item, Material, Part
from placegraph.tools.simulator.mesh_primitives import block, box, ellipsoid, moved, tube

_Level = tuple[float, float, float, float]  # z, half width, front y, back y
_BODY: tuple[_Level, ...] = (
    (0, 0.45, -0.3, 0.28), (0.05, 0.5, -0.36, 0.3), (0.6, 0.5, -0.32, 0.3), (0.84, 0.42, -0.2, 0.28),
    (0.94, 0.26, -0.04, 0.22),
)  # fmt: skip
_POCKET: tuple[_Level, ...] = (
    (0.05, 0.36, -0.52, -0.2), (0.1, 0.4, -0.56, -0.2), (0.4, 0.4, -0.54, -0.2), (0.5, 0.32, -0.4, -0.2),
)  # fmt: skip
_FLAP: tuple[_Level, ...] = ((0.74, 0.48, -0.42, 0.3), (0.86, 0.48, -0.38, 0.3), (0.97, 0.36, -0.16, 0.26))


def _trolley(random: Random, width_m: float, depth_m: float, height_m: float) -> tuple[str, list[Part]]:
    """A hard shell with ribs, four wheels and a pulled-out handle."""
    name, color = pick(random, (*VIVID, "black", "gray", "white"))
    shell, trim = Material(color, gloss=0.5), Material((34, 34, 36), gloss=0.3)
    grip = 0.22 if chance(random, 0.5) else 0.06
    wheel, tall = 0.06 * height_m, height_m * (1 - grip)
    middle, w = (tall + wheel) / 2, width_m
    hull = moved(
        plate_xz(rounded(w, tall - wheel, 0.06), -depth_m / 2 + 0.01, depth_m / 2 - 0.01, shell), (0, 0, middle)
    )
    rib = Material(darker(color, 0.72), gloss=0.5)
    ribs = [
        block((k * w / 7, 0, wheel + 0.06 * tall), (w / 18, depth_m, tall * 0.82), rib)
        for k in (-2.4, -1.2, 0, 1.2, 2.4)
    ]
    seam = moved(plate_xz(rounded(w * 1.01, tall - wheel, 0.06), -0.008, 0.008, trim), (0, 0, middle))
    parts = [hull, merged(ribs), seam]
    wheels = [
        block((sx * w * 0.38, sy * depth_m * 0.33, 0), (0.04, 0.05, wheel * 1.3), trim)
        for sx in (-1, 1)
        for sy in (-1, 1)
    ]
    steel = Material(METALS["gray"], gloss=0.7)
    parts.append(merged(wheels))
    for sx in (-1, 1):
        parts.append(
            box(
                (sx * w * 0.2 - 0.008, depth_m * 0.3, tall * 0.9),
                (sx * w * 0.2 + 0.008, depth_m * 0.36, height_m - 0.02),
                steel,
            )
        )
    parts.append(box((-w * 0.24, depth_m * 0.27, height_m - 0.03), (w * 0.24, depth_m * 0.4, height_m), trim))
    parts.append(tube(arc((0, -depth_m * 0.1, tall - 0.01), (w * 0.17, 0.035), np.pi, 0, 4), 0.009, trim, sides=5))
    return name, parts


def _leather(random: Random, width_m: float, depth_m: float, height_m: float) -> tuple[str, list[Part]]:
    """An old suitcase standing on its long side: corners, two belts, two locks and a handle on top."""
    name, color = pick(random, ("brown", "brown", "beige", "red", "green", "blue", "black"))
    hide = Material(color, "noise", darker(color, 0.85), 0.04, gloss=0.2)
    belt, brass = Material(darker(color, 0.5)), Material((196, 160, 80), gloss=0.7)
    tall, w, d = height_m - 0.05, width_m, depth_m
    parts = [plate_xz(rounded(w, tall, 0.03), -d / 2 + 0.006, d / 2 - 0.006, hide)]
    parts = [moved(parts[0], (0, 0, tall / 2)), block((0, 0, 0.0), (w * 1.005, 0.012, tall * 1.003), belt)]
    for sx in (-1, 1):
        parts.append(block((sx * w * 0.3, 0, 0), (0.045, d, tall + 0.004), belt))
        parts.append(block((sx * w * 0.3, -d / 2, tall * 0.68), (0.055, 0.012, 0.05), brass))
        parts.append(block((sx * w * 0.16, 0, tall), (0.05, 0.04, 0.008), brass))
    corners = [
        block((sx * (w / 2 - 0.035), 0, z), (0.078, d + 0.004, 0.075), belt)
        for sx in (-1, 1)
        for z in (0.0, tall - 0.073)
    ]
    parts.append(merged(corners))
    parts.append(tube(arc((0, 0, tall), (w * 0.13, 0.045), np.pi, 0), 0.011, belt, sides=6))
    return name, parts


def suitcase(random: Random, wanted: WantedSize) -> Item:
    """An upright trolley case, or an old suitcase of leather on its long side."""
    trolley = chance(random, 0.6)
    ranges = ((0.36, 0.48), (0.22, 0.3), (0.62, 0.95)) if trolley else ((0.55, 0.75), (0.16, 0.22), (0.42, 0.52))
    width, depth, height = wanted.fill(random, *ranges)
    name, parts = (_trolley if trolley else _leather)(random, width, depth, height)
    return fitted("suitcase", parts, (width, depth, height), name)


def _sack(levels: tuple[_Level, ...], material: Material) -> Part:
    """A soft body of levels (z, half width, front y, back y) with round edges."""
    rings: list[F64] = []
    for z, half, front, back in levels:
        x = np.array([0.7, 1, 1, 0.7, -0.7, -1, -1, -0.7]) * half
        span = back - front
        y = np.array([0, 0.22, 0.86, 1, 1, 0.86, 0.22, 0]) * span + front
        rings.append(np.stack((x, y, np.full(8, z)), axis=1))
    return loft(np.array(rings), material)


def _straps(second: Material) -> list[Part]:
    """Shoulder straps at the back, nets at the sides and the loop on top."""
    black, parts = Material((32, 32, 34)), []
    for s in (-1, 1):
        strap = [(s * 0.2, 0.24, 0.9), (s * 0.26, 0.5, 0.78), (s * 0.3, 0.56, 0.5), (s * 0.4, 0.3, 0.08)]
        parts.append(tube(strap, 0.045, black, sides=5))
        parts.append(ellipsoid((s * 0.49, 0.0, 0.2), (0.07, 0.2, 0.17), second, sides=6))
    return [*parts, tube(arc((0, 0.16, 0.92), (0.1, 0.08), np.pi, 0, 4), 0.02, black, sides=4)]


def backpack(random: Random, wanted: WantedSize) -> Item:
    """A round-topped sack with a pocket, zips, side nets, two shoulder straps and a loop; or a hiker's with a flap."""
    name, color = pick(random, (*VIVID, "black", "gray", "blue"))
    cloth = Material(color, "fabric", darker(color, 0.85), 0.03)
    accent = pick(random, ("gray", "black", "orange", "yellow"))[1] if chance(random, 0.6) else darker(color, 0.65)
    second, black = Material(accent, "fabric", darker(accent, 0.85), 0.03), Material((32, 32, 34))
    parts = [_sack(_BODY, cloth), _sack(_POCKET, second)]
    parts.append(
        tube(
            [(-0.38, -0.46, 0.37), (-0.27, -0.54, 0.38), (0.27, -0.54, 0.38), (0.38, -0.46, 0.37)],
            0.014,
            black,
            sides=4,
        )
    )
    if chance(random, 0.4):
        parts.append(_sack(_FLAP, second))
        parts += [block((sx * 0.22, -0.43, 0.42), (0.07, 0.03, 0.36), black) for sx in (-1, 1)]
        parts += [block((sx * 0.22, -0.46, 0.58), (0.1, 0.03, 0.05), Material(METALS["gray"])) for sx in (-1, 1)]
    else:
        right = [(0.26, -0.24, 0.82), (0.44, -0.12, 0.77), (0.5, -0.19, 0.5)]
        line = [(-x, y, z) for x, y, z in right[::-1]] + right
        parts.append(tube(line, 0.014, black, sides=4))
    parts += _straps(second)
    width, depth = drawn(random, wanted.width_m, 0.28, 0.36), drawn(random, wanted.depth_m, 0.2, 0.28)
    return fitted("backpack", parts, (width, depth, drawn(random, wanted.height_m, 0.42, 0.55)), name)


DESIGNS = {"suitcase": suitcase, "backpack": backpack}
