"""Kitchen units and large appliances: refrigerator, stove, counter and sink."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from placegraph.tools.simulator.catalogue._appliance_parts import fronts, knob, molded, tap
from placegraph.tools.simulator.catalogue._item_assembly import Random, WantedSize, fitted, merged
from placegraph.tools.simulator.catalogue._materials import DARK, GLASS, STEEL
from placegraph.tools.simulator.catalogue.bathroom import washbasin
from placegraph.tools.simulator.color_palette import COLORS, METALS, VIVID, WOODS, darker, jitter, pick
from placegraph.tools.simulator.house_model import Item, Material, Part, SupportSurface
from placegraph.tools.simulator.mesh_primitives import Point, block, box, cylinder, moved

DISPLAY = Material((96, 220, 190), glow=0.8)
ENAMELS = (*("white",) * 6, *("gray",) * 4, "black", "black", "red", "beige", "blue", "green")


def enamel_finish(random: Random) -> tuple[str, Material]:
    """The word and enamel or steel of a white good: mostly white, gray or black."""
    name = str(random.choice(ENAMELS))
    return name, Material(jitter((COLORS | METALS)[name], random, 6), gloss=0.5)


def refrigerator(random: Random, wanted: WantedSize) -> Item:
    """Two doors one above the other, or side by side, or one tall door with notes on it."""
    kind = int(random.integers(3))
    wide = (0.8, 0.95) if kind == 1 else (0.55, 0.7)
    w, d, h = wanted.fill(random, wide, (0.6, 0.72), (1.5, 2.0), always_draw=True)
    word, enamel = enamel_finish(random)
    y = -d / 2 + 0.1  # the body's front; the doors are 6 cm thick, the handles stand off 4 cm
    parts = [box((-w / 2, y + 0.012, 0.06), (w / 2, d / 2, h), replace(enamel, color=darker(enamel.color, 0.94)))]
    parts.append(box((-w / 2 + 0.008, y - 0.02, 0.065), (w / 2 - 0.008, y + 0.012, h - 0.005), DARK))  # the doors' seal
    parts.append(box((-w / 2 + 0.02, y - 0.03, 0), (w / 2 - 0.02, d / 2, 0.06), DARK))
    split = h * float(random.choice((0.36, 0.42, 0.68, 0.72)))
    doors = [(-w / 2, w / 2, 0.06, split), (-w / 2, w / 2, split, h)]
    if kind == 1:
        doors = [(-w / 2, 0.0, 0.06, h), (0.0, w / 2, 0.06, h)]
    elif kind == 2:
        doors = [(-w / 2, w / 2, 0.06, h)]
    grip = DARK if random.random() < 0.4 else STEEL
    for k, (x0, x1, z0, z1) in enumerate(doors):
        parts.append(box((x0 + 0.004, y - 0.06, z0 + 0.008), (x1 - 0.004, y - 0.008, z1 - 0.008), enamel))
        x = x1 - 0.06 if kind == 1 and k == 0 else x0 + 0.06
        low, high = (h * 0.4, h * 0.75) if kind else (z0 + 0.08, z0 + 0.45)
        if kind == 0 and k == 0:  # the lower door is gripped near its top
            low, high = max(z0 + 0.06, z1 - 0.45), z1 - 0.06
        high = min(high, z1 - 0.06)
        parts.append(box((x - 0.014, y - 0.1, low), (x + 0.014, y - 0.075, high), grip))
        parts += [block((x, y - 0.07, z), (0.02, 0.03, 0.03), grip) for z in (low, high - 0.03)]
    if kind == 1:
        parts.append(box((-w * 0.36, y - 0.063, h * 0.55), (-w * 0.14, y - 0.06, h * 0.75), GLASS))
        parts.append(box((-w * 0.33, y - 0.064, h * 0.71), (-w * 0.17, y - 0.06, h * 0.74), DISPLAY))
    else:
        parts += _notes(random, w, y - 0.06, h)
    return fitted("refrigerator", parts, (w, d, h), word)


def _notes(random: Random, w: float, y: float, h: float) -> list[Part]:
    """Notes and magnets on the door, now and then."""
    parts = []
    for _ in range(int(random.integers(0, 5))):
        x, z = float(random.uniform(-0.15, 0.36)) * w, float(random.uniform(0.76, 0.9)) * h
        color = pick(random, (*VIVID, "white"))[1]
        side = float(random.uniform(0.025, 0.07))
        parts.append(box((x, y - 0.003, z), (x + side, y, z + side * 1.3), Material(color)))
    return parts


def stove(random: Random, wanted: WantedSize) -> Item:
    """A cooker: rings or gas burners on top, a row of knobs, the oven's door with window and bar, a drawer below."""
    w, d, h = wanted.fill(random, (0.5, 0.75), (0.58, 0.64), (0.86, 0.92), always_draw=True)
    back = (
        0.0 if wanted.height_m is not None or random.random() < 0.6 else 0.16
    )  # a given height is that of the worktop
    word, enamel = enamel_finish(random)
    gas, z, y = random.random() < 0.45, h - 0.04, -d / 2 + 0.06
    parts = [box((-w / 2, y, 0.08), (w / 2, d / 2, z), enamel), box((-w / 2, y + 0.04, 0), (w / 2, d / 2, 0.08), DARK)]
    parts.append(box((-w / 2, y - 0.02, z - 0.1), (w / 2, y, z), Material(darker(enamel.color, 0.9), gloss=0.5)))
    count, grip = int(random.integers(4, 7)), STEEL if word == "black" else DARK
    places = np.linspace(-w * 0.38, w * 0.38, count).tolist()
    parts.append(merged([knob(x, y - 0.02, z - 0.05, 0.021, 0.025, grip, 8) for x in places]))
    parts.append(box((-w / 2 + 0.01, y - 0.025, 0.25), (w / 2 - 0.01, y, z - 0.11), enamel))
    parts.append(box((-w * 0.36, y - 0.028, 0.34), (w * 0.36, y - 0.02, z - 0.22), GLASS))
    bar = box((-w * 0.42, y - 0.06, z - 0.165), (w * 0.42, y - 0.04, z - 0.145), STEEL)
    feet = [block((x, y - 0.035, z - 0.165), (0.02, 0.03, 0.02), STEEL) for x in (-w * 0.4, w * 0.4)]
    parts.append(merged([bar, *feet]))
    parts.append(box((-w / 2 + 0.01, y - 0.02, 0.09), (w / 2 - 0.01, y, 0.235), enamel))
    parts.append(block((0, y - 0.025, 0.18), (w * 0.4, 0.02, 0.012), grip))
    parts += _hob(w, d, y, z, gas)
    if back:
        parts.append(box((-w / 2, d / 2 - 0.05, z), (w / 2, d / 2, h + back), enamel))
        parts.append(box((-w * 0.15, d / 2 - 0.053, h + 0.04), (w * 0.15, d / 2 - 0.05, h + back - 0.03), GLASS))
        parts.append(box((-w * 0.06, d / 2 - 0.055, h + 0.06), (w * 0.06, d / 2 - 0.05, h + back - 0.06), DISPLAY))
    return fitted("stove", parts, (w, d, h + back), word)


def _hob(w: float, d: float, y: float, z: float, gas: bool) -> list[Part]:
    """Four rings on black glass, or four gas burners under iron grids; 4 cm high."""
    parts = [box((-w / 2, y, z), (w / 2, d / 2, z + (0.01 if gas else 0.032)), STEEL if gas else GLASS)]
    middle = (y + d / 2) / 2
    for k, (sx, sy) in enumerate(((-1, -1), (1, -1), (-1, 1), (1, 1))):
        at: Point = (sx * w * 0.24, middle + sy * d * 0.21, z)
        radius = w * (0.15 if k in (0, 3) else 0.12)
        if gas:
            burner = cylinder(at, radius * 0.5, 0.028, DARK, radius * 0.3, 8)
            grid: tuple[Point, Point] = ((radius * 1.9, 0.012, 0.012), (0.012, radius * 1.9, 0.012))
            parts.append(merged([burner, *(block((at[0], at[1], z + 0.028), size, DARK) for size in grid)]))
        else:
            red = Material((150, 60, 48), glow=0.25) if k == 0 else Material((96, 96, 100))
            parts.append(cylinder((at[0], at[1], z + 0.03), radius, 0.007, red, sides=14))
            parts.append(cylinder((at[0], at[1], z + 0.03), radius * 0.85, 0.01, DARK, sides=12))
    return parts


def _worktop(random: Random) -> Material:
    """Stone, wood or laminate."""
    texture, scale_m, gloss = (("marble", 0.4, 0.5), ("wood", 0.3, 0.2), ("noise", 0.05, 0.3))[int(random.integers(3))]
    table = WOODS if texture == "wood" else COLORS
    color = pick(random, tuple(WOODS) if texture == "wood" else ("white", "gray", "black", "brown", "beige"), table)[1]
    return Material(color, texture, darker(color, 0.78), scale_m, int(random.integers(99)), gloss)


def kitchen_counter(random: Random, wanted: WantedSize) -> Item:
    """A row of base units: plinth, doors and one stack of drawers under a worktop that is free."""
    w, d, h = wanted.fill(random, (0.6, 2.0), (0.58, 0.64), (0.87, 0.92), always_draw=True)
    thick, y = float(random.uniform(0.025, 0.045)), -d / 2 + 0.04
    word, parts = fronts(random, w, y, 0.1, h - thick)
    parts.append(box((-w / 2, y, 0.1), (w / 2, d / 2, h - thick), Material(darker(parts[0].material.color, 0.6))))
    parts.append(box((-w / 2, y + 0.05, 0), (w / 2, d / 2, 0.1), DARK))
    parts.append(box((-w / 2, -d / 2, h - thick), (w / 2, d / 2, h), _worktop(random)))
    top = SupportSurface(-w / 2 + 0.02, -d / 2 + 0.02, w / 2 - 0.02, d / 2 - 0.02, h, 0.5)
    return fitted("kitchen counter", parts, (w, d, h), word, (top,))


def sink(random: Random, wanted: WantedSize) -> Item:
    """A kitchen unit with a basin and a tap (when asked for 0.55 m depth or more), or a washbasin (for less)."""
    if random.random() < 0.5 if wanted.depth_m is None else wanted.depth_m >= 0.55:
        return _kitchen_sink(random, *wanted.fill(random, (0.6, 1.1), (0.58, 0.64), (1.08, 1.18), always_draw=True))
    return washbasin(random, *wanted.fill(random, (0.45, 0.7), (0.38, 0.5), (0.88, 1.02), always_draw=True))


def _kitchen_sink(random: Random, w: float, d: float, h: float) -> Item:
    """Base unit, worktop with a hole, basin of steel or ceramic, draining grooves where there is room."""
    z = h - float(np.clip(h - 0.9, 0.07, 0.25))  # the worktop; the tap is the rest
    y = -d / 2 + 0.04
    word, parts = fronts(random, w, y, 0.1, z - 0.04)
    bw, bd, bx = min(w * 0.8, 0.42), d * 0.6, (-w / 2 + 0.29 if w > 0.85 else 0.0)
    basin = STEEL if random.random() < 0.6 else Material((238, 238, 234), gloss=0.6)
    x0, x1, y0, y1 = bx - bw / 2, bx + bw / 2, -bd / 2 - 0.02, bd / 2 - 0.02
    stone, carcass = _worktop(random), Material(darker(parts[0].material.color, 0.6))
    holes = ((-w / 2, -d / 2, x0, d / 2), (x1, -d / 2, w / 2, d / 2), (x0, -d / 2, x1, y0), (x0, y1, x1, d / 2))
    parts += [box((a, b, z - 0.04), (c, e, z), stone) for a, b, c, e in holes]
    bowl = [(0, -0.2), (1.02, -0.2), (1.08, 0.003), (1.0, 0.006), (0.9, -0.15), (0, -0.16)]
    parts.append(moved(molded(bowl, bw, bd, basin, 8), (bx, -0.02, z)))
    parts.append(cylinder((bx, -0.02, z - 0.16), 0.03, 0.004, DARK, sides=8))
    parts.append(box((-w / 2, y, 0.1), (w / 2, d / 2, z - 0.2), carcass))
    parts += [box((x, y, z - 0.2), (x + 0.02, d / 2, z - 0.04), carcass) for x in (-w / 2, w / 2 - 0.02)]
    parts.append(box((-w / 2, y + 0.05, 0), (w / 2, d / 2, 0.1), DARK))
    if w > 0.85:
        grooves = Material(basin.color, "grille", darker(basin.color, 0.8), 0.06, gloss=0.6)
        parts.append(box((x1 + 0.05, y0, z), (min(x1 + 0.4, w / 2 - 0.03), y1, z + 0.004), grooves))
    parts += [moved(part, (bx, 0, 0)) for part in tap(y1 + 0.05, z, h - z, 0.16)]
    return fitted("sink", parts, (w, d, h), word)


DESIGNS = {
    "refrigerator": refrigerator, "stove": stove, "sink": sink, "kitchen counter": kitchen_counter,
}  # fmt: skip
