"""What is built in: radiators, door leaves, windows and flights of stairs."""

from __future__ import annotations

import numpy as np

from placegraph.tools.simulator.catalogue._item_assembly import (
    Random,
    WantedSize,
    chance,
    drawn,
    fitted,
    merged,
    plate_yz,
)
from placegraph.tools.simulator.catalogue.decoration import frame
from placegraph.tools.simulator.color_palette import METALS, WOODS, darker, jitter, pick
from placegraph.tools.simulator.house_model import Item, Material, Part
from placegraph.tools.simulator.mesh_primitives import block, box, cylinder, moved, tube

_RISE_M = 0.185  # the most that one step rises


def _panel_radiator(width_m: float, depth_m: float, height_m: float, paint: Material) -> list[Part]:
    front = depth_m / 2
    slab = box((-width_m / 2, -front + 0.02, 0.01), (width_m / 2, 0, height_m - 0.02), paint)
    count = min(max(6, round(width_m / 0.06)), 24)
    ribs = []
    for k in range(count):
        x = -width_m / 2 + (k + 0.5) * width_m / count
        ribs.append(block((x, -front + 0.012, 0.05), (width_m / count * 0.5, 0.024, height_m - 0.11), paint))
    grille = Material(darker(paint.color, 0.8), "grille", darker(paint.color, 0.35), 0.03)
    top = box((-width_m / 2, -front + 0.02, height_m - 0.02), (width_m / 2, front, height_m), grille)
    back = box((-width_m / 2 + 0.03, 0, 0.03), (width_m / 2 - 0.03, front, height_m - 0.02), paint)
    return [slab, merged(ribs), top, back]


def _column_radiator(width_m: float, depth_m: float, height_m: float, paint: Material) -> list[Part]:
    count = min(max(6, round(width_m / 0.075)), 16)
    wide, columns = width_m / count * 0.62, []
    for k in range(count):
        x = -width_m / 2 + (k + 0.5) * width_m / count
        for side in (-1, 1):
            y = side * depth_m * 0.32
            columns.append(tube([(x, y, 0.06), (x, y, height_m - 0.03)], wide / 2, paint, sides=4))
        columns.append(block((x, 0, height_m - 0.06), (wide, depth_m, 0.06), paint))
        columns.append(block((x, 0, 0.05), (wide, depth_m, 0.06), paint))
    rails = [block((0, 0, z), (width_m, depth_m * 0.3, 0.03), paint) for z in (0.065, height_m - 0.045)]
    feet = [block((x * width_m * 0.42, 0, 0), (wide, depth_m * 0.9, 0.06), paint) for x in (-1, 1)]
    return [merged(columns), *rails, *feet]


def _ladder_radiator(width_m: float, depth_m: float, height_m: float, paint: Material) -> list[Part]:
    """Horizontal bars between two posts, in groups, as bathrooms have."""
    posts = [block((s * (width_m / 2 - 0.02), 0, 0), (0.04, depth_m, height_m), paint) for s in (-1, 1)]
    count, bars = max(5, round(height_m / 0.05)), []
    for k in range(count):
        if k % 6 != 5:
            z, half = (k + 0.5) * height_m / count, width_m / 2 - 0.02
            bars.append(tube([(-half, -depth_m * 0.2, z), (half, -depth_m * 0.2, z)], 0.013, paint, sides=5))
    return [*posts, merged(bars)]


def radiator(random: Random, wanted: WantedSize) -> Item:
    """A panel with ribs and a grille, a row of columns, or a ladder of bars; with a valve at its side."""
    kind = int(random.choice([0, 0, 1, 1, 2]))
    tall = kind == 2 and wanted.height_m is None and wanted.width_m is None
    wide, high = ((0.45, 0.6), (0.9, 1.3)) if tall else ((0.7, 1.3), (0.5, 0.65))
    width, depth, height = wanted.fill(random, wide, (0.09, 0.14), high)
    names = ("white", "white", "white", "gray", "black", "beige")
    name, color = pick(random, names) if kind else pick(random, ("white", "white", "beige"))
    paint = Material(color, gloss=0.3)
    build_parts = (_panel_radiator, _column_radiator, _ladder_radiator)[kind]
    knob = Material((240, 240, 238) if name != "white" else (190, 190, 192), gloss=0.3)
    steel = Material(METALS["gray"], gloss=0.6)
    x = width / 2 - 0.02
    parts = build_parts(width - 0.09, depth, height, paint)
    parts.append(cylinder((x, 0, 0.07), 0.024, 0.06, knob, sides=8))
    parts.append(tube([(x - 0.04, 0, 0.06), (x, 0, 0.06), (x, 0, 0)], 0.01, steel, sides=5))
    return fitted("radiator", parts, (width, depth, height), name)


def _door_panels(random: Random, width_m: float, height_m: float, thick_m: float, leaf: Material) -> list[Part]:
    """Raised fields on both faces, or a pane of glass with bars, by drawn design; none for a flush door."""
    kind = int(random.integers(5))
    field = Material(darker(leaf.color, 0.82), leaf.texture, leaf.second, leaf.scale_m, leaf.seed, leaf.gloss)
    edge, out = 0.12 * width_m / 0.85, thick_m / 2 + 0.003
    rows = {0: [(0.1, 0.9)], 1: [(0.08, 0.44), (0.52, 0.94)], 2: [(0.07, 0.33), (0.39, 0.65), (0.71, 0.94)]}.get(
        kind, []
    )
    columns = 2 if kind == 2 or (kind == 1 and chance(random, 0.5)) else 1
    parts, clear = [], width_m - 2 * edge
    for low, high in rows:
        for k in range(columns):
            x0 = -clear / 2 + k * clear / columns + (0.03 if k else 0)
            x1 = -clear / 2 + (k + 1) * clear / columns - (0.03 if k < columns - 1 else 0)
            parts.append(box((x0, -out, low * height_m), (x1, out, high * height_m), field))
            inner = ((x0 + 0.03, -out - 0.002, low * height_m + 0.03), (x1 - 0.03, out + 0.002, high * height_m - 0.03))
            parts.append(box(*inner, leaf))
    if kind == 3:
        glass = Material((206, 220, 224), "noise", (188, 206, 212), 0.2, gloss=0.7)
        parts.append(box((-clear / 2, -out, 0.45 * height_m), (clear / 2, out, 0.93 * height_m), glass))
        for z in (0.6, 0.76):
            parts.append(
                box((-clear / 2, -out - 0.002, z * height_m), (clear / 2, out + 0.002, z * height_m + 0.03), leaf)
            )
        parts.append(box((-0.015, -out - 0.002, 0.45 * height_m), (0.015, out + 0.002, 0.93 * height_m), leaf))
    return parts


def door(random: Random, wanted: WantedSize) -> Item:
    """A door leaf with its hinges at -x and a handle on both faces, which stands out 8 mm beyond the wanted depth."""
    width, depth, height = wanted.fill(random, (0.82, 0.88), (0.038, 0.042), (2.0, 2.04))
    if chance(random, 0.5):
        name, color = pick(random, ("white", "white", "gray", "beige", "blue", "green"))
        leaf = Material(color, gloss=0.2)
    else:
        name, color = pick(random, ("brown", "light brown", "beige", "black"), WOODS)
        leaf = Material(color, "wood", darker(color, 0.75), 0.4, int(random.integers(1000)), gloss=0.2)
    thick = depth * 0.75
    steel = Material(jitter((168, 140, 76), random) if chance(random, 0.3) else METALS["gray"], gloss=0.7)
    parts = [box((-width / 2, -thick / 2, 0), (width / 2, thick / 2, height), leaf)]
    parts += _door_panels(random, width, height, thick, leaf)
    x, out, z = width / 2 - 0.06, depth / 2 + 0.008, height * 0.5
    knob = chance(random, 0.3)
    for side in (-1, 1):
        near, far = sorted((side * thick / 2, side * (thick / 2 + 0.005)))
        parts.append(box((x - 0.022, near, z - 0.1), (x + 0.022, far, z + 0.1), steel))
        near, far = sorted((side * thick / 2, side * out))
        grip = (
            ((x - 0.03, near, z), (x + 0.03, far, z + 0.06))
            if knob
            else ((x - 0.12, near, z), (x + 0.015, far, z + 0.024))
        )
        parts.append(box(*grip, steel))
    for share in (0.12, 0.86):
        parts.append(cylinder((-width / 2 + 0.008, -thick / 2, share * height), 0.008, 0.09, steel, sides=6))
    return fitted("door", parts, (width, None, height), name)


def window(random: Random, wanted: WantedSize) -> Item:
    """A frame with one to three sashes, bars between glowing panes of a pale sky, and a handle."""
    width, depth, height = wanted.fill(random, (0.9, 1.8), (0.06, 0.1), (1.0, 1.5))
    name, color = pick(random, ("white", "white", "white", "brown", "gray", "black"))
    rim = Material(color, "wood" if name == "brown" else "plain", darker(color, 0.75), 0.3, gloss=0.2)
    sky = jitter((186, 210, 234), random, 7)
    texture = str(random.choice(["plain", "noise"]))
    pane = Material(sky, texture, darker(sky, 1.08), 0.8, int(random.integers(1000)), gloss=0.5, glow=0.9)
    bar = float(random.uniform(0.045, 0.065))
    front, back = -depth / 2, depth / 2
    parts = [frame(width, height, bar, (front, back), rim)]
    parts.append(box((bar - width / 2, -0.004, bar), (width / 2 - bar, 0.004, height - bar), pane))
    sashes = max(1, min(3, round(width / random.uniform(0.5, 0.9))))
    wide = width - 2 * bar
    for k in range(1, sashes):
        x = -wide / 2 + k * wide / sashes
        parts.append(box((x - bar * 0.6, front * 0.8, bar), (x + bar * 0.6, back, height - bar), rim))
    kind = int(random.integers(3))
    levels = {0: [], 1: [0.5], 2: [0.34, 0.67]}[kind]
    for share in levels:
        parts.append(box((-wide / 2, front * 0.5, share * height), (wide / 2, back * 0.9, share * height + 0.028), rim))
    if kind == 2:
        for k in range(sashes):
            x = -wide / 2 + (k + 0.5) * wide / sashes
            parts.append(box((x - 0.014, front * 0.5, bar), (x + 0.014, back * 0.9, height - bar), rim))
    handle = Material(METALS["gray"], gloss=0.6)
    x = bar * 0.6 - width / 2 if sashes == 1 else -wide / 2 + wide / sashes
    parts.append(box((x - 0.012, front, height * 0.42), (x + 0.012, front * 0.7, height * 0.42 + 0.11), handle))
    return fitted("window", parts, (width, depth, height), name)


def stairs(random: Random, wanted: WantedSize) -> Item:
    """A straight flight that rises toward +y in equal steps: solid blocks, or treads between two stringers."""
    width, height = drawn(random, wanted.width_m, 0.9, 1.1), drawn(random, wanted.height_m, 2.6, 2.9)
    count = int(np.ceil(height / _RISE_M - 1e-9))
    run = drawn(random, wanted.depth_m, 0.26 * count, 0.28 * count)
    rise, going = height / count, run / count
    name, color = pick(random, list(WOODS), WOODS)
    tread = Material(color, "wood", darker(color, 0.75), 0.4, int(random.integers(1000)), gloss=0.2)
    parts: list[Part] = []
    edge = Material(darker(color, 0.55))
    if chance(random, 0.6):
        riser = Material(jitter((226, 224, 218), random) if chance(random, 0.5) else darker(color, 0.8))
        for k in range(count):
            y0 = k * going
            parts.append(
                box((-width / 2, y0 + 0.02, 0), (width / 2, min(y0 + going + 0.02, run), (k + 1) * rise - 0.035), riser)
            )
            parts.append(box((-width / 2, y0, (k + 1) * rise - 0.035), (width / 2, y0 + going, (k + 1) * rise), tread))
        return fitted("stairs", [merged(parts[::2]), merged(parts[1::2])], (width, run, height), name)
    for k in range(count):
        low = (
            (0.03 - width / 2, k * going, (k + 1) * rise - 0.045),
            (width / 2 - 0.03, (k + 1) * going, (k + 1) * rise),
        )
        parts.append(box(*low, tread))
    outline = [(0.0, 0.0), (going * 1.2, 0.0), (run, height - 1.3 * rise), (run, height), (0.0, rise)]
    sides = [plate_yz(outline, -0.03, 0.0, edge) for _ in range(2)]
    stringers = [moved(sides[0], (0.03 - width / 2, 0, 0)), moved(sides[1], (width / 2, 0, 0))]
    return fitted("stairs", [merged(parts), merged(stringers)], (width, run, height), name)


DESIGNS = {"radiator": radiator, "door": door, "window": window, "stairs": stairs}
