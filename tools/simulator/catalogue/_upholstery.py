"""Cushions, upholstered bodies and legs that beds and seats share."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from placegraph.tools.simulator.catalogue._cabinet_parts import metal, wood
from placegraph.tools.simulator.catalogue._item_assembly import Random, loft
from placegraph.tools.simulator.color_palette import MUTED, VIVID, darker, pick
from placegraph.tools.simulator.house_model import Material, Part
from placegraph.tools.simulator.mesh_primitives import Point, box, cylinder, moved, turned


def cloth(random: Random, names: Sequence[str] = MUTED + VIVID) -> tuple[str, Material]:
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


def upholstered(random: Random, w: float, d: float, h: float, seats: int, cover: Material) -> list[Part]:
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
