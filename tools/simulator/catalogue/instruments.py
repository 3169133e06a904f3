"""Instruments: guitars on their stands and upright pianos."""

from __future__ import annotations

import numpy as np

from placegraph.tools.simulator.catalogue._item_assembly import (
    Random,
    WantedSize,
    chance,
    circle,
    drawn,
    fitted,
    loft,
    merged,
    plate_xz,
)
from placegraph.tools.simulator.color_palette import METALS, VIVID, WOODS, darker, jitter, pick
from placegraph.tools.simulator.house_model import Item, Material, Part, SupportSurface
from placegraph.tools.simulator.mesh_primitives import block, box, moved, tube, turned

_BODY = ((0.06, 0.0), (0.135, 0.02), (0.18, 0.07), (0.19, 0.13), (0.17, 0.2), (0.125, 0.26), (0.12, 0.3), (0.14, 0.35),
         (0.142, 0.4), (0.11, 0.45), (0.05, 0.475))  # fmt: skip
_ELECTRIC = ((0.07, 0.0), (0.14, 0.03), (0.165, 0.09), (0.15, 0.16), (0.11, 0.21), (0.115, 0.27), (0.14, 0.32),
             (0.15, 0.37), (0.1, 0.4))  # fmt: skip


def _slab(
    profile: tuple[tuple[float, float], ...], y0: float, y1: float, material: Material, shrink: float = 1.0
) -> Part:
    """An upright slab by its (half width, z) from bottom to top, which need not be convex."""
    middle = (profile[0][1] + profile[-1][1]) / 2
    rings = []
    for half, z in profile:
        w, at = half * shrink, middle + (z - middle) * shrink
        rings.append([(-w, y0, at), (w, y0, at), (w, y1, at), (-w, y1, at)])
    return loft(np.array(rings), material)


def _neck(top_m: float, nut_m: float, head_m: float, y: float, wood: Material, steel: Material) -> list[Part]:
    """The neck from the body to the nut with its frets, the head with six pegs."""
    dark = Material((46, 32, 26))
    board = box((-0.024, y - 0.008, top_m), (0.024, y, nut_m), dark)
    frets = [
        block((0, y - 0.009, z), (0.048, 0.003, 0.003), steel) for z in np.linspace(top_m + 0.03, nut_m, 10).tolist()
    ]
    back = box((-0.022, y, top_m), (0.022, y + 0.018, nut_m), wood)
    outline = [
        (-0.026, nut_m),
        (0.026, nut_m),
        (0.038, head_m - 0.02),
        (0.024, head_m),
        (-0.024, head_m),
        (-0.038, head_m - 0.02),
    ]
    head = plate_xz(outline, y - 0.002, y + 0.014, wood)
    pegs = [
        block((sx * 0.048, y + 0.005, nut_m + 0.035 + 0.05 * k), (0.03, 0.012, 0.018), steel)
        for sx in (-1, 1)
        for k in range(3)
    ]
    return [board, merged(frets), back, head, merged(pegs)]


def _acoustic(random: Random) -> tuple[str, list[Part]]:
    name, color = pick(random, ("light brown", "light brown", "beige", "brown", "black"), WOODS)
    top = Material(color, "wood", darker(color, 0.85), 0.2, int(random.integers(1000)), gloss=0.5)
    side, steel = (
        Material(darker(color, 0.55), "wood", darker(color, 0.4), 0.2, gloss=0.4),
        Material((206, 196, 150), gloss=0.6),
    )
    dark = Material((30, 24, 22))
    parts = [_slab(_BODY, -0.045, 0.05, side), _slab(_BODY, -0.05, -0.04, top, 0.975)]
    parts.append(moved(plate_xz(circle(0.058, 14), -0.0515, -0.05, Material((224, 200, 150))), (0, 0, 0.31)))
    parts.append(moved(plate_xz(circle(0.048, 14), -0.053, -0.05, dark), (0, 0, 0.31)))
    parts.append(block((0, -0.055, 0.12), (0.16, 0.012, 0.025), dark))
    if chance(random, 0.5):
        guard = [(0.03, 0.19), (0.11, 0.17), (0.1, 0.25), (0.05, 0.3)]
        parts.append(plate_xz(guard, -0.0512, -0.05, Material((60, 30, 24), gloss=0.6)))
    strings = [block((x, -0.06, 0.13), (0.0025, 0.002, 0.7), steel) for x in np.linspace(-0.017, 0.017, 6).tolist()]
    wood = Material(darker(color, 0.7), "wood", darker(color, 0.5), 0.2)
    return name, [*parts, *_neck(0.4, 0.84, 1.0, -0.05, wood, steel), merged(strings)]


def _electric(random: Random) -> tuple[str, list[Part]]:
    """A thin coloured body with two horns, pickups and knobs."""
    name, color = pick(random, (*VIVID, "black", "white"))
    paint, steel, dark = (
        Material(color, gloss=0.8),
        Material(METALS["gray"], gloss=0.8),
        Material((28, 28, 30), gloss=0.4),
    )
    parts = [_slab(_ELECTRIC, -0.022, 0.022, paint)]
    for sx, z in ((-1, 0.49), (1, 0.46)):
        horn = [(sx * 0.15, 0.36), (sx * 0.13, z), (sx * 0.095, z), (sx * 0.05, 0.38)]
        parts.append(plate_xz(horn if sx > 0 else horn[::-1], -0.022, 0.022, paint))
    guard = [(-0.07, 0.15), (0.1, 0.1), (0.12, 0.2), (0.075, 0.26), (0.08, 0.36), (-0.08, 0.36)]
    parts.append(
        plate_xz(guard, -0.025, -0.02, Material(jitter((236, 232, 222), random, 5) if name != "white" else dark.color))
    )
    parts += [block((0, -0.028, z), (0.085, 0.016, 0.024), dark) for z in (0.19, 0.25, 0.31)]
    parts.append(block((0, -0.03, 0.11), (0.09, 0.02, 0.04), steel))
    parts.append(merged([block((0.1, -0.032, z), (0.022, 0.02, 0.022), dark) for z in (0.06, 0.12)]))
    strings = [block((x, -0.04, 0.13), (0.0025, 0.002, 0.72), steel) for x in np.linspace(-0.017, 0.017, 6).tolist()]
    maple = Material((212, 172, 116), "wood", (186, 142, 88), 0.2)
    return name, [*parts, *_neck(0.36, 0.84, 1.0, -0.03, maple, steel), merged(strings)]


def guitar(random: Random, wanted: WantedSize) -> Item:
    """An acoustic or an electric guitar that leans back on a stand of black tubes."""
    name, parts = (_acoustic if chance(random, 0.6) else _electric)(random)
    parts = [turned(moved(part, (0, 0, 0.06)), -0.1, "x", (0, 0, 0.06)) for part in parts]
    black = Material((30, 30, 32), gloss=0.3)
    for sx in (-1, 1):
        parts.append(
            tube([(sx * 0.2, -0.12, 0.008), (sx * 0.1, 0.02, 0.06), (sx * 0.03, 0.12, 0.4)], 0.009, black, sides=5)
        )
        parts.append(
            tube(
                [(sx * 0.11, 0.06, 0.045), (sx * 0.11, -0.08, 0.045), (sx * 0.11, -0.09, 0.075)], 0.008, black, sides=5
            )
        )
    parts.append(tube([(0, 0.1, 0.38), (0, 0.22, 0.008)], 0.009, black, sides=5))
    return fitted("guitar", parts, (wanted.width_m, wanted.depth_m, drawn(random, wanted.height_m, 0.95, 1.08)), name)


def _keys(width_m: float, front_m: float, back_m: float, z: float) -> list[Part]:
    """White keys with gaps between them, black ones in groups of two and three."""
    count = 28
    pitch = width_m / count
    white, black = Material((240, 238, 230), gloss=0.4), Material((24, 24, 26), gloss=0.4)
    whites, blacks = [], []
    for k in range(count):
        x = -width_m / 2 + k * pitch
        whites.append(box((x + 0.08 * pitch, front_m, z), (x + 0.92 * pitch, back_m, z + 0.015), white))
        if k % 7 not in (2, 6) and k < count - 1:
            low = (x + 0.7 * pitch, front_m + 0.38 * (back_m - front_m), z + 0.015)
            blacks.append(box(low, (x + 1.3 * pitch, back_m, z + 0.03), black))
    return [merged(whites), merged(blacks)]


def piano(random: Random, wanted: WantedSize) -> Item:
    """An upright piano with keys, music stand and pedals; or a slender electric one between two side panels."""
    w, d = drawn(random, wanted.width_m, 1.35, 1.52), drawn(random, wanted.depth_m, 0.52, 0.64)
    slim = chance(random, 0.3)
    h = drawn(random, wanted.height_m, *((0.82, 0.95) if slim else (1.05, 1.28)))
    name, color = pick(random, ("black", "black", "brown", "white"), WOODS)
    seed, gloss = int(random.integers(1000)), float(random.uniform(0.3, 0.9))
    wood = Material(color, "wood" if name == "brown" else "plain", darker(color, 0.75), 0.5, seed, gloss)
    dim, brass = Material(darker(color, 0.7), gloss=0.3), Material((196, 160, 80), gloss=0.7)
    key_z, front = (0.8 if slim else 0.6) * h, -d / 2
    body = d * (0.25 if slim else 0.5)
    parts = [box((-w / 2, d / 2 - body, 0.02 * h if not slim else 0.55 * h), (w / 2, d / 2, h), wood)]
    parts.append(box((-w / 2, front, key_z - 0.07), (w / 2, d / 2 - body, key_z), wood))
    for sx in (-1, 1):
        cheek = sorted((sx * w / 2, sx * (w / 2 - 0.05)))
        parts.append(box((cheek[0], front, key_z - 0.07), (cheek[1], d / 2 - body, key_z + 0.07), wood))
        foot = (cheek[0], front + (0.02 if slim else 0.0), 0.0)
        parts.append(box(foot, (cheek[1], d / 2 if slim else front + 0.06, key_z - 0.07), wood))
    parts += _keys(w - 0.12, front + 0.02, front + min(0.17, d - body - 0.01), key_z)
    parts.append(block((0, d / 2 - body - 0.01, key_z + 0.02), (w - 0.1, 0.02, 0.06), dim))
    top = min(key_z + 0.32, h - 0.02)
    parts.append(box((-0.24 * w, d / 2 - body - 0.03, key_z + 0.1), (0.24 * w, d / 2 - body, top), dim))
    if chance(random, 0.6) and not slim:
        sheet = Material((238, 236, 228), "grille", (110, 110, 110), 0.0)
        parts.append(block((0, d / 2 - body - 0.035, key_z + 0.11), (0.32, 0.006, min(0.2, h - key_z - 0.14)), sheet))
    pedal_y = d / 2 - 0.08 if slim else d / 2 - body - 0.05
    if slim:
        parts.append(box((0.05 - w / 2, d / 2 - 0.05, 0.1), (w / 2 - 0.05, d / 2 - 0.03, 0.3 * h), wood))
    parts.append(merged([block((k * 0.07, pedal_y, 0.05), (0.035, 0.12, 0.015), brass) for k in (-1, 0, 1)]))
    lid = () if slim else (SupportSurface(0.02 - w / 2, d / 2 - body + 0.01, w / 2 - 0.02, d / 2 - 0.01, h),)
    return fitted("piano", parts, (wanted.width_m, wanted.depth_m, h), name, lid)


DESIGNS = {"guitar": guitar, "piano": piano}
