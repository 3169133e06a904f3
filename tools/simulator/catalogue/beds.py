"""Beds with mattress, pillows and blanket."""

from __future__ import annotations

import itertools

import numpy as np

from placegraph.tools.simulator.catalogue._cabinet_parts import Fronts, finish, metal
from placegraph.tools.simulator.catalogue._item_assembly import Random, WantedSize, assembled, drawn
from placegraph.tools.simulator.catalogue._upholstery import cloth, cushion
from placegraph.tools.simulator.color_palette import darker, pick
from placegraph.tools.simulator.house_model import Item, Material, Part
from placegraph.tools.simulator.mesh_primitives import box, cylinder, tube, turned


def _linen(random: Random) -> tuple[str, Material]:
    """What a blanket is made of."""
    name, color = pick(random, ("white", "gray", "blue", "red", "green", "beige", "pink", "yellow", "purple", "brown"))
    texture = str(random.choice(["fabric", "fabric", "stripes", "checks", "leaves"]))
    second = darker(color, 0.75) if random.random() < 0.6 else pick(random, ("white", "beige"))[1]
    return name, Material(color, texture, second, 0.25, int(random.integers(1000)))


def _wooden(random: Random, w: float, d: float, h: float, rail: float, frame: Material) -> list[Part]:
    """A wooden frame: posts, panelled or slatted headboard, a low footboard, and at times drawers in the side rails."""
    high = min(rail + 0.22, 0.7 * h)
    parts = [box((a - 0.03, y - 0.03, 0), (a + 0.03, y + 0.03, top), frame)
             for a in (0.03 - w / 2, w / 2 - 0.03) for y, top in ((d / 2 - 0.03, h), (0.03 - d / 2, high))]  # fmt: skip
    parts += [
        box((a, -d / 2 + 0.02, 0.16), (a + 0.03, d / 2 - 0.02, rail), frame) for a in (0.01 - w / 2, w / 2 - 0.04)
    ]
    if random.random() < 0.5:
        parts += [box((0.02 - w / 2, d / 2 - 0.05, 0.16), (w / 2 - 0.02, d / 2 - 0.015, h - 0.03), frame)]
        parts += [box((0.02 - w / 2, 0.015 - d / 2, 0.16), (w / 2 - 0.02, 0.045 - d / 2, high - 0.03), frame)]
        return parts
    for y, top in ((d / 2 - 0.03, h), (0.03 - d / 2, high)):
        parts += [box((-w / 2, y - 0.015, z), (w / 2, y + 0.015, z + 0.06), frame) for z in (0.2, top - 0.08)]
        across = np.linspace(0.06 - w / 2, w / 2 - 0.06, max(6, round(w / 0.18)) + 1).tolist()[1:-1]
        parts += [box((x - 0.02, y - 0.01, 0.25), (x + 0.02, y + 0.01, top - 0.05), frame) for x in across]
    return parts


def _boxspring(random: Random, w: float, d: float, h: float, rail: float, cover: Material) -> list[Part]:
    """An upholstered box on short feet with a padded headboard of upright cushions."""
    feet, count = metal(random), min(5, max(2, round(w / 0.35)))
    parts = [
        cylinder((x, y, 0), 0.025, 0.09, feet, sides=8)
        for x in (0.1 - w / 2, w / 2 - 0.1)
        for y in (0.12 - d / 2, d / 2 - 0.12)
    ]
    parts.append(cushion((-w / 2, -d / 2, 0.08), (w / 2, d / 2 - 0.02, rail), cover, 0.03))
    edges = np.linspace(-w / 2, w / 2, count + 1).tolist()
    for x0, x1 in itertools.pairwise(edges):
        parts.append(cushion((x0 + 0.003, d / 2 - 0.12, 0.1), (x1 - 0.003, d / 2, h), cover, 0.03))
    return parts


def _steel(random: Random, w: float, d: float, h: float, rail: float) -> list[Part]:
    """A frame of steel tubes with upright bars at head and foot."""
    steel, r, low = metal(random), 0.018, min(rail + 0.3, 0.75 * h)
    parts = []
    for y, top in ((d / 2 - r, h), (r - d / 2, low)):
        x = w / 2 - r
        arch = [(-x, y, 0), (-x, y, top - 0.1), (0.1 - x, y, top - r)]
        arch += [(-a, b, c) for a, b, c in reversed(arch)]
        parts += [tube(straight, r, steel, 6) for straight in itertools.pairwise(arch)]
        parts.append(tube([(-x, y, rail), (x, y, rail)], 0.012, steel, 6))
        across = np.linspace(-x, x, max(5, round(w / 0.2)) + 1).tolist()[1:-1]
        parts += [tube([(a, y, rail), (a, y, top - r)], 0.008, steel, 4) for a in across]
    parts += [
        box((a - 0.012, -d / 2 + r, rail - 0.06), (a + 0.012, d / 2 - r, rail), steel)
        for a in (0.02 - w / 2, w / 2 - 0.02)
    ]
    return [Part(np.maximum(part.vertices, (-np.inf, -np.inf, 0.0)), part.faces, part.material) for part in parts]


def bed(random: Random, wanted: WantedSize) -> Item:
    """A single or double bed: a wooden frame, an upholstered box or a steel frame, with the head at +y."""
    style = str(random.choice(["wooden", "boxspring", "steel", "drawers"]))
    w = drawn(random, wanted.width_m, *((0.95, 1.1) if random.random() < 0.4 else (1.45, 1.85)))
    d, h = drawn(random, wanted.depth_m, 2.02, 2.15), drawn(random, wanted.height_m, 0.85, 1.15)
    rail, mattress = min(float(random.uniform(0.28, 0.36)), 0.35 * h), float(random.uniform(0.16, 0.24))
    frame = finish(random, 0.15)[1]
    if style == "boxspring":
        parts = _boxspring(
            random, w, d, h, rail, cloth(random, ("gray", "beige", "brown", "blue", "black", "white"))[1]
        )
    elif style == "steel":
        parts = _steel(random, w, d, h, rail)
    else:
        parts = _wooden(random, w, d, h, rail, frame)
    if style == "drawers":
        fronts = Fronts(frame, metal(random), "groove")
        drawers = [p for k in (-1, 0) for p in fronts.drawer(k * 0.7 + 0.05, k * 0.7 + 0.7, 0.03, 0.17, 0.04 - w / 2)]
        parts += [turned(part, side * np.pi / 2) for part in drawers for side in (-1, 1)]
    name, bedding = _bedding(random, w, d, rail, rail + mattress, min(rail + mattress + 0.34, h - 0.03))
    return assembled("bed", parts + bedding, (w, d, h), name)


def _bedding(random: Random, w: float, d: float, low: float, top: float, high: float) -> tuple[str, list[Part]]:
    """Mattress, pillows, and a blanket that hangs over the sides and is folded back at the head; its colour word."""
    white = Material((232, 230, 224), "fabric", (216, 214, 208), 0.06)
    name, blanket = _linen(random)
    slip = white if random.random() < 0.5 else (blanket if random.random() < 0.5 else _linen(random)[1])
    back = Material(blanket.second, "fabric", darker(blanket.second, 0.85), 0.08)
    x, front, head = w / 2 - 0.045, 0.07 - d / 2, d / 2 - 0.13
    fold = head - float(random.uniform(0.55, 0.75))
    parts = [cushion((-x, front, low - 0.03), (x, head, top), white, 0.05)]
    parts.append(cushion((-x - 0.03, front - 0.01, low + 0.02), (x + 0.03, fold, top + 0.04), blanket, 0.05))
    parts.append(cushion((-x - 0.033, fold - 0.28, low + 0.1), (x + 0.033, fold - 0.02, top + 0.055), back, 0.04))
    count = 1 if w < 1.25 else 2
    wide = min(0.7, 1.8 * x / count)
    for k in range(count):
        middle = (k - (count - 1) / 2) * (2 * x / count)
        pillow = cushion((middle - wide / 2, head - 0.4, top), (middle + wide / 2, head - 0.02, top + 0.15), slip, 0.07)
        if high - top > 0.3:  # leans on the headboard
            tilt = np.clip((pillow.vertices[:, 1:2] - head + 0.4) / 0.4, 0, 1) * np.array([[0, 0, 0.1]])
            pillow = Part(pillow.vertices + tilt, pillow.faces, slip)
        parts.append(pillow)
    if random.random() < 0.4:  # a throw across the foot
        parts.append(
            cushion(
                (-x - 0.035, front + 0.15, low + 0.06), (x + 0.035, front + 0.6, top + 0.055), cloth(random)[1], 0.04
            )
        )
    return name, parts


DESIGNS = {"bed": bed}
