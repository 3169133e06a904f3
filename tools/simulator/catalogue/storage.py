"""Wardrobe, bookshelf, dresser, cabinet, shoe rack and coat rack."""

from __future__ import annotations

import itertools

import numpy as np

from placegraph.tools.simulator.catalogue._cabinet_parts import (
    Fronts,
    case,
    dark_of,
    finish,
    fronts_of,
    metal,
    standing,
    wood,
)
from placegraph.tools.simulator.catalogue._item_assembly import Random, WantedSize, assembled
from placegraph.tools.simulator.color_palette import MUTED, VIVID, darker, pick
from placegraph.tools.simulator.house_model import Item, Material, Part, SupportSurface
from placegraph.tools.simulator.mesh_primitives import box, cylinder, ellipsoid, moved, tube


def wardrobe(random: Random, wanted: WantedSize) -> Item:
    """A tall case with two to four doors, some with a mirror door, drawers below, or sliding doors."""
    w, d, h = wanted.fill(random, (0.9, 1.9), (0.52, 0.65), (1.8, 2.15))
    name, body = finish(random, 0.15)
    fronts = Fronts(
        body if random.random() < 0.7 else wood(random)[1], metal(random), "bar" if random.random() < 0.6 else "knob"
    )
    base, z0 = standing(random, w, d, 0.6, body)
    y, top = -d / 2 + fronts.reach_m, h - 0.03
    parts = [*base, *case(w, d, z0, h, y, body)]
    style, count = str(random.choice(["plain", "mirror", "drawers"])), max(2, round(w / 0.5))
    edges = np.linspace(-w / 2 + 0.012, w / 2 - 0.012, count + 1).tolist()
    low = z0 + 0.012
    if style == "drawers":
        high = low + 0.24
        for x0, x1 in itertools.pairwise(edges):
            parts += fronts.drawer(x0, x1, low, high, y)
        low = high
    for k in range(count):
        parts += fronts.door(edges[k], edges[k + 1], low, top, y, handle_left=k % 2 == 1)
    if style == "mirror":
        k = count // 2
        glass = Material((176, 192, 204), "noise", (206, 218, 226), 1.2, int(random.integers(1000)), gloss=0.9)
        parts.append(box((edges[k] + 0.07, y - 0.004, low + 0.08), (edges[k + 1] - 0.07, y, top - 0.08), glass))
    if style == "plain" and random.random() < 0.6:  # a cornice, and mouldings on the doors
        parts += [_moulding(edges[k] + 0.08, edges[k + 1] - 0.08, a, b, y, fronts.panel) for k in range(count)
                  for a, b in ((low + 0.08, low + 0.4 * h), (low + 0.47 * h, top - 0.08))]  # fmt: skip
    return assembled("wardrobe", parts, (w, d, h), name)


def _moulding(x0: float, x1: float, z0: float, z1: float, y: float, panel: Material) -> Part:
    return box((x0, y - 0.006, z0), (x1, y, z1), Material(darker(panel.color, 0.85), gloss=panel.gloss))


def _books(random: Random, x0: float, x1: float, y: float, d: float, z: float, gap: float) -> tuple[list[Part], float]:
    """A row of books on a board from x0 toward x1: the blocks and where the row ends."""
    end = x0 + (x1 - x0) * (1.0 if random.random() < 0.5 else float(random.uniform(0.45, 0.75)))
    cuts = [x0 + 0.005, end - 0.005]
    if end - x0 > 0.4:
        cuts.insert(1, x0 + float(random.uniform(0.3, 0.7)) * (end - x0))
    rows = []
    for a, b in itertools.pairwise(cuts):
        high, deep = gap * float(random.uniform(0.6, 0.88)), d * float(random.uniform(0.6, 0.8))
        colors = pick(random, VIVID + MUTED)[1], pick(random, VIVID + MUTED)[1]
        spines = Material(colors[0], "books", colors[1], 0.0, int(random.integers(100000)))
        rows.append(box((a, y - deep, z), (b, y, z + high), spines))
    return rows, end


def bookshelf(random: Random, wanted: WantedSize) -> Item:
    """Boards between sides, partly filled with books: a case with a back, cubes, or an open frame of metal posts."""
    style = str(random.choice(["case", "cubes", "open"]))
    w, d, h = wanted.fill(random, (0.6, 1.15), (0.25, 0.36), (0.9, 1.5) if style == "cubes" else (1.3, 2.05))
    name, board = finish(random, 0.15)
    t = float(random.uniform(0.02, 0.03))
    side = t if style != "open" else 0.025
    floors = np.linspace(0.05, h - t, max(2, round(h / 0.36)) + 1).tolist()
    parts = [box((-w / 2, -d / 2, z), (w / 2, d / 2, z + t), board) for z in floors]
    if style == "open":
        post = metal(random)
        parts += [box((x - 0.0125, y - 0.0125, 0), (x + 0.0125, y + 0.0125, h - t / 2), post)
                  for x in (-w / 2 + 0.0125, w / 2 - 0.0125) for y in (-d / 2 + 0.0125, d / 2 - 0.0125)]  # fmt: skip
    else:
        parts += [box((x, -d / 2, 0), (x + t, d / 2, h), board) for x in (-w / 2, w / 2 - t)]
        parts.append(box((-w / 2 + t, d / 2 - 0.008, 0.05), (w / 2 - t, d / 2, h), dark_of(board)))
    columns = max(2, round(w / 0.4)) if style == "cubes" else 1
    edges = np.linspace(-w / 2 + side, w / 2 - side, columns + 1).tolist()
    parts += [box((x - t / 2, -d / 2 + 0.002, 0.05), (x + t / 2, d / 2 - 0.01, h - t / 2), board) for x in edges[1:-1]]
    surfaces = [SupportSurface(-w / 2 + 0.02, -d / 2 + 0.02, w / 2 - 0.02, d / 2 - 0.02, h, 0.5)] if h < 1.7 else []
    cells = [(k, c) for k in range(len(floors) - 1) for c in range(columns)]
    free = int(random.integers(len(cells)))  # one is always free and its neighbour always full
    for i, (k, c) in enumerate(cells):
        z, gap = floors[k] + t, floors[k + 1] - floors[k] - t
        x0, x1 = edges[c] + t / 2, edges[c + 1] - t / 2
        if i != free and (i == (free + 1) % len(cells) or random.random() < 0.68):
            rows, x0 = _books(random, x0, x1, d / 2 - 0.02, d, z, gap)
            parts += rows
        if x1 - x0 > 0.15:
            surfaces.append(SupportSurface(x0 + 0.02, -d / 2 + 0.02, x1 - 0.02, d / 2 - 0.03, z, gap))
    return assembled("bookshelf", parts, (w, d, h), name, surfaces)


def dresser(random: Random, wanted: WantedSize) -> Item:
    """A chest full of drawers: low and wide, tall and narrow, or with small drawers on top."""
    style = str(random.choice(["wide", "tall", "small top"]))
    tall = style == "tall"
    w, d, h = wanted.fill(random, (0.5, 0.7) if tall else (0.9, 1.5), (0.4, 0.5), (1.05, 1.3) if tall else (0.75, 0.95))
    name, body = finish(random)
    fronts = fronts_of(random, body)
    base, z0 = standing(random, w, d, h, body)
    y = -d / 2 + fronts.reach_m
    parts = [*base, *case(w, d, z0, h, y, body)]
    rows = int(np.clip(round((h - z0) / 0.2), 3, 6))
    levels = np.linspace(z0 + 0.012, h - 0.03, rows + 1).tolist()
    columns = 1 if w < 0.8 else 2
    for k in range(rows):
        count = columns + 1 if style == "small top" and k == rows - 1 else columns
        edges = np.linspace(-w / 2 + 0.012, w / 2 - 0.012, count + 1).tolist()
        for x0, x1 in itertools.pairwise(edges):
            parts += fronts.drawer(x0, x1, levels[k], levels[k + 1], y)
    return assembled(
        "dresser", parts, (w, d, h), name, (SupportSurface(-w / 2 + 0.02, y + 0.02, w / 2 - 0.02, d / 2 - 0.02, h),)
    )


def cabinet(random: Random, wanted: WantedSize) -> Item:
    """A sideboard: doors alone, doors under a row of drawers, or doors left and right of open boards."""
    style = str(random.choice(["doors", "drawers above", "open middle"]))
    w, d, h = wanted.fill(random, (0.8, 1.7), (0.36, 0.46), (0.6, 0.95))
    name, body = finish(random)
    fronts = fronts_of(random, body)
    base, z0 = standing(random, w, d, h, body)
    y, low, high = -d / 2 + fronts.reach_m, z0 + 0.012, h - 0.03
    parts, surfaces = list(base), [SupportSurface(-w / 2 + 0.02, y + 0.02, w / 2 - 0.02, d / 2 - 0.02, h)]
    count = max(2, round(w / 0.45))
    if style == "open middle":
        inner, middle, wide = w / 6, (low + high) / 2, w / 3
        for x in (-w / 3, w / 3):
            parts += [moved(part, (x, 0, 0)) for part in case(wide, d, z0, h, y, body)]
        parts += [box((-inner, y, z), (inner, d / 2, z + 0.02), body) for z in (z0, middle, h - 0.02)]
        parts.append(box((-inner, d / 2 - 0.01, z0), (inner, d / 2 - 0.001, h - 0.01), dark_of(body)))
        parts += fronts.door(-w / 2 + 0.012, -inner, low, high, y, handle_left=False)
        parts += fronts.door(inner, w / 2 - 0.012, low, high, y, handle_left=True)
        surfaces += [SupportSurface(0.02 - inner, y + 0.02, inner - 0.02, d / 2 - 0.03, z, middle - z0 - 0.03)
                     for z in (z0 + 0.02, middle + 0.02)]  # fmt: skip
        return assembled("cabinet", parts, (w, d, h), name, surfaces)
    parts += case(w, d, z0, h, y, body)
    edges = np.linspace(-w / 2 + 0.012, w / 2 - 0.012, count + 1).tolist()
    split = high - 0.16 if style == "drawers above" else high
    for k in range(count):
        parts += fronts.door(edges[k], edges[k + 1], low, split, y, handle_left=k % 2 == 1)
        if style == "drawers above":
            parts += fronts.drawer(edges[k], edges[k + 1], split, high, y)
        elif fronts.panel.texture == "plain":
            parts.append(_moulding(edges[k] + 0.09, edges[k + 1] - 0.09, low + 0.07, split - 0.07, y, fronts.panel))
    return assembled("cabinet", parts, (w, d, h), name, surfaces)


def _pair_of_shoes(random: Random, x: float, y: float, z: float, length: float) -> list[Part]:
    color = pick(random, MUTED + VIVID)[1]
    sole = Material((225, 222, 214) if random.random() < 0.5 else darker(color, 0.5))
    upper = Material(color, "fabric", darker(color, 0.8), 0.05)
    parts = []
    for a in (x - 0.052, x + 0.052):
        parts.append(box((a - 0.042, y - length / 2, z), (a + 0.042, y + length / 2, z + 0.022), sole))
        parts.append(ellipsoid((a, y - 0.04, z + 0.03), (0.042, length / 2 - 0.045, 0.045), upper, sides=6))
        parts.append(box((a - 0.036, y, z + 0.02), (a + 0.036, y + length / 2, z + 0.09), upper))
    return parts


def shoe_rack(random: Random, wanted: WantedSize) -> Item:
    """A few low boards or rails between two ends, with shoes on them."""
    w, d, h = wanted.fill(random, (0.55, 0.95), (0.28, 0.34), (0.42, 0.75))
    name, board = wood(random)
    rails, levels = random.random() < 0.5, 2 if h < 0.6 else 3
    parts = [box((x, -d / 2, 0), (x + 0.022, d / 2, h), board) for x in (-w / 2, w / 2 - 0.022)]
    zs = np.linspace(0.06, h - 0.02, levels + 1).tolist()
    for z in zs:
        if rails:  # slats with daylight between them
            parts += [box((0.01 - w / 2, y, z), (w / 2 - 0.01, y + 0.035, z + 0.018), board)
                      for y in np.linspace(-d / 2, d / 2 - 0.035, 4).tolist()]  # fmt: skip
        else:
            parts.append(box((0.01 - w / 2, -d / 2, z), (w / 2 - 0.01, d / 2, z + 0.02), board))
    places = max(1, int((w - 0.06) / 0.24))
    shoes = 0
    for z in zs[:-1]:
        for x in np.linspace(-w / 2 + 0.15, w / 2 - 0.15, places).tolist():
            if shoes < 4 and random.random() < 0.7:
                parts += _pair_of_shoes(random, x, 0, z + 0.02, min(0.28, d))
                shoes += 1
    return assembled(
        "shoe rack",
        parts,
        (w, d, h),
        name,
        (SupportSurface(-w / 2 + 0.03, -d / 2, w / 2 - 0.03, d / 2, zs[-1] + 0.02),),
    )


def _coat(random: Random, x: float, y: float, top: float, length: float, half: tuple[float, float]) -> Part:
    color = pick(random, VIVID + MUTED)[1]
    cloth = Material(color, "fabric", darker(color, 0.8), 0.08, int(random.integers(1000)))
    part = cylinder((0, 0, top - length), 1.0, length * 0.8, cloth, top_radius_m=0.85, sides=8)
    shoulders = cylinder((0, 0, top - length * 0.2), 0.85, length * 0.2, cloth, top_radius_m=0.2, sides=8)
    vertices = np.concatenate((part.vertices, shoulders.vertices)) * (half[0], half[1], 1) + (x, y, 0)
    return Part(vertices, np.concatenate((part.faces, shoulders.faces + len(part.vertices))), cloth)


def coat_rack(random: Random, wanted: WantedSize) -> Item:
    """A pole with pegs on crossed feet, or a rail on two posts; both with coats, the pole at times with a hat."""
    pole = random.random() < 0.6 if wanted.width_m is None else wanted.width_m < 0.7
    wide, high = ((0.42, 0.6), (1.65, 1.85)) if pole else ((0.8, 1.2), (1.4, 1.65))
    w, d, h = wanted.fill(random, wide, (0.42, 0.55), high)
    name, stuff = wood(random)
    if not pole:
        bar = metal(random)
        parts = [tube([(0.012 - w / 2, 0, h - 0.012), (w / 2 - 0.012, 0, h - 0.012)], 0.012, bar)]
        for x in (0.015 - w / 2, w / 2 - 0.015):
            parts += [box((x - 0.015, -d / 2, 0), (x + 0.015, d / 2, 0.03), bar),
                      box((x - 0.012, -0.012, 0), (x + 0.012, 0.012, h), bar)]  # fmt: skip
        for x in np.linspace(0.12 - w / 2, w / 2 - 0.12, int(random.integers(3, 6))).tolist():
            parts.append(_coat(random, x, 0, h - 0.05, float(random.uniform(0.7, 1.05)) * h / 1.7, (0.05, 0.2)))
        return assembled("coat rack", parts, (w, d, h), "")
    parts = [cylinder((0, 0, 0.02), 0.024, h - 0.02, stuff, 0.018, sides=8)]
    parts += [
        box((-w / 2, -0.025, 0), (w / 2, 0.025, 0.05), stuff),
        box((-0.025, -d / 2, 0), (0.025, d / 2, 0.05), stuff),
    ]
    for k, angle in enumerate(np.arange(6) * np.pi / 3 + float(random.uniform(0, 1))):
        z, reach = h - (0.12 if k % 2 else 0.3), 0.38 * min(w, d)
        x, y = reach * np.cos(angle), reach * np.sin(angle)
        parts.append(tube([(0, 0, z), (x, y, z + 0.09)], 0.011, stuff, sides=6))
        if random.random() < 0.45:
            parts.append(_coat(random, x * 0.75, y * 0.75, z, float(random.uniform(0.5, 0.85)) * h / 1.8, (0.1, 0.09)))
    if random.random() < 0.4:
        felt = Material(pick(random, ("black", "brown", "gray", "beige", "red"))[1], "fabric", (90, 80, 70), 0.05)
        parts.append(cylinder((0, 0, h - 0.11), 0.15, 0.012, felt))
        parts.append(cylinder((0, 0, h - 0.1), 0.09, 0.1, felt, top_radius_m=0.075))
    return assembled("coat rack", parts, (w, d, h), name)


DESIGNS = {
    "wardrobe": wardrobe, "bookshelf": bookshelf, "dresser": dresser, "cabinet": cabinet, "shoe rack": shoe_rack,
    "coat rack": coat_rack,
}  # fmt: skip
