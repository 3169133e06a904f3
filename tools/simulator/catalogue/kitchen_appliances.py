"""Small appliances on a worktop: microwave, kettle, toaster and coffee machine."""

from __future__ import annotations

import numpy as np

from placegraph.tools.simulator.catalogue._appliance_parts import knob, molded
from placegraph.tools.simulator.catalogue._item_assembly import Random, WantedSize, fitted
from placegraph.tools.simulator.catalogue._materials import DARK, GLASS, STEEL
from placegraph.tools.simulator.catalogue.kitchen import DISPLAY, enamel_finish
from placegraph.tools.simulator.color_palette import darker, pick
from placegraph.tools.simulator.house_model import Item, Material, Part
from placegraph.tools.simulator.mesh_primitives import (
    Point,
    block,
    box,
    cylinder,
    ellipsoid,
    lathe,
    moved,
    tube,
    turned,
)


def microwave(random: Random, wanted: WantedSize) -> Item:
    """A low box: dark window on the left, and on the right a display with keys, or two dials."""
    w, d, h = wanted.fill(random, (0.44, 0.54), (0.32, 0.42), (0.26, 0.31), always_draw=True)
    word, enamel = enamel_finish(random)
    y, split = -d / 2 + 0.03, w * 0.24
    parts = [box((-w / 2, y, 0.012), (w / 2, d / 2, h), enamel)]
    parts += [block((x, e, 0), (0.03, 0.03, 0.012), DARK) for x in (-w * 0.42, w * 0.42) for e in (-d * 0.36, d * 0.42)]
    parts.append(box((-w / 2, y - 0.012, 0.012), (split, y, h), enamel))
    parts.append(box((-w * 0.44, y - 0.014, h * 0.2), (split - 0.05, y, h * 0.86), GLASS))
    parts.append(box((split - 0.03, y - 0.03, h * 0.16), (split - 0.015, y - 0.01, h * 0.88), STEEL))
    panel = DARK if random.random() < 0.5 else Material(darker(enamel.color, 0.85))
    parts.append(box((split + 0.004, y - 0.012, 0.012), (w / 2, y, h), panel))
    x, keys = (split + w / 2) / 2, Material((214, 214, 210))
    if random.random() < 0.35:
        parts += [knob(x, y - 0.012, h * share, w * 0.065, 0.018, STEEL, 12) for share in (0.33, 0.72)]
        return fitted("microwave", parts, (w, d, h), word)
    parts.append(box((split + 0.02, y - 0.014, h * 0.76), (w / 2 - 0.015, y, h * 0.9), DISPLAY))
    step = (w / 2 - split) * 0.26
    for k in range(12):
        at = (x + (k % 3 - 1) * step, y - 0.012, h * (0.15 + 0.145 * (k // 3)))
        parts.append(block(at, (step * 0.7, 0.006, h * 0.08), keys))
    return fitted("microwave", parts, (w, d, h), word)


def kettle(random: Random, wanted: WantedSize) -> Item:
    """An electric jug on its base, or a round kettle with a long spout and a bow over the lid."""
    w, d, h = wanted.fill(random, (0.21, 0.26), (0.15, 0.18), (0.2, 0.27), always_draw=True)
    word, color = pick(random, ("gray", "gray", "white", "black", "red", "blue", "green", "beige"))
    body = Material(color, gloss=0.7)
    r = d / 2
    if random.random() < 0.5:
        jug = [(0, 0.025), (r * 0.95, 0.025), (r, 0.06), (r * 0.72, h * 0.86), (r * 0.5, h * 0.93), (0, h * 0.95)]
        bow: list[Point] = [(r * x, 0, h * z) for x, z in ((0.7, 0.88), (1.6, 0.84), (1.7, 0.4), (0.92, 0.2))]
        beak = turned(cylinder((0, 0, 0), 0.02, r * 0.5, body, 0.035, 8), -0.6, "y")
        parts = [lathe(jug, body, sides=14), cylinder((0, 0, 0), r, 0.022, DARK, sides=12), tube(bow, 0.012, DARK, 6)]
        parts += [moved(beak, (-r * 0.55, 0, h * 0.7)), cylinder((0, 0, h * 0.94), 0.014, h * 0.06, DARK, sides=6)]
        parts.append(lathe([(r * 0.97, 0.06), (r * 0.975, 0.075)], STEEL, sides=14))
        return fitted("kettle", parts, (w, d, h), word)
    pot = [(0, 0), (r * 0.9, 0), (r, h * 0.12), (r * 0.9, h * 0.36), (r * 0.45, h * 0.55), (0, h * 0.58)]
    angles = np.linspace(0.1, np.pi - 0.1, 7).tolist()
    arch: list[Point] = [(r * np.cos(t) * 0.85, 0, h * (0.4 + 0.57 * np.sin(t))) for t in angles]
    spout: list[Point] = [(-r * 0.7, 0, h * 0.22), (-r * 1.25, 0, h * 0.4), (-r * 1.55, 0, h * 0.58)]
    parts = [lathe(pot, body, sides=16), tube(arch, 0.011, DARK, 6), tube(spout, 0.015, body, 6)]
    return fitted("kettle", [*parts, ellipsoid((0, 0, h * 0.61), (0.016, 0.016, h * 0.05), DARK, 8)], (w, d, h), word)


def toaster(random: Random, wanted: WantedSize) -> Item:
    """A rounded box with slots on top, a lever and a dial, at times with bread that looks out."""
    w, d, h = wanted.fill(random, (0.26, 0.38), (0.16, 0.2), (0.18, 0.22), always_draw=True)
    word, color = pick(random, ("gray", "gray", "white", "black", "red", "green", "blue", "beige"))
    bread = random.random() < 0.5
    top = h * 0.84 if bread else h - 0.002
    shell = [(0, 0.015), (1.0, 0.02), (1.0, top * 0.8), (0.93, top * 0.96), (0.85, top), (0, top)]
    parts = [molded(shell, w * 0.9, d * 0.94, Material(color, gloss=0.7), 6)]
    parts.append(block((0, 0, 0), (w * 0.84, d * 0.84, 0.02), DARK))
    crust, twin = Material((176, 118, 62), "noise", (206, 156, 96), 0.02), w > 0.32
    for y in (-d * 0.15, d * 0.15):
        parts.append(block((0, y, top - 0.01), (w * 0.72, d * 0.13, 0.012), DARK))
        if bread:
            slices = [(x, y, top) for x in ((-w * 0.18, w * 0.18) if twin else (0.0,))]
            parts += [block(at, (w * (0.3 if twin else 0.45), d * 0.09, h - top), crust) for at in slices]
    parts.append(box((w * 0.43, -0.006, h * 0.2), (w * 0.452, 0.006, h * 0.66), DARK))
    parts.append(box((w * 0.44, -0.025, h * 0.52), (w * 0.54, 0.025, h * 0.6), DARK))
    parts.append(box((w * 0.44, -d * 0.3, h * 0.2), (w * 0.46, -d * 0.18, h * 0.32), STEEL))
    parts.append(knob(w * 0.25, -d * 0.46, h * 0.32, 0.018, 0.012, STEEL if word == "black" else DARK))
    return fitted("toaster", parts, (w, d, h), word)


def coffee_machine(random: Random, wanted: WantedSize) -> Item:
    """A filter machine with a glass jug, an espresso box with a portafilter, or a slim capsule machine."""
    kind = int(random.integers(3))
    wide = ((0.2, 0.26), (0.24, 0.32), (0.14, 0.18))[kind]
    w, d, h = wanted.fill(random, wide, (0.26, 0.34), (0.3, 0.38), always_draw=True)
    word, color = pick(random, ("black", "black", "gray", "gray", "white", "red"))
    body = Material(color, gloss=0.5)
    parts = (_filter_machine, _espresso_machine, _capsule_machine)[kind](w, d, h, body)
    return fitted("coffee machine", parts, (w, d, h), word)


def _filter_machine(w: float, d: float, h: float, body: Material) -> list[Part]:
    """Tower at the back, filter hood above, jug with coffee on the plate."""
    coffee, r = Material((52, 30, 18), gloss=0.9), min(w, d) * 0.3
    foot, hood = [(0, 0), (1, 0), (1, 0.04), (0, 0.04)], [(0, 0), (0.75, 0), (0.95, h * 0.3), (0, h * 0.3)]
    parts = [molded(foot, w, d, body, 5), block((0, d * 0.32, 0.03), (w * 0.9, d * 0.34, h - 0.03), body)]
    parts.append(moved(molded(hood, w, d * 0.9, body, 4), (0, -d * 0.04, h * 0.7)))
    jug = [(0, 0), (r, 0), (r * 1.1, h * 0.2), (r * 0.7, h * 0.45), (r * 0.75, h * 0.5), (0, h * 0.5)]
    parts += [lathe([*jug[:3], (0, h * 0.2)], coffee, (0, -d * 0.14, 0.042), 12)]
    clear = Material((196, 206, 210), gloss=0.9)
    parts += [lathe([(r * 1.1, h * 0.2), *jug[3:]], clear, (0, -d * 0.14, 0.042), 12)]
    bow: list[Point] = [(r * 0.7, 0, h * 0.5), (r * 1.7, 0, h * 0.46), (r * 1.6, 0, h * 0.2), (r, 0, h * 0.12)]
    parts.append(moved(tube(bow, 0.009, DARK, 5), (0, -d * 0.14, 0.04)))
    parts.append(box((w * 0.2, -d * 0.5, 0.012), (w * 0.3, -d * 0.47, 0.03), Material((200, 60, 40), glow=0.7)))
    return parts


def _espresso_machine(w: float, d: float, h: float, body: Material) -> list[Part]:
    """A box with gauge and knobs, portafilter below the head, steam wand, drip grid, cups on top."""
    top, y = h * 0.87, -d * 0.1
    grid = Material((150, 150, 154), "grille", (40, 40, 44), 0.03)
    parts = [box((-w / 2, y, 0), (w / 2, d / 2, top), body), box((-w / 2, -d / 2, top * 0.68), (w / 2, y, top), body)]
    parts.append(box((-w / 2, -d / 2, 0), (w / 2, y, 0.06), STEEL))
    parts.append(box((-w * 0.46, -d * 0.48, 0.06), (w * 0.46, y, 0.064), grid))
    parts.append(cylinder((0, -d * 0.3, top * 0.56), 0.034, top * 0.12, STEEL, sides=10))
    parts.append(tube([(0, -d * 0.3, top * 0.58), (0, -d * 0.62, top * 0.55)], 0.014, DARK, 6))
    parts.append(tube([(w * 0.38, -d * 0.4, top * 0.68), (w * 0.42, -d * 0.44, top * 0.3)], 0.006, STEEL, 5))
    parts.append(knob(0, -d / 2, top * 0.84, top * 0.07, 0.006, Material((240, 240, 236))))
    parts += [knob(x, -d / 2, top * 0.84, 0.016, 0.02, DARK, 8) for x in (-w * 0.32, w * 0.32)]
    cup = Material((240, 238, 232), gloss=0.4)
    return [*parts, *(cylinder((x, d * 0.2, top), 0.024, h - top, cup, 0.034, 8) for x in (-w * 0.2, w * 0.16))]


def _capsule_machine(w: float, d: float, h: float, body: Material) -> list[Part]:
    """A slim rounded machine: head with lever over a small cup, clear water tank behind."""
    tank = Material((150, 186, 206), gloss=0.9)
    parts = [box((-w * 0.42, d * 0.24, 0.02), (w * 0.42, d / 2, h * 0.84), tank)]
    parts.append(moved(molded([(0, 0), (1, 0), (1, h * 0.8), (0, h * 0.84)], w, d * 0.45, body, 4), (0, d * 0.03, 0)))
    snout = [(0, 0), (0.9, 0), (1, 0.02), (1, d * 0.6), (0, d * 0.66)]
    head = turned(molded(snout, w * 0.9, h * 0.3, body, 3), np.pi / 2, "x")
    parts.append(moved(head, (0, d * 0.22, h * 0.76)))
    lever: list[Point] = [(-w * 0.3, d * 0.1, h * 0.88), (0, -d * 0.1, h * 0.98), (w * 0.3, d * 0.1, h * 0.88)]
    parts.append(tube(lever, 0.009, STEEL, 6))
    parts.append(cylinder((0, -d * 0.32, h * 0.54), 0.018, 0.08, DARK, sides=8))
    parts.append(box((-w * 0.45, -d / 2, 0), (w * 0.45, 0, 0.03), DARK))
    return [*parts, cylinder((0, -d * 0.32, 0.032), 0.026, 0.065, Material((240, 238, 232), gloss=0.4), 0.036, 10)]


DESIGNS = {
    "microwave": microwave, "kettle": kettle, "toaster": toaster, "coffee machine": coffee_machine,
}  # fmt: skip
