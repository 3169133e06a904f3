"""Tv, monitor, keyboard, laptop, printer and speaker."""

from __future__ import annotations

import numpy as np

from placegraph.tools.simulator.catalogue._appliance_parts import knob
from placegraph.tools.simulator.catalogue._cabinet_parts import finish, metal
from placegraph.tools.simulator.catalogue._item_assembly import Random, WantedSize, assembled, drawn
from placegraph.tools.simulator.color_palette import COLORS, darker, jitter, pick
from placegraph.tools.simulator.house_model import Color, Item, Material, Part
from placegraph.tools.simulator.mesh_primitives import block, box, cylinder, extrude, lathe, quads

_BLACK = Material((24, 24, 27), gloss=0.4)
_PAPER = Material((244, 243, 238))


def _case(random: Random, names: tuple[str, ...] = ("black", "black", "gray", "white")) -> tuple[str, Material]:
    """Plastic of a device: its word and material."""
    name, color = pick(random, names)
    return name, Material(color, gloss=0.3)


def _picture(random: Random, dark: float) -> Material:
    """A screen that is dark with a probability, or else shines."""
    if random.random() < dark:
        return Material(jitter((26, 28, 34), random, 4), gloss=0.8)
    colors = (
        pick(random, ("blue", "green", "white", "purple", "orange", "red"))[1],
        pick(random, ("white", "blue", "gray"))[1],
    )
    return Material(colors[0], "screen", colors[1], 0.0, int(random.integers(100000)), gloss=0.2, glow=0.75)


def tv(random: Random, wanted: WantedSize) -> Item:
    """A wide thin screen: on two feet, on a plate, or flat for a wall (every one with a depth below 0.12 m)."""
    style = str(random.choice(["feet", "plate", "flat"]))
    if wanted.depth_m is not None and (wanted.depth_m < 0.12) != (style == "flat"):
        style = "flat" if wanted.depth_m < 0.12 else "feet"
    w = drawn(random, wanted.width_m, 0.85, 1.5)
    d = drawn(random, wanted.depth_m, *((0.04, 0.07) if style == "flat" else (0.2, 0.28)))
    h = drawn(random, wanted.height_m, *((0.565 * w, 0.585 * w) if style == "flat" else (0.62 * w, 0.66 * w)))
    name, case = "black", Material(jitter((30, 30, 33), random, 5), gloss=0.4)
    foot = 0.0 if style == "flat" else 0.08 * h
    thick, edge = min(d, 0.05), 0.012
    parts = [box((-w / 2, -thick / 2, foot), (w / 2, thick / 2, h), case)]
    screen = _picture(random, 0.6)
    parts.append(
        box((edge - w / 2, -thick / 2 - 0.001, foot + 0.02), (w / 2 - edge, -thick / 2 + 0.01, h - edge), screen)
    )
    metals = metal(random) if random.random() < 0.4 else case
    if style == "feet":
        for x in (-0.36 * w, 0.36 * w):
            parts.append(
                extrude(
                    [(x - 0.012, -d / 2), (x + 0.012, -d / 2), (x + 0.012, d / 2), (x - 0.012, d / 2)], 0, 0.015, metals
                )
            )
            parts.append(box((x - 0.012, -0.03, 0), (x + 0.012, 0.03, foot + 0.02), metals))
    elif style == "plate":
        parts += [
            box((-0.22 * w, -d / 2, 0), (0.22 * w, d / 2, 0.015), metals),
            box((-0.05, -0.015, 0), (0.05, 0.02, foot + 0.05), metals),
        ]
    if style != "flat":
        parts.append(box((-0.3 * w, thick / 2, foot + 0.1 * h), (0.3 * w, min(thick / 2 + 0.03, d / 2), 0.6 * h), case))
    parts.append(block((0, -thick / 2 - 0.001, foot + 0.005), (0.05, 0.004, 0.008), Material((150, 150, 155))))
    return assembled("tv", parts, (w, d, h), name)


def monitor(random: Random, wanted: WantedSize) -> Item:
    """A screen on a tall neck: on a round foot, a V-shaped foot, or an all-in-one with a chin."""
    style = str(random.choice(["round", "plate", "chin"]))
    w, d, h = wanted.fill(random, (0.48, 0.64), (0.17, 0.23), (0.42, 0.52))
    name, case = _case(random, ("black", "black", "gray", "white"))
    edge, chin = float(random.uniform(0.012, 0.022)), 0.2 * h if style == "chin" else 0.03
    low = 0.27 * h if style != "chin" else 0.2 * h
    parts = [box((-w / 2, -0.04, low), (w / 2, -0.012, h), case)]
    parts.append(box((edge - w / 2, -0.042, low + chin), (w / 2 - edge, -0.03, h - edge), _picture(random, 0.3)))
    parts.append(box((-0.15, -0.012, low + 0.05), (0.15, 0.02, h - 0.08), case))
    foot = metal(random) if style == "chin" else case
    parts.append(box((-0.03, 0.0, 0.012), (0.03, 0.03, low + 0.15), foot))
    if style == "round":
        base = lathe([(0, 0), (0.5, 0), (0.48, 0.015), (0, 0.02)], foot, sides=24)
        parts.append(Part(base.vertices * (1.2 * d, d, 1), base.faces, foot))
    else:
        parts.append(box((-0.36 * w, -d / 2, 0), (0.36 * w, d / 2, 0.014), foot))
    if style == "chin":
        parts.append(knob(0, -0.04, low + chin / 2, 0.018, 0.002, _BLACK, 10))
    return assembled("monitor", parts, (w, d, h), name)


def _keys(random: Random, x0: float, x1: float, y0: float, y1: float, z: float, caps: Color, rows: int) -> list[Part]:
    """Rows of key tops at height z, the lowest with a space bar; y grows to the back."""
    tops: list[tuple[float, float, float, float]] = []
    pitch = (y1 - y0) / rows
    for row in range(rows):
        y, count = y0 + row * pitch, 13 if row < rows - 1 else 12
        share = [1.4, 1, 1, 5.2, 1, 1, 1, 1.4] if row == 0 else [1.3] + [1.0] * (count - 2) + [1.5]
        edges = x0 + np.concatenate(([0.0], np.cumsum(share))) / sum(share) * (x1 - x0)
        tops += [
            (a + 0.0012, b - 0.0012, y, y + 0.86 * pitch)
            for a, b in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True)
        ]
    accent = Material(pick(random, ("orange", "red", "gray", "blue"))[1]) if random.random() < 0.4 else None
    special = [k for k, top in enumerate(tops) if top[0] < x0 + 0.01 or top[1] > x1 - 0.01]
    plain = [top for k, top in enumerate(tops) if accent is None or k not in special]
    parts = [_tops(plain, z, Material(caps, gloss=0.1))]
    return parts if accent is None else [*parts, _tops([tops[k] for k in special], z, accent)]


def _tops(rectangles: list[tuple[float, float, float, float]], z: float, material: Material) -> Part:
    """Level rectangles (x0, x1, y0, y1) at height z that face up, as one part."""
    return quads([((a, c, z), (b, c, z), (b, d, z), (a, d, z)) for a, b, c, d in rectangles], material)


def keyboard(random: Random, wanted: WantedSize) -> Item:
    """A flat wedge with five or six rows of keys, some with a number block."""
    w, d, h = wanted.fill(random, (0.36, 0.46), (0.125, 0.165), (0.022, 0.036))
    name, case = _case(random)
    caps = jitter(darker(case.color, 0.6) if name in ("white", "gray") and random.random() < 0.5 else
                  (COLORS["white"] if name != "black" else (74, 74, 80)), random, 5)  # fmt: skip
    parts = [block((0, 0, 0), (w, d, h - 0.006), case)]
    x1 = w / 2 - 0.012 if w < 0.4 else 0.5 * w - 0.012 - 0.2 * w
    parts += _keys(random, 0.012 - w / 2, x1, 0.012 - d / 2, d / 2 - 0.016, h, caps, 5)
    if w >= 0.4:
        xs, ys = np.linspace(x1 + 0.012, w / 2 - 0.012, 5), np.linspace(0.012 - d / 2, d / 2 - 0.016, 6)
        pad = [(a + 0.001, a + 0.9 * (xs[1] - xs[0]), b, b + 0.86 * (ys[1] - ys[0])) for a in xs[:-1] for b in ys[:-1]]
        parts.append(_tops(pad, h, Material(caps, gloss=0.1)))
    rim = Material(darker(case.color, 0.7), gloss=0.3)
    parts.append(box((0.006 - w / 2, 0.006 - d / 2, h - 0.008), (w / 2 - 0.006, d / 2 - 0.01, h - 0.0055), rim))
    return assembled("keyboard", parts, (w, d, h), name)


def laptop(random: Random, wanted: WantedSize) -> Item:
    """An open laptop: a slab with keys and touch pad, and a screen that leans back behind its hinge."""
    w, d, h = wanted.fill(random, (0.31, 0.38), (0.27, 0.33), (0.2, 0.25))
    name, case = _case(random, ("gray", "gray", "black", "white", "blue"))
    base, lean = 0.75 * d, 0.25 * d
    y0, hinge = -d / 2, d / 2 - lean
    parts = [box((-w / 2, y0, 0), (w / 2, hinge, 0.018), case)]
    caps = (36, 36, 40) if name != "black" else (84, 84, 90)
    middle = y0 + 0.45 * base
    parts += _keys(random, 0.025 - w / 2, w / 2 - 0.025, middle, hinge - 0.03, 0.0195, caps, 5)
    pad = Material(darker(case.color, 0.8), gloss=0.3)
    parts.append(box((-0.16 * w, y0 + 0.06 * base, 0.018), (0.16 * w, middle - 0.015, 0.019), pad))
    lid = [box((-w / 2, 0, 0), (w / 2, 0.008, 1), case),
           box((0.01 - w / 2, -0.001, 0.06), (w / 2 - 0.01, 0.004, 0.96), _BLACK),
           box((0.014 - w / 2, -0.002, 0.075), (w / 2 - 0.014, 0.003, 0.94), _picture(random, 0.25))]  # fmt: skip
    for part in lid:  # from the hinge up to the full height, leaning back to the full depth
        x, y, z = part.vertices.T
        vertices = np.stack((x, hinge + y + z * (lean - 0.008), 0.016 + z * (h - 0.016)), axis=1)
        parts.append(Part(vertices, part.faces, part.material))
    return assembled("laptop", parts, (w, d, h), name)


def printer(random: Random, wanted: WantedSize) -> Item:
    """A box that prints: flat with a scanner lid, with paper standing behind, or a tall one with paper drawers."""
    style = str(random.choice(["scanner", "feeder", "laser"]))
    w, d, h = wanted.fill(random, (0.38, 0.48), (0.36, 0.46), (0.3, 0.4) if style != "scanner" else (0.17, 0.25))
    name, case = _case(random, ("white", "gray", "black", "white"))
    dark = Material(darker(case.color, 0.45), gloss=0.2)
    tray, top = 0.22 * d, h if style != "feeder" else 0.62 * h
    y = tray - d / 2  # the front of the body; paper comes out in front of it
    lip = 0.55 * top
    band = top - 0.035 - lip  # the strip of buttons above the slot
    parts = [
        box((-w / 2, y, 0), (w / 2, d / 2, 0.3 * top), case),
        box((-w / 2, y + 0.06, 0.3 * top), (w / 2, d / 2, lip), dark),
    ]
    parts.append(box((-w / 2, y, lip), (w / 2, d / 2, top - 0.035), case))
    parts += [box((a, y, 0.3 * top), (a + 0.05, y + 0.07, lip), case) for a in (-w / 2, w / 2 - 0.05)]
    parts.append(box((-w / 2, y + 0.004, top - 0.032), (w / 2, d / 2, top), dark if random.random() < 0.5 else case))
    z = 0.3 * top
    parts.append(box((-0.3 * w, -d / 2, z), (0.3 * w, y + 0.06, z + 0.008), dark))
    parts.append(box((-0.24 * w, 0.01 - d / 2, z + 0.008), (0.24 * w, y + 0.06, z + 0.016), _PAPER))
    screen = Material((70, 120, 180), "screen", (200, 220, 240), 0.0, int(random.integers(1000)), glow=0.6)
    parts.append(box((0.1 * w, y - 0.006, lip + 0.25 * band), (0.28 * w, y, lip + 0.8 * band), screen))
    parts += [knob(w * a, y, lip + band / 2, 0.009, 0.005, m, 8)
              for a, m in ((0.34, Material((60, 170, 90), glow=0.3)), (0.4, dark))]  # fmt: skip
    if style == "feeder":
        z = top - 0.02
        sheets = box((-0.26 * w, 0, z), (0.26 * w, 0.015, h), _PAPER)
        holder = box((-0.33 * w, 0.015, z), (0.33 * w, 0.025, h - 0.05), dark)
        for part in (sheets, holder):
            shift = (part.vertices[:, 2:] - z) / (h - z) * (0.12 * d) + d / 2 - 0.12 * d - 0.025
            parts.append(Part(part.vertices + shift * np.array([[0, 1.0, 0]]), part.faces, part.material))
    if style == "laser":
        parts += [box((-0.46 * w, y - 0.004, z * top), (0.46 * w, y, (z + 0.12) * top), dark) for z in (0.02, 0.16)]
    return assembled("printer", parts, (w, d, h), name)


def _cylinder_of_cloth(random: Random, w: float, d: float, h: float) -> tuple[str, list[Part]]:
    """A smart speaker: cloth between two rims, with a ring of light on top; its colour word and parts."""
    name, color = pick(random, ("black", "gray", "white", "blue", "red"))
    cloth = Material(color, "grille", darker(color, 0.6), 0.02)
    rim = Material(darker(color, 0.5), gloss=0.4)
    parts = [
        cylinder((0, 0, 0), 0.48, 0.02, rim),
        cylinder((0, 0, 0.02), 0.5, h - 0.04, cloth),
        cylinder((0, 0, h - 0.02), 0.48, 0.02, rim),
        lathe([(0.34, h), (0.3, h + 0.001)], Material((120, 190, 230), glow=0.9)),
    ]
    return name, [Part(part.vertices * (w, d, 1), part.faces, part.material) for part in parts]


def speaker(random: Random, wanted: WantedSize) -> Item:
    """A loudspeaker: a tall or small box with round cones, or a cylinder of cloth."""
    style = str(random.choice(["small", "tall", "round"]))
    if wanted.height_m is not None:
        style = "tall" if wanted.height_m > 0.6 else ("small" if style == "tall" else style)
    w = drawn(random, wanted.width_m, *{"small": (0.15, 0.2), "tall": (0.18, 0.26), "round": (0.1, 0.16)}[style])
    d = drawn(random, wanted.depth_m, *((w, w) if style == "round" else (1.0 * w, 1.3 * w)))
    h = drawn(random, wanted.height_m, *{"small": (0.25, 0.36), "tall": (0.85, 1.15), "round": (0.14, 0.28)}[style])
    if style == "round":
        name, parts = _cylinder_of_cloth(random, w, d, h)
        return assembled("speaker", parts, (w, d, h), name)
    name, body = finish(random, 0.0) if random.random() < 0.5 else _case(random)
    cone, rim = Material((48, 48, 52)), Material((140, 142, 146), gloss=0.5)
    front, foot = 0.012 - d / 2, 0.02 if style == "tall" else 0.0
    parts = [box((-0.47 * w, front, foot), (0.47 * w, d / 2, h - 0.003), body)]
    if style == "tall":
        parts.append(box((-w / 2, -d / 2, 0), (w / 2, d / 2, 0.02), _BLACK))
    else:
        baffle = Material(darker(body.color, 0.5))
        parts.append(box((-w / 2, front - 0.002, 0.0), (w / 2, front + 0.03, h), baffle))
    spots = (
        [(0.3 * h, 0.4), (0.74 * h, 0.2)]
        if style == "small"
        else [(h - a * w, b) for a, b in ((0.4, 0.16), (1.0, 0.38), (1.9, 0.38))]
    )
    for z, share in spots:
        r = share * w
        parts.append(knob(0, front, z, r, 0.008, rim, 12))
        parts.append(knob(0, front, z, 0.86 * r, 0.010, cone, 12))
        parts.append(knob(0, front, z, 0.35 * r, 0.012, Material((88, 88, 92)), 8))
    return assembled("speaker", parts, (w, d, h), name)


DESIGNS = {
    "tv": tv, "monitor": monitor, "keyboard": keyboard, "laptop": laptop, "printer": printer, "speaker": speaker,
}  # fmt: skip
