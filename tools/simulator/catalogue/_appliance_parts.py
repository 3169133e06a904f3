"""Molded solids, unit fronts, knobs and taps that kitchen and bathroom share."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from placegraph.tools.simulator.catalogue._item_assembly import Random
from placegraph.tools.simulator.catalogue._materials import DARK, STEEL
from placegraph.tools.simulator.color_palette import WOODS, darker, pick
from placegraph.tools.simulator.house_model import Material, Part
from placegraph.tools.simulator.mesh_primitives import block, box, cylinder, lathe, moved, tube, turned


def molded(
    profile: Sequence[tuple[float, float]], w: float, d: float, material: Material, corner: float = 5, sides: int = 16
) -> Part:
    """A solid of rounded rectangles: profile of (share of w and d, height); corner 2 is an ellipse, 10 nearly a box."""
    part = lathe(profile, material, sides=sides)
    radius = np.maximum(np.hypot(part.vertices[:, 0], part.vertices[:, 1]), 1e-9)
    cos, sin = np.abs(part.vertices[:, 0]) / radius, np.abs(part.vertices[:, 1]) / radius
    stretch = np.maximum((cos**corner + sin**corner) ** (1 / corner), 0.1)
    vertices = part.vertices.copy()
    vertices[:, :2] *= np.array([w / 2, d / 2]) / stretch[:, None]
    return Part(vertices, part.faces, material)


def knob(x: float, y: float, z: float, radius_m: float, length_m: float, material: Material, sides: int = 10) -> Part:
    """A cylinder that sticks out of the front at (x, y, z), towards -y."""
    return moved(turned(cylinder((0, 0, 0), radius_m, length_m, material, sides=sides), np.pi / 2, "x"), (x, y, z))


def fronts(random: Random, w: float, y: float, z0: float, z1: float) -> tuple[str, list[Part]]:
    """Doors and drawers of a unit between two heights, before the carcass front y: word and parts."""
    word, color = pick(random, ("white", "white", "gray", "blue", "green", "beige", "black", "red"))
    face = Material(color, gloss=0.3)
    if random.random() < 0.35:
        word, color = pick(random, tuple(WOODS), WOODS)
        face = Material(color, "wood", darker(color, 0.85), 0.25, int(random.integers(99)))
    grip, bars = (STEEL, DARK)[int(random.integers(2))], random.random() < 0.6
    count = max(1, round(w / 0.5))
    drawers, step, parts = int(random.integers(count)), w / count, []
    for k in range(count):
        x0, x1 = -w / 2 + k * step + 0.003, -w / 2 + (k + 1) * step - 0.003
        edges = [z0, z0 + (z1 - z0) * 0.4, z0 + (z1 - z0) * 0.75, z1] if k == drawers and count > 1 else [z0, z1]
        for low, high in pairwise(edges):
            parts.append(box((x0, y - 0.02, low + 0.003), (x1, y, high - 0.003), face))
            x = (x0 + x1) / 2 if len(edges) > 2 else (x1 - 0.05 if k % 2 == 0 else x0 + 0.05)
            long, tall = (0.14, 0.012) if len(edges) > 2 else (0.012, 0.14)
            if bars:
                parts.append(block((x, y - 0.03, high - 0.04 - tall), (long, 0.02, tall), grip))
            else:
                parts.append(knob(x, y - 0.02, high - 0.06, 0.016, 0.02, grip, 8))
    return word, parts


def tap(y: float, z: float, rise: float, reach: float) -> list[Part]:
    """A swan neck that stands at (0, y, z), reaches forward, and has a lever at its side."""
    path = ((0, 0), (0, 0.75), (0.4, 1), (1, 0.8), (1, 0.55))
    neck = tube([(0, y - reach * a, z + rise * b) for a, b in path], 0.013, STEEL, 7)
    lever = box((0.02, y - 0.01, z + rise * 0.2), (0.09, y + 0.01, z + rise * 0.2 + 0.015), STEEL)
    return [neck, cylinder((0, y, z), 0.026, 0.03, STEEL, sides=8), lever]
