"""Chair, armchair, office chair, stool, bench and sofa."""

from __future__ import annotations

import numpy as np

from placegraph.tools.simulator.catalogue._cabinet_parts import finish, metal, wood
from placegraph.tools.simulator.catalogue._item_assembly import Random, WantedSize, assembled, drawn, loft
from placegraph.tools.simulator.catalogue._upholstery import cloth, cushion, leaned, legs, upholstered
from placegraph.tools.simulator.color_palette import darker
from placegraph.tools.simulator.house_model import Item, Material, Part, SupportSurface
from placegraph.tools.simulator.mesh_primitives import box, cylinder, lathe, moved, tube, turned


def _chair_back(style: str, w: float, y: float, z0: float, z1: float, frame: Material, pad: Material) -> list[Part]:
    """The upright back of a chair around the plane y, from z0 to z1."""
    t, x = 0.018, w / 2 - 0.02
    posts = [box((a * x - 0.02, y - 0.02, z0), (a * x + 0.02, y + 0.02, z1), frame) for a in (-1, 1)]
    inner = x - 0.02
    if style == "slats":
        bars = [box((-x, y - t, z1 - 0.09), (x, y + t, z1), frame)]
        across = np.linspace(-inner, inner, 6).tolist()[1:-1]
        return posts + bars + [box((a - 0.016, y - 0.01, z0), (a + 0.016, y + 0.01, z1 - 0.08), frame) for a in across]
    if style == "ladder":
        levels = np.linspace(z0 + 0.12, z1 - 0.07, 3).tolist()
        return posts + [box((-x, y - t, z), (x, y + t, z + 0.07), frame) for z in levels]
    if style == "pad":
        return [*posts, cushion((-inner, y - 0.03, z0 + 0.12), (inner, y + 0.02, z1), pad)]
    stays = [box((a * x - 0.02, y - 0.01, z0), (a * x + 0.02, y + 0.01, z0 + 0.1), frame) for a in (-0.6, 0.6)]
    return [*stays, box((-w / 2, y - 0.02, z0 + 0.08), (w / 2, y + 0.02, z1), frame)]


def chair(random: Random, wanted: WantedSize) -> Item:
    """A dining chair: slatted, ladder, solid or padded back on four straight, splayed or crossed legs."""
    w, d, h = wanted.fill(random, (0.4, 0.5), (0.46, 0.55), (0.82, 1.02))
    seat, lean = min(0.47, 0.52 * h), float(random.uniform(0.04, 0.08))
    name, frame = finish(random, 0.35)
    style = str(random.choice(["slats", "ladder", "solid", "pad"]))
    pad_name, pad = cloth(random)
    low = str(random.choice(["straight", "splayed", "crossed"]))
    deep, y_back = d - lean, d / 2 - lean  # the seat ends where the back begins to lean
    if low == "straight":
        under = legs(w - 0.01, deep, seat, 0.04, frame)
        under += [
            box((a, -deep / 2, seat * 0.4), (a + 0.02, deep / 2, seat * 0.4 + 0.03), frame)
            for a in (0.015 - w / 2, w / 2 - 0.035)
        ]
    elif low == "splayed":
        under = legs(w, deep, seat, 0.035, frame if random.random() < 0.5 else metal(random), 0.06)
    else:
        steel, x, y = metal(random), w / 2 - 0.03, deep / 2 - 0.02
        under = [
            tube([(a * x, b * y, 0.012), (a * x, -b * y, seat)], 0.012, steel, sides=6)
            for a in (-1, 1)
            for b in (-1, 1)
        ]
        under.append(box((-x, -0.012, seat / 2), (x, 0.012, seat / 2 + 0.02), steel))
    middle = -lean / 2
    parts = [moved(part, (0, middle, 0)) for part in under]
    parts.append(box((-w / 2, -d / 2, seat - 0.03), (w / 2, y_back, seat), frame))
    if style == "pad" or random.random() < 0.3:
        parts.append(
            cushion((0.02 - w / 2, -d / 2 + 0.01, seat), (w / 2 - 0.02, y_back - 0.05, seat + 0.045), pad, 0.02)
        )
        name = pad_name if style == "pad" else name
    parts += leaned(_chair_back(style, w, y_back - 0.02, seat, h, frame, pad), seat, h, lean)
    return assembled("chair", parts, (w, d, h), name)


def sofa(random: Random, wanted: WantedSize) -> Item:
    """A seat for two or three with block, rolled or slim arms, loose cushions and at times throw pillows."""
    w, d, h = wanted.fill(random, (1.45, 2.25), (0.82, 0.98), (0.76, 0.92))
    name, cover = cloth(
        random, ("gray", "beige", "brown", "blue", "green", "red", "black", "white", "yellow", "orange")
    )
    parts = upholstered(random, w, d, h, 2 if w < 1.8 else 3, cover)
    for side in (-1, 1):
        if random.random() < 0.5:
            pillow = cushion((-0.2, -0.06, 0), (0.2, 0.06, 0.36), cloth(random)[1], 0.06)
            x, y = side * (w / 2 - 0.45), d / 2 - 0.22 * d - 0.1
            parts.append(moved(turned(pillow, -0.25, "x"), (x, y, min(0.44, 0.55 * h))))
    return assembled("sofa", parts, (w, d, h), name)


def armchair(random: Random, wanted: WantedSize) -> Item:
    """A soft chair for one: upholstered all over, a wooden frame with cushions, or a round tub."""
    style = str(random.choice(["upholstered", "frame", "tub"]))
    w, d, h = wanted.fill(random, (0.68, 0.92), (0.72, 0.9), (0.78, 1.02))
    name, cover = cloth(random)
    if style == "upholstered":
        return assembled("armchair", upholstered(random, w, d, h, 1, cover), (w, d, h), name)
    seat, arm_top = min(0.42, 0.5 * h), min(0.6, 0.7 * h)
    if style == "frame":
        frame, x, lean = wood(random)[1], w / 2 - 0.035, 0.22 * d
        parts = [
            box((a * x - 0.03, y, 0), (a * x + 0.03, y + 0.05, arm_top), frame)
            for a in (-1, 1)
            for y in (-d / 2, d / 2 - lean)
        ]
        parts += [
            box((a * x - 0.035, -d / 2, arm_top - 0.03), (a * x + 0.035, d / 2 - 0.1, arm_top), frame) for a in (-1, 1)
        ]
        parts.append(box((-x, -d / 2 + 0.03, seat - 0.17), (x, d / 2 - lean, seat - 0.12), frame))
        parts.append(cushion((0.05 - x, -d / 2 + 0.02, seat - 0.12), (x - 0.05, d / 2 - lean - 0.02, seat), cover))
        back = cushion((0.05 - x, d / 2 - lean - 0.13, seat - 0.06), (x - 0.05, d / 2 - lean, h), cover, 0.05)
        return assembled("armchair", parts + leaned([back], seat - 0.06, h, lean), (w, d, h), name)
    return assembled("armchair", _tub(w, d, h, cover, wood(random)[1]), (w, d, h), name)


def _tub(w: float, d: float, h: float, cover: Material, leg: Material) -> list[Part]:
    """A round shell that is open in front, around a round seat, on four legs."""
    foot, seat, sides = 0.14, min(0.42, 0.5 * h), 14
    angles = np.linspace(-0.25 * np.pi, 1.25 * np.pi, sides)
    rings = []
    for a in angles:  # the shell is as high as the arms in front and rises to the back
        top = h - (h - min(0.6, 0.75 * h)) * (1 - max(0.0, float(np.sin(a)))) ** 0.7
        for share, z in ((0.78, foot), (0.86, top), (1.0, top), (0.9, foot)):
            rings.append((share * w / 2 * np.cos(a), share * d / 2 * np.sin(a), z))
    points = np.array(rings)
    points[:, 0] *= w / np.ptp(points[:, 0])
    shell = loft(points.reshape(sides, 4, 3), cover)
    pad = lathe([(0, foot), (0.82, foot), (0.88, seat - 0.05), (0.8, seat), (0, seat)], cover)
    front = -d / 2 - float(pad.vertices[:, 1].min()) * d / 2
    pad = Part(pad.vertices * (w / 2, d / 2, 1) + (0, front, 0), pad.faces, cover)
    return [*legs(0.6 * w, 0.6 * d, foot + 0.02, 0.035, leg), shell, pad]


def office_chair(random: Random, wanted: WantedSize) -> Item:
    """A swivel chair: five feet on castors, a gas spring, seat, arms, and a padded, mesh or high back."""
    w, d = drawn(random, wanted.width_m, 0.58, 0.68), drawn(random, wanted.depth_m, 0.58, 0.68)
    style = str(random.choice(["padded", "mesh", "high"]))
    h = drawn(random, wanted.height_m, *((1.12, 1.25) if style == "high" else (0.92, 1.08)))
    name, cover = cloth(random, ("black", "black", "gray", "blue", "red", "white", "green", "orange"))
    frame = Material((38, 38, 42), gloss=0.3) if random.random() < 0.7 else metal(random)
    seat, r = min(0.5, 0.5 * h), 0.46 * min(w, d)
    parts = [
        cylinder((0, 0, 0.09), 0.026, seat - 0.17, frame, sides=8),
        cylinder((0, 0, 0.06), 0.045, 0.08, frame, sides=8),
    ]
    for angle in np.arange(5) * 2 * np.pi / 5 + np.pi / 2:
        x, y = (r - 0.02) * np.cos(angle), (r - 0.02) * np.sin(angle)
        parts.append(tube([(0, 0, 0.11), (x, y, 0.065)], 0.02, frame, sides=6))
        wheel = moved(turned(cylinder((0, 0, -0.018), 0.028, 0.036, frame, sides=8), np.pi / 2, "x"), (0, 0, 0.028))
        parts.append(moved(turned(wheel, angle), (x, y, 0)))
    parts.append(cushion((-0.42 * w, -d / 2, seat - 0.08), (0.42 * w, d / 2 - 0.12, seat), cover, 0.05))
    for side in (-1, 1):
        x = side * (w / 2 - 0.03)
        parts.append(tube([(x * 0.8, 0.03, seat - 0.06), (x, 0.03, seat - 0.03)], 0.015, frame, sides=6))
        parts.append(box((x - 0.014, 0.012, seat - 0.045), (x + 0.014, 0.048, seat + 0.18), frame))
        parts.append(box((x - 0.03, -0.13, seat + 0.18), (x + 0.03, 0.13, seat + 0.21), frame))
    z, lean = seat + (0.02 if style == "high" else 0.12), 0.06
    y = d / 2 - lean
    material = cover
    if style == "mesh":
        material = Material(cover.color, "grille", darker(cover.color, 0.6), 0.03, gloss=0.1)
    back = [cushion((-0.38 * w, y - 0.07, z), (0.38 * w, y, h), material, 0.03 if style == "mesh" else 0.06)]
    back.append(box((-0.03, y - 0.02, seat - 0.06), (0.03, y + 0.015, z + 0.2), frame))
    parts.append(box((-0.03, 0, seat - 0.1), (0.03, y + 0.015, seat - 0.06), frame))
    return assembled("office chair", parts + leaned(back, seat, h, lean), (w, d, h), name)


def stool(random: Random, wanted: WantedSize) -> Item:
    """A seat without a back: three-legged, a bar stool with a foot rail, one on a column, or a soft footstool."""
    style = str(random.choice(["three legs", "bar", "column", "soft"]))
    if wanted.height_m is not None and (style == "soft") != (wanted.height_m < 0.38):
        style = "soft" if wanted.height_m < 0.38 else "bar"
    low, high = {"three legs": (0.42, 0.5), "bar": (0.62, 0.78), "column": (0.6, 0.8), "soft": (0.35, 0.45)}[style]
    w = drawn(random, wanted.width_m, *((0.4, 0.6) if style == "soft" else (0.33, 0.42)))
    d, h = drawn(random, wanted.depth_m, 0.95 * w, 1.05 * w), drawn(random, wanted.height_m, low, high)
    wood_name, frame = finish(random, 0.3)
    name, cover = cloth(random)
    if style == "soft":
        parts = [
            *legs(w - 0.06, d - 0.06, 0.12, 0.04, frame, 0.02),
            cushion((-w / 2, -d / 2, 0.12), (w / 2, d / 2, h), cover, 0.06),
        ]
        return assembled("stool", parts, (w, d, h), name)
    if style == "three legs":
        top = _flattened(cylinder((0, 0, h - 0.035), 0.5, 0.035, frame, sides=24), w, d)
        feet = [(0.44 * w * np.cos(a), 0.44 * d * np.sin(a)) for a in np.arange(3) * 2 * np.pi / 3 + np.pi / 6]
        parts = [top] + [tube([(x, y, 0.008), (0.5 * x, 0.5 * y, h - 0.03)], 0.017, frame, sides=6) for x, y in feet]
        parts += [tube([(0.8 * a[0], 0.8 * a[1], 0.4 * h), (0.8 * b[0], 0.8 * b[1], 0.4 * h)], 0.01, frame, sides=6)
                  for a, b in zip(feet, feet[1:] + feet[:1], strict=True)]  # fmt: skip
        return assembled("stool", parts, (w, d, h), wood_name)
    if style == "bar":
        parts = legs(w, d, h - 0.04, 0.034, frame, 0.05)
        s, z = 0.97, 0.35 * h
        x, y = (w / 2 - 0.035) * s, (d / 2 - 0.035) * s
        parts += [box((-x, b * y - 0.01, z), (x, b * y + 0.01, z + 0.02), frame) for b in (-1, 1)]
        parts += [box((a * x - 0.01, -y, z + 0.06), (a * x + 0.01, y, z + 0.08), frame) for a in (-1, 1)]
        parts.append(cushion((0.02 - w / 2, 0.02 - d / 2, h - 0.05), (w / 2 - 0.02, d / 2 - 0.02, h), cover, 0.025))
        return assembled("stool", parts, (w, d, h), wood_name)
    steel, ring = metal(random), 0.3 * min(w, d)
    angles = np.linspace(0, 2 * np.pi, 13).tolist()
    parts = [_flattened(lathe([(0, 0), (0.5, 0), (0.47, 0.02), (0.08, 0.035), (0, 0.035)], steel), w, d)]
    parts.append(cylinder((0, 0, 0.03), 0.028, h - 0.1, steel, sides=10))
    parts.append(tube([(ring * np.cos(a), ring * np.sin(a), 0.4 * h) for a in angles], 0.01, steel, sides=5))
    parts.append(box((-ring, -0.008, 0.4 * h - 0.008), (ring, 0.008, 0.4 * h + 0.008), steel))
    parts.append(_flattened(lathe([(0, h - 0.08), (0.44, h - 0.08), (0.5, h - 0.05), (0.48, h), (0, h)], cover), w, d))
    return assembled("stool", parts, (w, d, h), name)


def _flattened(part: Part, w: float, d: float) -> Part:
    """Stretches a round part of diameter 1 m to w by d."""
    return Part(part.vertices * np.array([w, d, 1.0]), part.faces, part.material)


def bench(random: Random, wanted: WantedSize) -> Item:
    """A long seat: a plain board on legs, one with a slatted back, or a padded one above a shoe shelf."""
    style = str(random.choice(["plain", "back", "padded"]))
    if wanted.height_m is not None:
        style = "back" if wanted.height_m > 0.62 else ("plain" if style == "back" else style)
    deep, high = ((0.42, 0.5), (0.8, 0.92)) if style == "back" else ((0.32, 0.4), (0.42, 0.48))
    w, d, h = wanted.fill(random, (0.95, 1.5), deep, high)
    name, frame = wood(random)
    seat = 0.45 if style == "back" else h
    if style == "padded":
        parts = [box((x, -d / 2, 0), (x + 0.03, d / 2, h - 0.07), frame) for x in (-w / 2, w / 2 - 0.03)]
        parts += [box((-w / 2, -d / 2, z), (w / 2, d / 2, z + 0.025), frame) for z in (0.12, h - 0.09)]
        parts.append(cushion((-w / 2, -d / 2, h - 0.065), (w / 2, d / 2, h), cloth(random)[1], 0.025))
        shelf = SupportSurface(0.05 - w / 2, 0.02 - d / 2, w / 2 - 0.05, d / 2 - 0.02, 0.145, h - 0.26)
        return assembled("bench", parts, (w, d, h), name, [shelf])
    parts = legs(w - 0.1, d - 0.02, seat - 0.02, 0.06, frame)
    wide = d / 3 - 0.012
    parts += [box((-w / 2, y, seat - 0.03), (w / 2, y + wide, seat), frame)
              for y in (-d / 2, -wide / 2, d / 2 - wide)]  # fmt: skip
    parts.append(box((0.1 - w / 2, -0.02, seat * 0.3), (w / 2 - 0.1, 0.02, seat * 0.3 + 0.05), frame))
    x, y = w / 2 - 0.02, d / 2 - 0.02
    if style == "back":
        parts += _bench_back(w, d, seat, h, frame)
        x, y = w / 2 - 0.12, d / 2 - 0.07
    return assembled("bench", parts, (w, d, h), name, [SupportSurface(-x, 0.02 - d / 2, x, y, seat, 1.0)])


def _bench_back(w: float, d: float, seat: float, h: float, frame: Material) -> list[Part]:
    """Two posts with three boards, and an arm rest on either side."""
    y, parts = d / 2 - 0.04, []
    for x in (-w / 2 + 0.08, w / 2 - 0.08):
        parts.append(box((x - 0.03, y, seat), (x + 0.03, y + 0.04, h), frame))
        parts.append(box((x - 0.025, -d / 2 + 0.02, seat + 0.18), (x + 0.025, y, seat + 0.21), frame))
        parts.append(box((x - 0.02, -d / 2 + 0.03, seat), (x + 0.02, -d / 2 + 0.07, seat + 0.18), frame))
    levels = np.linspace(seat + 0.1, h - 0.08, 3).tolist()
    return parts + [box((-w / 2, y - 0.005, z), (w / 2, y + 0.02, z + 0.08), frame) for z in levels]


DESIGNS = {
    "chair": chair, "armchair": armchair, "office chair": office_chair, "stool": stool, "bench": bench, "sofa": sofa,
}  # fmt: skip
