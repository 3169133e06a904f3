"""Small things of a household: cups, bowls, bottles, books, boxes and waste bins."""

from __future__ import annotations

import numpy as np

from placegraph.tools.simulator.catalogue._item_assembly import (
    Random,
    WantedSize,
    arc,
    chance,
    drawn,
    fitted,
    hoop,
    merged,
)
from placegraph.tools.simulator.color_palette import COLORS, METALS, VIVID, darker, jitter, pick
from placegraph.tools.simulator.house_model import Item, Material, Part
from placegraph.tools.simulator.mesh_primitives import block, box, cylinder, ellipsoid, lathe, moved, tube, turned

_ANY = (*VIVID, "white", "black", "gray", "brown", "beige")


def cup(random: Random, wanted: WantedSize) -> Item:
    """A straight mug, a round one, or a teacup on a saucer: with a handle to one side and a drink inside."""
    kind = int(random.integers(3))
    name, color = pick(random, (*VIVID, "white", "white", "black", "gray", "beige"))
    texture = str(random.choice(["plain", "plain", "stripes", "checks"]))
    glaze = Material(color, texture, jitter(COLORS["white"], random), 0.06, int(random.integers(1000)), 0.5)
    plain = Material(color, gloss=0.5)
    drink = Material((58, 36, 24) if chance(random, 0.6) else darker(color, 0.5), gloss=0.4)
    tall = drawn(random, wanted.height_m, *((0.055, 0.07) if kind == 2 else (0.085, 0.115)))
    wide = tall * float(random.uniform(0.38, 0.47)) * (1.5 if kind == 2 else 1.0)
    shares = (((0.97, 0), (1, 0.5)), ((0.7, 0), (1.05, 0.45)), ((0.5, 0), (0.8, 0.4)))[kind]
    wall = [(0.0, 0.0), *((r * wide, z * tall) for r, z in shares), (wide, tall), (wide * 0.88, tall)]
    parts = [lathe([*wall, (wide * 0.86, tall * 0.8)], glaze, sides=12)]
    parts.append(lathe([(wide * 0.88, tall * 0.8), (0, tall * 0.8)], drink, sides=12))
    loop = arc((wide * 0.88, 0, tall * 0.52), (wide * 0.62, tall * 0.32), np.pi / 2, -np.pi / 2)
    parts.append(tube(loop, tall * 0.055, plain, sides=5))
    if kind == 2:
        plate = lathe([(0, -0.008), (wide, -0.008), (wide * 1.8, 0.006), (wide, -0.003), (0, -0.003)], plain, sides=12)
        parts.append(plate)
    return fitted("cup", parts, (wanted.width_m, wanted.depth_m, tall), name)


def bowl(random: Random, wanted: WantedSize) -> Item:
    """A deep or a flat bowl on a foot, of one colour inside and another outside, empty or with fruit."""
    radius = drawn(random, wanted.depth_m if wanted.width_m is None else wanted.width_m, 0.14, 0.3) / 2
    tall = radius * float(random.uniform(0.6, 0.95))
    name, color = pick(random, _ANY)
    texture = str(random.choice(["plain", "plain", "stripes", "wood"]))
    outside = Material(color, texture, darker(color, 0.7), 0.05, gloss=0.4)
    inside = Material(darker(color, 0.75) if chance(random, 0.4) else jitter(COLORS["white"], random), gloss=0.4)
    foot = float(random.uniform(0.35, 0.55)) * radius
    mid = 0.88 if chance(random, 0.5) else 0.72
    outer = [(0.0, 0.0), (foot, 0), (foot, 0.08 * tall), (mid * radius, 0.5 * tall), (radius, tall)]
    parts = [lathe([*outer, (0.95 * radius, tall)], outside, sides=16)]
    inner = [(0.95 * radius, tall), (mid * radius * 0.94, 0.53 * tall), (foot, 0.16 * tall), (0.0, 0.14 * tall)]
    parts.append(lathe(inner, inside, sides=16))
    if chance(random, 0.4):
        size = radius * 0.33
        for k in range(int(random.integers(3, 5))):
            fruit = Material(pick(random, ("red", "green", "orange", "yellow"))[1], gloss=0.3)
            at = (0.36 * radius * float(np.cos(2.1 * k)), 0.36 * radius * float(np.sin(2.1 * k)), 0.36 * tall + size)
            parts.append(ellipsoid(at if k < 3 else (0, 0, 0.5 * tall + size), (size, size, size), fruit, sides=6))
    sizes = (wanted.width_m or 2 * radius, wanted.depth_m or 2 * radius, wanted.height_m)
    return fitted("bowl", parts, sizes, name)


def _wine(random: Random, tall_m: float) -> tuple[str, list[Part]]:
    name, glass = [("green", (34, 62, 40)), ("brown", (78, 44, 24)), ("green", (92, 128, 84))][int(random.integers(3))]
    body = Material(jitter(glass, random, 5), gloss=0.8)
    foil = Material(pick(random, ("red", "black", "yellow", "white"))[1], gloss=0.4)
    r = tall_m * 0.125
    profile = [(0, 0), (r, 0), (r, 0.58), (0.42 * r, 0.74), (0.36 * r, 0.84), (0, 0.84)]
    parts = [lathe([(x, z * tall_m) for x, z in profile], body, sides=14)]
    parts.append(cylinder((0, 0, 0.82 * tall_m), 0.42 * r, 0.18 * tall_m, foil, sides=10))
    paper = Material(jitter((232, 224, 202), random), "grille", (196, 150, 120), 0.0)
    parts.append(lathe([(1.02 * r, 0.14 * tall_m), (1.02 * r, 0.44 * tall_m)], paper, sides=14))
    return name, parts


def _water(random: Random, tall_m: float) -> tuple[str, list[Part]]:
    plastic = Material(jitter((176, 208, 226), random, 6), gloss=0.7)
    lid_name, lid = pick(random, ("blue", "blue", "red", "green", "white"))
    r = tall_m * 0.14
    profile = [
        (0, 0),
        (0.9 * r, 0),
        (r, 0.04),
        (r, 0.3),
        (0.88 * r, 0.36),
        (r, 0.42),
        (r, 0.68),
        (0.36 * r, 0.88),
        (0, 0.88),
    ]
    parts = [lathe([(x, z * tall_m) for x, z in profile], plastic, sides=12)]
    parts.append(cylinder((0, 0, 0.88 * tall_m), 0.4 * r, 0.12 * tall_m, Material(lid), sides=10))
    wrap = Material(lid, "stripes", (238, 238, 236), 0.06)
    parts.append(lathe([(1.03 * r, 0.44 * tall_m), (1.03 * r, 0.66 * tall_m)], wrap, sides=12))
    return "blue" if lid_name == "blue" else "", parts


def _sport(random: Random, tall_m: float) -> tuple[str, list[Part]]:
    name, color = pick(random, (*VIVID, "white", "black", "gray"))
    steel, cap = Material(color, gloss=0.6), Material(METALS["black"], gloss=0.3)
    r = tall_m * 0.15
    profile = [(0, 0), (r, 0), (r, 0.68), (0.62 * r, 0.78), (0, 0.78)]
    parts = [lathe([(x, z * tall_m) for x, z in profile], steel, sides=14)]
    parts.append(cylinder((0, 0, 0.78 * tall_m), 0.66 * r, 0.14 * tall_m, cap, sides=12))
    loop = arc((0, 0, 0.9 * tall_m), (0.5 * r, 0.09 * tall_m), 0, np.pi, 4)
    parts += [tube(loop, 0.02 * tall_m, cap, sides=4), cylinder((0, 0, 0), r * 1.02, 0.03 * tall_m, cap, sides=14)]
    return name, parts


def bottle(random: Random, wanted: WantedSize) -> Item:
    """A wine bottle with label and foil, a plastic water bottle, or a steel one with a carrying loop."""
    tall = drawn(random, wanted.height_m, 0.22, 0.33)
    name, parts = (_wine, _wine, _water, _sport)[int(random.integers(4))](random, tall)
    return fitted("bottle", parts, (wanted.width_m, wanted.depth_m, tall), name)


def _volume(random: Random, size: tuple[float, float, float]) -> tuple[str, list[Part]]:
    """One lying book: two boards and a spine to its left around the pages, a title's field on the cover."""
    (w, d, h), board = size, min(0.003, size[2] * 0.15)
    name, color = pick(random, (*VIVID, "black", "brown", "gray", "white"))
    cover = Material(color, gloss=0.2)
    ink = Material(jitter((232, 220, 170), random) if name not in ("white",) else (60, 60, 70))
    pages = Material((236, 228, 206), "grille", (196, 186, 160), 0.0)
    parts = [box((-w / 2, -d / 2, z), (w / 2, d / 2, z + board), cover) for z in (0.0, h - board)]
    parts.append(box((-w / 2, -d / 2, board), (board - w / 2, d / 2, h - board), cover))
    parts = [
        merged(parts),
        box((board - w / 2, 0.004 - d / 2, board), (w / 2 - 0.004, d / 2 - 0.004, h - board), pages),
    ]
    if chance(random, 0.4):
        image = Material(pick(random, VIVID)[1], "picture", color, 0.0, int(random.integers(100_000)))
        parts.append(block((0.02 * w, -0.05 * d, h), (0.7 * w, 0.5 * d, 0.0008), image))
    else:
        parts.append(block((0.03 * w, 0.22 * d, h), (0.62 * w, 0.16 * d, 0.0008), ink))
    parts.append(block((0.03 * w, -0.36 * d, h), (0.4 * w, 0.04 * d, 0.0008), ink))
    parts.append(box((-w / 2 - 0.0008, -0.3 * d, 0.3 * h), (0.01 - w / 2, 0.3 * d, 0.7 * h), ink))
    return name, parts


def book(random: Random, wanted: WantedSize) -> Item:
    """One closed book, or a crooked pile of two to four, lying."""
    count = int(random.choice([1, 1, 2, 3, 4]))
    width, z = drawn(random, wanted.width_m, 0.13, 0.2), 0.0
    parts: list[Part] = []
    words: list[str] = []
    for k in range(count):
        w = width * (1 - 0.07 * k)
        size = (w, w * float(random.uniform(1.25, 1.5)), float(random.uniform(0.018, 0.045)))
        word, volume = _volume(random, size)
        turn = float(random.uniform(-0.25, 0.25)) if count > 1 else 0.0
        parts += [moved(turned(part, turn), (0, 0, z)) for part in volume]
        z, words = z + size[2], [*words, word]
    return fitted("book", parts, wanted, words[0] if count == 1 else "")


def _flaps(size: tuple[float, float, float], card: Material) -> list[Part]:
    """Four open flaps around the top, leaning outward."""
    (w, d, h), out, parts = size, 0.4, []
    for sx in (-1, 1):
        flap = box((-0.002, -d / 2, 0), (0.002, d / 2, 0.4 * w), card)
        parts.append(moved(turned(flap, sx * (np.pi / 2 - out), "y"), (sx * (w / 2 - 0.004), 0, h)))
    for sy in (-1, 1):
        flap = box((-w / 2, -0.002, 0), (w / 2, 0.002, 0.35 * d), card)
        parts.append(moved(turned(flap, -sy * (np.pi / 2 + 0.3), "x"), (0, sy * (d / 2 - 0.004), h)))
    return parts


def carton(random: Random, wanted: WantedSize) -> Item:
    """A closed carton with tape and label, an open one with its flaps out, or a storage box with a lid."""
    w, d = drawn(random, wanted.width_m, 0.25, 0.55), drawn(random, wanted.depth_m, 0.2, 0.4)
    h, kind = drawn(random, wanted.height_m, 0.18, 0.4), int(random.integers(4))
    shade = jitter((178, 138, 92), random)
    card, tape = Material(shade, "noise", darker(shade, 0.93), 0.05), Material((206, 178, 128), gloss=0.4)
    label = Material((234, 232, 226), "grille", (120, 120, 120), 0.0)
    name = "brown"
    if kind <= 1:
        parts = [block((0, 0, 0), (w, d, h), card)]
        parts.append(block((0, 0, h), (w, 0.055, 0.001), tape))
        parts += [block((sx * w / 2, 0, h * 0.7), (0.002, 0.055, h * 0.3), tape) for sx in (-1, 1)]
        parts.append(block((w * 0.2, -d / 2, h * 0.45), (w * 0.35, 0.002, h * 0.3), label))
        parts.append(block((-w * 0.3, -d / 2, h * 0.12), (w * 0.12, 0.002, h * 0.16), Material((70, 52, 40))))
        parts.append(block((0, 0, h), (w, 0.004, 0.0015), Material(darker(shade, 0.5))))
    elif kind == 2:
        inside = Material(darker(shade, 0.45))
        parts = [block((0, 0, 0), (w, d, 0.75 * h), card), *_flaps((w, d, 0.75 * h), card)]
        parts.append(block((0, 0, 0.75 * h), (w * 0.96, d * 0.95, 0.002), inside))
        parts.append(block((w * 0.15, -d / 2, h * 0.25), (w * 0.4, 0.002, h * 0.25), label))
    else:
        name, color = pick(random, _ANY)
        body = Material(color, str(random.choice(["plain", "stripes", "fabric"])), darker(color, 0.75), 0.06)
        parts = [block((0, 0, 0), (w * 0.95, d * 0.95, h * 0.85), body)]
        parts.append(block((0, 0, h * 0.78), (w, d, h * 0.22), Material(darker(color, 0.8))))
        parts.append(block((0, -d * 0.475, h * 0.4), (w * 0.24, 0.008, h * 0.2), label))
        parts.append(block((0, -d * 0.475, h * 0.62), (w * 0.2, 0.01, h * 0.06), Material((40, 38, 38))))
    return fitted("box", parts, wanted, name)


def _pedal_bin(random: Random, r: float, tall_m: float, skin: Material) -> list[Part]:
    dark = Material((30, 29, 30))
    return [
        cylinder((0, 0, 0), r, tall_m * 0.06, dark),
        cylinder((0, 0, tall_m * 0.06), r * 0.97, tall_m * 0.74, skin),
        cylinder((0, 0, tall_m * 0.8), r * 1.02, tall_m * 0.05, dark),
        lathe([(r, tall_m * 0.85), (r * 0.8, tall_m * 0.95), (r * 0.3, tall_m), (0, tall_m)], skin),
        block((0, -r * 1.08, tall_m * 0.02), (r * 0.5, r * 0.34, tall_m * 0.03), Material(METALS["gray"])),
        block((0, r * 0.95, tall_m * 0.7), (r * 0.4, r * 0.2, tall_m * 0.14), dark),
    ]


def _paper_basket(random: Random, r: float, tall_m: float, skin: Material) -> list[Part]:
    mesh = Material(skin.color, str(random.choice(["grille", "plain"])), darker(skin.color, 0.45), 0.03)
    shell = [(0, 0), (r * 0.75, 0), (r, tall_m), (r * 0.96, tall_m), (r * 0.73, tall_m * 0.06), (0, tall_m * 0.06)]
    rim = turned(hoop((0, 0, 0), r, tall_m * 0.018, Material((30, 29, 30))), np.pi / 2, "x")
    parts = [lathe(shell, mesh), moved(rim, (0, 0, tall_m))]
    paper = Material((232, 230, 224), "noise", (200, 198, 190), 0.04)
    for k in range(int(random.integers(1, 4))):
        at = (0.35 * r * float(np.cos(2.2 * k)), 0.35 * r * float(np.sin(2.2 * k)), tall_m * 0.78)
        parts.append(ellipsoid(at, (0.4 * r, 0.36 * r, 0.34 * r), paper, sides=5))
    return parts


def _swing_bin(random: Random, r: float, tall_m: float, skin: Material) -> list[Part]:
    """Square: a lathe of four sides, turned so that they face the axes."""
    lid, dark = Material(darker(skin.color, float(random.uniform(0.5, 0.7))), gloss=0.4), Material((30, 29, 30))
    s, wide = r * 0.95, r * 1.39
    hull = [(0.0, 0.0), (1.07 * r, 0.0), (1.33 * r, 0.72 * tall_m), (0.0, 0.72 * tall_m)]
    roof = [(0.0, 0.7 * tall_m), (wide, 0.7 * tall_m), (wide, 0.78 * tall_m), (0.67 * r, tall_m), (0.0, tall_m)]
    flap = block((0, -0.78 * s, 0.84 * tall_m), (s, 0.02, 0.1 * tall_m), dark)
    return [
        turned(lathe(hull, skin, sides=4), np.pi / 4),
        turned(lathe(roof, lid, sides=4), np.pi / 4),
        turned(flap, -0.7, "x", (0, -0.78 * s, 0.88 * tall_m)),
    ]


def trash_can(random: Random, wanted: WantedSize) -> Item:
    """A pedal bin with a dome, an open paper basket of mesh, or a square bin with a swing lid."""
    build_parts, tall = (
        (_pedal_bin, _paper_basket, _swing_bin)[int(random.integers(3))],
        drawn(random, wanted.height_m, 0.28, 0.65),
    )
    name, color = pick(random, ("gray", "gray", "black", "white", "blue", "green", "red"))
    parts = build_parts(random, tall * float(random.uniform(0.27, 0.36)), tall, Material(color, gloss=0.6))
    return fitted("trash can", parts, (wanted.width_m, wanted.depth_m, tall), name)


DESIGNS = {
    "cup": cup, "bowl": bowl, "bottle": bottle, "book": book, "box": carton, "trash can": trash_can,
}  # fmt: skip
