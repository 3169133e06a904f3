"""Table lamps, floor lamps and ceiling lamps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from placegraph.tools.simulator.catalogue._item_assembly import Random, WantedSize, fitted
from placegraph.tools.simulator.color_palette import METALS, VIVID, WOODS, darker, jitter, pick
from placegraph.tools.simulator.house_model import Color, Item, Material, Part
from placegraph.tools.simulator.mesh_primitives import Point, block, cylinder, ellipsoid, lathe, moved, tube, turned

BULB = Material((255, 244, 214), glow=1.0)
SHADES = ("white", "white", "beige", "beige", "yellow", "orange", "red", "green", "blue", "gray", "pink")


def lamp(random: Random, wanted: WantedSize) -> Item:
    """A table lamp when a height below 0.8 m is asked for, a floor lamp when more is, either when none is."""
    table = random.random() < 0.45 if wanted.height_m is None else wanted.height_m < 0.8
    word, color = pick(random, SHADES)
    shade = _shade(random, color)
    metal = Material(pick(random, tuple(METALS), METALS)[1], gloss=0.6)
    wide, high = ((0.22, 0.34), (0.35, 0.6)) if table else ((0.32, 0.48), (1.35, 1.75))
    w, _, h = wanted.fill(random, wide, wide, high, always_draw=True)
    designs = (_vase_lamp, _bent_lamp, _mushroom_lamp) if table else (_pole_lamp, _tripod_lamp, _arc_lamp)
    choices = 3 if table or wanted.width_m is None or wanted.width_m > 0.6 else 2  # the bow needs room
    parts = designs[int(random.integers(choices))](random, w, h, shade, metal)
    return fitted("lamp", parts, wanted, word)


def _shade(random: Random, color: Color) -> Material:
    """A lampshade's cloth, lit from inside."""
    glow = float(random.uniform(0.45, 0.9))
    if random.random() < 0.3:
        return Material(color, "stripes", darker(color, 0.85), 0.04, glow=glow)
    return Material(color, "fabric", darker(color, 0.92), 0.1, int(random.integers(99)), glow=glow)


def _hood(x: float, z: float, radius: float, tall: float, shade: Material, top: float = 0.7) -> list[Part]:
    """A shade from z - tall up to z, open below and above, with the bulb in it."""
    rim = max(radius * 0.03, 0.004)
    wall = [(radius - rim, 0.0), (radius, 0.0), (radius * top, tall), (radius * top - rim, tall), (radius - rim, 0.0)]
    bulb = ellipsoid((x, 0, z - tall * 0.5), (0.035, 0.035, tall * 0.3), BULB, sides=6)
    return [lathe(wall, shade, (x, 0, z - tall), sides=14), bulb]


def _vase_lamp(random: Random, w: float, h: float, shade: Material, metal: Material) -> list[Part]:
    """A ceramic or turned wooden base under a cone or drum."""
    body = Material(pick(random, (*VIVID, "white", "black", "brown"))[1], gloss=0.5)
    if random.random() < 0.4:
        wood = pick(random, tuple(WOODS), WOODS)[1]
        body = Material(wood, "wood", darker(wood), 0.1)
    tall = h * float(random.uniform(0.36, 0.46))
    neck, belly = h - tall * 0.9, w * float(random.uniform(0.2, 0.34))
    foot = lathe([(0, 0), (belly * 0.75, 0), (belly * 0.6, 0.02), (belly, neck * 0.35), (belly * 0.8, neck * 0.62),
                  (0.015, neck * 0.85), (0, neck * 0.86)], body, sides=12)  # fmt: skip
    stem = cylinder((0, 0, neck * 0.8), 0.009, h - neck * 0.8 - tall * 0.4, metal, sides=6)
    return [foot, stem, *_hood(0, h, w / 2, tall, shade, float(random.uniform(0.5, 1.0)))]


def _bent_lamp(random: Random, w: float, h: float, shade: Material, metal: Material) -> list[Part]:
    """A jointed reading lamp: two arms and a metal cone that looks down."""
    paint = Material(shade.color, gloss=0.5)
    head = turned(lathe([(0.085, 0), (0.03, 0.1), (0.022, 0.15), (0, 0.15)], paint, sides=14), 0.5, "y")
    glow = turned(lathe([(0, 0.01), (0.075, 0.005), (0, 0.035)], BULB, sides=10), 0.5, "y")
    elbow, tip = (-w * 0.5, 0.0, h * 0.52), (w * 0.28, 0.0, h * 0.95)
    arms = [tube([(0, 0, 0.02), elbow], 0.008, metal, 6), tube([elbow, tip], 0.008, metal, 6)]
    place: Point = (tip[0] - 0.03, 0.0, tip[2] - 0.12)
    joints = [ellipsoid(at, (0.017, 0.017, 0.017), metal, 8) for at in (elbow, tip)]
    return [cylinder((0, 0, 0), 0.085, 0.022, paint, 0.075), *arms, *joints, moved(head, place), moved(glow, place)]


def _mushroom_lamp(random: Random, w: float, h: float, shade: Material, metal: Material) -> list[Part]:
    """A glowing dome or globe on a stout stem."""
    glass = replace(shade, texture="plain", glow=0.9)
    radius = min(w / 2, h * 0.45)
    stem = lathe([(0, 0), (w * 0.3, 0), (w * 0.28, 0.02), (0.02, 0.05), (0.02, h * 0.7), (0, h * 0.7)], metal, sides=14)
    collar = cylinder((0, 0, h * 0.5), 0.032, h * 0.12, metal, 0.045, 8)
    if random.random() < 0.5:
        return [stem, collar, ellipsoid((0, 0, h - radius), (radius, radius, radius), glass, 12)]
    dome = [(w / 2 * np.cos(t), h * 0.42 * np.sin(t)) for t in np.linspace(0, np.pi / 2, 6)[:-1]]
    return [stem, collar, lathe([(0, 0), *dome, (0, h * 0.42)], glass, (0, 0, h * 0.58), 14)]


def _pole_lamp(random: Random, w: float, h: float, shade: Material, metal: Material) -> list[Part]:
    """A round foot, a straight pole, a drum or cone."""
    tall = float(random.uniform(0.2, 0.36))
    foot = cylinder((0, 0, 0), w * float(random.uniform(0.3, 0.4)), 0.025, metal)
    return [
        foot,
        cylinder((0, 0, 0.02), 0.014, h - 0.02 - tall * 0.3, metal, sides=8),
        *_hood(0, h, w / 2, tall, shade, float(random.uniform(0.45, 1.0))),
    ]


def _tripod_lamp(random: Random, w: float, h: float, shade: Material, metal: Material) -> list[Part]:
    """Three spread wooden legs under a wide drum."""
    wood = pick(random, tuple(WOODS), WOODS)[1]
    legs_of = Material(wood, "wood", darker(wood), 0.2)
    tall, spread = float(random.uniform(0.22, 0.3)), w * float(random.uniform(0.42, 0.55))
    knot = h - tall - 0.03
    legs = []
    for angle in (-np.pi / 2, np.pi / 6, np.pi * 5 / 6):
        way = np.array([np.cos(angle), np.sin(angle)])
        (x0, y0), (x1, y1) = (way * spread).tolist(), (way * 0.03).tolist()
        legs.append(tube([(x0, y0, 0), (x1, y1, knot)], 0.015, legs_of, 6))
    hub = cylinder((0, 0, knot - 0.05), 0.045, 0.06, metal, sides=10)
    stem = cylinder((0, 0, knot), 0.012, tall * 0.6, metal, sides=6)
    return [*legs, hub, stem, *_hood(0, h, w / 2, tall, shade, float(random.uniform(0.75, 1.0)))]


def _arc_lamp(random: Random, w: float, h: float, shade: Material, metal: Material) -> list[Part]:
    """A long bow from a heavy foot, its dome hanging at the far end."""
    reach = max(w, 0.55) * float(random.uniform(0.9, 1.2))
    turns = np.linspace(np.pi, 0.15 * np.pi, 9)
    bow: list[Point] = [(float(reach / 2 * np.cos(t)), 0.0, float(h * (0.7 + 0.29 * np.sin(t)))) for t in turns]
    x, _, z = bow[-1]
    radius = float(random.uniform(0.13, 0.18))
    curve = [(radius, 0.0), (radius * 0.85, 0.07), (radius * 0.4, 0.13), (0.0, 0.14)]
    dome = lathe(curve, replace(shade, glow=0.35), sides=16)
    light = ellipsoid((x, 0, z - 0.14), (radius * 0.6, radius * 0.6, 0.05), BULB, 10)
    foot = block((-reach / 2, 0, 0), (0.24, 0.24, 0.05), Material(jitter((120, 120, 122), random), "marble", gloss=0.4))
    return [foot, tube([(-reach / 2, 0, 0.04), *bow], 0.013, metal, 6), moved(dome, (x, 0, z - 0.14)), light]


def ceiling_lamp(random: Random, wanted: WantedSize) -> Item:
    """A lamp below a ceiling, whose top is the ceiling's point; flat against it when under 0.25 m high is asked for."""
    flat = random.random() < 0.3 if wanted.height_m is None else wanted.height_m < 0.25
    word, color = pick(random, SHADES)
    shade = _shade(random, color)
    wide, high = (0.3, 0.5), (0.1, 0.17) if flat else (0.5, 0.95)
    w, d, h = wanted.fill(random, wide, wide, high, always_draw=True)
    if wanted.depth_m is None:
        d = w  # round, unless a depth is asked for
    metal = Material(pick(random, tuple(METALS), METALS)[1], gloss=0.6)
    if flat:
        return fitted("ceiling lamp", _flat_parts(random, w, h, shade, metal), (w, d, h), word)
    designs = (_pendant_parts, _globe_parts, _chandelier_parts)
    return fitted("ceiling lamp", designs[int(random.integers(3))](random, w, h, shade, metal), (w, d, h), word)


def _flat_parts(random: Random, w: float, h: float, shade: Material, metal: Material) -> list[Part]:
    """A drum or a bowl of milk glass held by a metal ring."""
    plate = cylinder((0, 0, h * 0.8), w * 0.5, h * 0.2, metal, sides=20)
    if random.random() < 0.5:
        band = cylinder((0, 0, h * 0.08), w * 0.47, h * 0.06, metal, sides=20)
        return [plate, band, cylinder((0, 0, 0), w * 0.46, h * 0.82, shade, sides=20)]
    glass = replace(shade, texture="plain", glow=0.9)
    stud = ellipsoid((0, 0, h * 0.05), (0.014, 0.014, h * 0.05), metal, 8)
    bowl = [(w * 0.46 * np.sin(t), h * (0.9 - 0.82 * np.cos(t))) for t in np.linspace(0, np.pi / 2, 7)[1:]]
    return [plate, lathe([(0, h * 0.08), *bowl], glass, sides=20), stud]


def _cord(h: float, z: float, metal: Material) -> list[Part]:
    """The rose at the ceiling and the cord down to z."""
    rose = cylinder((0, 0, h - 0.035), 0.055, 0.035, metal, 0.05, 12)
    return [rose, cylinder((0, 0, z), 0.007, h - z - 0.02, Material((40, 40, 42)), sides=6)]


def _pendant_parts(random: Random, w: float, h: float, shade: Material, metal: Material) -> list[Part]:
    """A bell, a cone or a drum on a cord."""
    tall = min(h * 0.6, w * float(random.uniform(0.4, 0.8)))
    kind = int(random.integers(3))
    if kind == 0:
        return [*_cord(h, tall * 0.6, metal), *_hood(0, tall, w / 2, tall, shade, float(random.uniform(0.8, 1.0)))]
    bell = (
        [(1.0, 0.0), (0.93, 0.3), (0.7, 0.65), (0.3, 0.9), (0.0, 1.0)]
        if kind == 1
        else [(1.0, 0.0), (0.12, 1.0), (0.0, 1.0)]
    )
    paint = replace(shade, texture="plain", glow=shade.glow * 0.5, gloss=0.4)
    hood = lathe([(r * w / 2, z * tall) for r, z in bell], paint, sides=20)
    light = lathe([(0, 0.0), (w * 0.46, 0.004), (0, 0.03)], BULB, sides=16)
    return [*_cord(h, tall * 0.95, metal), hood, light]


def _globe_parts(random: Random, w: float, h: float, shade: Material, metal: Material) -> list[Part]:
    """One paper globe, or three glass balls at different heights."""
    glass = replace(shade, texture="stripes", second=darker(shade.color, 0.9), scale_m=0.05, glow=0.85)
    if random.random() < 0.5:
        radius = min(w / 2, h * 0.4)
        return [*_cord(h, radius * 1.9, metal), ellipsoid((0, 0, radius), (w / 2, w / 2, radius), glass, 18)]
    ball = replace(glass, texture="plain")
    parts = [cylinder((0, 0, h - 0.03), w * 0.3, 0.03, metal)]
    for k, drop in enumerate((h, h * float(random.uniform(0.6, 0.75)), h * float(random.uniform(0.75, 0.9)))):
        radius, angle = min(w * 0.24, h * 0.2), 2 * np.pi * k / 3 + 0.4
        x, y, z = float(w * 0.26 * np.cos(angle)), float(w * 0.26 * np.sin(angle)), h - drop + radius
        parts.append(tube([(x, y, z), (x * 0.7, y * 0.7, h - 0.02)], 0.005, Material((40, 40, 42)), 5))
        parts.append(ellipsoid((x, y, z), (radius, radius, radius), ball, 12))
    return parts


def _chandelier_parts(random: Random, w: float, h: float, shade: Material, metal: Material) -> list[Part]:
    """A ring of curved arms, each with a small shade or a bare bulb."""
    arms = int(random.integers(4, 7))
    hub = ellipsoid((0, 0, h * 0.18), (0.05, 0.05, h * 0.18), metal, 10)
    parts = [*_cord(h, h * 0.3, metal), hub]
    shaded = random.random() < 0.6
    for k in range(arms):
        c, s = float(np.cos(2 * np.pi * k / arms)), float(np.sin(2 * np.pi * k / arms))
        reach = w / 2 - 0.06
        bends: list[Point] = [(c * r * reach, s * r * reach, h * z) for r, z in ((0, 0.2), (0.6, 0.1), (1, 0.22))]
        x, y, z = bends[-1]
        parts.append(tube(bends, 0.009, metal, 5))
        if shaded:
            parts.append(cylinder((x, y, z), 0.06, 0.1, shade, 0.035, 10))
        else:
            parts.append(lathe([(0, 0), (0.022, 0.02), (0.028, 0.06), (0, 0.11)], BULB, (x, y, z), 8))
    return parts


DESIGNS = {"lamp": lamp, "ceiling lamp": ceiling_lamp}
