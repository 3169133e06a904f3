"""Beds, with mattress, pillows and blanket, and the cushions and upholstery that seats borrow."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
from numpy.random import Generator

from placegraph.tools.simulator.catalogue._assembly import drawn, loft
from placegraph.tools.simulator.catalogue.tables import Fronts, Size, assembled, finish, metal, wood
from placegraph.tools.simulator.model import Item, Material, Part
from placegraph.tools.simulator.palette import MUTED, VIVID, darker, pick
from placegraph.tools.simulator.shapes import Point, box, cylinder, moved, tube, turned


def cloth(random: Generator, names: Sequence[str] = MUTED + VIVID) -> tuple[str, Material]:
    """A cover for cushions, fabric or leather, at times striped or checked: its word and material."""
    name, color = pick(random, names)
    kind = float(random.random())
    if kind < 0.2:
        return name, Material(color, gloss=0.3)  # leather
    texture = "fabric" if kind < 0.8 else ("stripes" if kind < 0.9 else "checks")
    return name, Material(color, texture, darker(color, 0.78), 0.1, int(random.integers(1000)))


def cushion(low: Point, high: Point, material: Material, round_m: float = 0.04) -> Part:
    """A box between two corners whose edges and corners are cut off by `round_m`, or less where it is thin."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    r = min(round_m, 0.28 * min(x1 - x0, y1 - y0), 0.45 * (z1 - z0))
    rings = []
    for z, inset in ((z0, 0.7 * r), (z0 + r, 0.0), (z1 - r, 0.0), (z1, 0.7 * r)):
        a0, a1, b0, b1 = x0 + inset, x1 - inset, y0 + inset, y1 - inset
        rings += [(a0 + r, b0, z), (a1 - r, b0, z), (a1, b0 + r, z), (a1, b1 - r, z),
                  (a1 - r, b1, z), (a0 + r, b1, z), (a0, b1 - r, z), (a0, b0 + r, z)]  # fmt: skip
    return loft(np.array(rings, float).reshape(4, 8, 3), material)


def leaned(parts: Sequence[Part], z0: float, z1: float, back_m: float) -> list[Part]:
    """Shears what lies above z0 backward, so that z1 comes to lie `back_m` behind."""
    leaned = []
    for part in parts:
        shift = np.clip((part.vertices[:, 2:] - z0) / (z1 - z0), 0, None) * np.array([[0, back_m, 0]])
        leaned.append(Part(part.vertices + shift, part.faces, part.material))
    return leaned


def legs(w: float, d: float, high: float, thick: float, material: Material, splay: float = 0.0) -> list[Part]:
    """Four legs inside a footprint of w by d, upright boxes, or round and splayed outward by `splay` metres."""
    x, y = w / 2 - thick / 2, d / 2 - thick / 2
    corners = [(a * x, b * y) for a in (-1, 1) for b in (-1, 1)]
    if splay == 0:
        half = thick / 2
        return [box((x - half, y - half, 0), (x + half, y + half, high), material) for x, y in corners]
    inner = [(x - np.sign(x) * splay, y - np.sign(y) * splay) for x, y in corners]
    parts = [cylinder((0, 0, 0), thick / 2, high, material, sides=6) for _ in corners]
    return [
        _sheared(moved(p, (*b, 0)), c[0] - b[0], c[1] - b[1], high)
        for p, c, b in zip(parts, corners, inner, strict=True)
    ]


def _sheared(part: Part, x_m: float, y_m: float, high: float) -> Part:
    """Moves the foot of an upright part by (x_m, y_m) and leaves its head where it is."""
    share = 1 - part.vertices[:, 2:] / high
    return Part(part.vertices + share * np.array([[x_m, y_m, 0.0]]), part.faces, part.material)


def upholstered(random: Generator, w: float, d: float, h: float, seats: int, cover: Material) -> list[Part]:
    """A soft seat for some people: base, arms, back and loose cushions, exactly w by d by h."""
    arm_kind = str(random.choice(["block", "roll", "slim"]))
    arm = {"block": 0.18, "roll": 0.2, "slim": 0.1}[arm_kind] * min(1.0, w / 0.8)
    foot = float(random.uniform(0.05, 0.15))
    seat, arm_top = min(0.44, 0.55 * h), min(float(random.uniform(0.56, 0.64)), 0.8 * h)
    back, inner = 0.22 * d, w / 2 - arm
    shade = Material(darker(cover.color, 0.85), cover.texture, darker(cover.second, 0.85), cover.scale_m, cover.seed)
    leg = metal(random) if random.random() < 0.3 else wood(random)[1]
    parts = legs(w - 0.08, d - 0.08, foot, 0.05, leg)
    parts.append(box((0.01 - w / 2, 0.01 - d / 2, foot), (w / 2 - 0.01, d / 2, seat - 0.15), shade))
    parts.append(cushion((-w / 2 + 0.02, d / 2 - 0.5 * back, foot), (w / 2 - 0.02, d / 2, h - 0.03), cover))
    for side in (-1, 1):
        x0, x1 = sorted((side * inner, side * w / 2))
        if arm_kind == "roll":
            r = (x1 - x0) / 2
            parts.append(box((x0 + 0.03, -d / 2 + 0.03, foot), (x1 - 0.03, d / 2 - 0.02, arm_top - r), cover))
            roll = cylinder((0, 0, 0), r, d - 0.02, cover, sides=12)
            parts.append(moved(turned(roll, np.pi / 2, "x"), ((x0 + x1) / 2, d / 2 - 0.02, arm_top - r)))
        else:
            parts.append(cushion((x0, -d / 2, foot), (x1, d / 2 - 0.02, arm_top), cover))
    edges = np.linspace(-inner, inner, seats + 1).tolist()
    for x0, x1 in itertools.pairwise(edges):
        parts.append(cushion((x0 + 0.004, -d / 2, seat - 0.16), (x1 - 0.004, d / 2 - back, seat), cover))
        soft = cushion((x0 + 0.01, d / 2 - back, seat - 0.02), (x1 - 0.01, d / 2 - 0.4 * back, h), cover, 0.06)
        parts += leaned([soft], seat, h, 0.2 * back)
    return parts


def _linen(random: Generator) -> tuple[str, Material]:
    """What a blanket is made of."""
    name, color = pick(random, ("white", "gray", "blue", "red", "green", "beige", "pink", "yellow", "purple", "brown"))
    texture = str(random.choice(["fabric", "fabric", "stripes", "checks", "leaves"]))
    second = darker(color, 0.75) if random.random() < 0.6 else pick(random, ("white", "beige"))[1]
    return name, Material(color, texture, second, 0.25, int(random.integers(1000)))


def _wooden(random: Generator, w: float, d: float, h: float, rail: float, frame: Material) -> list[Part]:
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


def _boxspring(random: Generator, w: float, d: float, h: float, rail: float, cover: Material) -> list[Part]:
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


def _steel(random: Generator, w: float, d: float, h: float, rail: float) -> list[Part]:
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


def bed(random: Generator, *, width_m: Size = None, depth_m: Size = None, height_m: Size = None) -> Item:
    """A single or double bed: a wooden frame, an upholstered box or a steel frame, with the head at +y."""
    style = str(random.choice(["wooden", "boxspring", "steel", "drawers"]))
    w = drawn(random, width_m, *((0.95, 1.1) if random.random() < 0.4 else (1.45, 1.85)))
    d, h = drawn(random, depth_m, 2.02, 2.15), drawn(random, height_m, 0.85, 1.15)
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


def _bedding(random: Generator, w: float, d: float, low: float, top: float, high: float) -> tuple[str, list[Part]]:
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
