"""What stands or hangs in a bathroom, and what the laundry needs."""

from __future__ import annotations

import numpy as np

from placegraph.tools.simulator.catalogue._appliance_parts import fronts, knob, molded, tap
from placegraph.tools.simulator.catalogue._item_assembly import Random, WantedSize, fitted, plate_xz
from placegraph.tools.simulator.catalogue._materials import DARK, GLASS, STEEL
from placegraph.tools.simulator.color_palette import COLORS, METALS, VIVID, WOODS, darker, jitter, pick
from placegraph.tools.simulator.house_model import Item, Material, Part, SupportSurface
from placegraph.tools.simulator.mesh_primitives import (
    Point,
    block,
    box,
    cylinder,
    ellipsoid,
    extrude,
    grid_faces,
    lathe,
    moved,
    tube,
    turned,
)

CERAMIC = Material((240, 240, 237), gloss=0.7)
WATER = Material((150, 186, 200), gloss=0.9)
PANE = Material((206, 226, 230), gloss=0.9)
CLOTHS = (*VIVID, *VIVID, "white", "white", "beige", "gray", "brown")


def washbasin(random: Random, w: float, d: float, h: float) -> Item:
    """A white basin (class sink) of w x d x h metres with its tap, on a pedestal or on a vanity with doors."""
    z = h - float(np.clip(h - 0.82, 0.07, 0.16))
    bowl = [(0, -0.17), (0.5, -0.17), (0.95, -0.04), (1.0, 0.0), (0.86, 0.0), (0.72, -0.08), (0.3, -0.12), (0, -0.125)]
    parts = [moved(molded(bowl, w, d, CERAMIC, float(random.choice((2.3, 3.0, 8.0)))), (0, 0, z))]
    parts.append(box((-w * 0.4, d * 0.32, z - 0.1), (w * 0.4, d / 2, z + 0.004), CERAMIC))
    parts += tap(d * 0.4, z, h - z, d * 0.36)
    parts.append(cylinder((0, 0, z - 0.125), 0.022, 0.004, DARK, sides=8))
    if random.random() < 0.5:
        column = [(0, 0), (1.2, 0), (0.85, 0.1), (0.8, z - 0.3), (1.2, z - 0.12), (0, z - 0.12)]
        parts.append(moved(molded(column, 0.18, 0.2, CERAMIC, 3), (0, d * 0.15, 0)))
        return fitted("sink", parts, (w, d, h), "white")
    word, doors = fronts(random, w * 0.9, -d * 0.4, 0.12, z - 0.13)
    carcass = Material(darker(doors[0].material.color, 0.7))
    parts += [*doors, box((-w * 0.45, -d * 0.4, 0.12), (w * 0.45, d / 2, z - 0.13), carcass)]
    parts += [block((x, y, 0), (0.03, 0.03, 0.13), STEEL) for x in (-w * 0.42, w * 0.42) for y in (-d * 0.35, d * 0.4)]
    return fitted("sink", parts, (w, d, h), word)


def toilet(random: Random, wanted: WantedSize) -> Item:
    """A bowl with a seat, its lid up or down, before a cistern or a wall panel with a flush plate."""
    w, d, h = wanted.fill(random, (0.36, 0.42), (0.62, 0.72), (0.74, 0.84), always_draw=True)
    lid_up, hung = random.random() < 0.5, random.random() < 0.35
    color = pick(random, ("white", "white", "brown", "black", "blue", "pink"))[1]
    seat = Material((234, 234, 230), gloss=0.6) if random.random() < 0.6 else Material(color, gloss=0.4)
    rim, long, back = h * 0.52, d * 0.72, d / 2 - d * 0.26
    foot = 0.14 if hung else 0.0
    bowl = [(0, foot), (0.6, foot), (0.55, rim * 0.45), (0.95, rim * 0.85), (1, rim)]
    bowl += [(0.7, rim), (0.5, rim * 0.7), (0, rim * 0.66)]
    middle: Point = (0, back - long / 2 + 0.02, 0)
    parts = [moved(molded(bowl, w, long, CERAMIC, 2.4), middle)]
    parts.append(moved(molded([(0, 0), (0.55, 0), (0, 0.002)], w, long, WATER, 2.4), (0, middle[1], rim * 0.7)))
    ring = [(0.72, 0), (1.02, 0), (1.0, 0.022), (0.68, 0.022), (0.72, 0)]
    parts.append(moved(molded(ring, w, long, seat, 2.4), (0, middle[1], rim)))
    cover = molded([(0, 0), (1.0, 0), (0.97, 0.025), (0, 0.03)], w * 0.98, long * 0.9, seat, 2.6)
    if lid_up:
        cover = moved(turned(cover, -np.pi / 2 - 0.1, "x"), (0, back - 0.06, rim + long * 0.45))
    parts.append(cover if lid_up else moved(cover, (0, middle[1], rim + 0.024)))
    parts.append(box((-w * 0.3, back - 0.1, foot), (w * 0.3, d / 2 - 0.02, rim - 0.02), CERAMIC))
    if hung:
        tiles = Material((226, 226, 222), "tiles", (200, 202, 202), 0.2)
        parts.append(box((-w / 2 - 0.04, d / 2 - 0.1, 0), (w / 2 + 0.04, d / 2, h), tiles))
        parts.append(box((-0.11, d / 2 - 0.106, h * 0.84), (0.11, d / 2 - 0.1, h * 0.96), STEEL))
    else:
        tank = [(0, rim - 0.02), (0.94, rim), (1, h - 0.05), (1, h - 0.012), (0, h - 0.012)]
        parts.append(moved(molded(tank, w, d * 0.26, CERAMIC, 6), (0, d * 0.37, 0)))
        parts.append(cylinder((0, d * 0.37, h - 0.012), 0.028, 0.012, STEEL, sides=10))
    return fitted("toilet", parts, (w, d, h), "white")


def bathtub(random: Random, wanted: WantedSize) -> Item:
    """A built-in tub behind a panel, an oval on claw feet, or a free-standing shell; tap at the right end."""
    kind = int(random.integers(3))
    w, d, h = wanted.fill(random, (1.5, 1.8), (0.7, 0.82), (0.66, 0.74), always_draw=True)
    z, corner = h - 0.14, (12.0, 2.6, 3.4)[kind]
    foot = 0.12 if kind == 1 else 0.0
    word, color = ("white", CERAMIC.color) if kind != 1 else pick(random, ("white", "red", "blue", "black", "green"))
    skin = Material(color, gloss=0.6)
    flank = [(0, foot), (0.7, foot), (0.92, foot + 0.12), (0.93, z - 0.03)] if kind else [(0, 0), (1, 0), (1, z - 0.04)]
    inner = [(0.88, z - 0.005), (0.78, 0.2 + foot), (0.6, 0.12 + foot), (0, 0.12 + foot)]
    parts = [molded([*flank, (1, z - 0.03)], w, d, skin, corner, 24)]
    parts.append(molded([(1, z - 0.03), (1, z), *inner], w, d, CERAMIC, corner, 24))
    if kind == 0 and random.random() < 0.5:
        tiles = Material((214, 222, 226), "tiles", (160, 168, 172), 0.15)
        parts.append(box((-w / 2, -d / 2 - 0.01, 0), (w / 2, -d / 2, z - 0.04), tiles))
    if random.random() < 0.4:
        parts.append(molded([(0, 0), (0.82, z * 0.62), (0, z * 0.62)], w, d, WATER, corner, 24))
    if kind == 1:
        corners = [(x, y, 0.07) for x in (-w * 0.3, w * 0.3) for y in (-d * 0.26, d * 0.26)]
        parts += [ellipsoid(at, (0.035, 0.035, 0.07), STEEL, 8) for at in corners]
    x = w * 0.46
    spout: list[Point] = [(x, 0, z - 0.02), (x, 0, z + 0.11), (x - 0.06, 0, z + 0.13), (x - 0.14, 0, z + 0.09)]
    parts.append(tube(spout, 0.016, STEEL, 7))
    parts += [cylinder((x, y, z - 0.01), 0.024, 0.07, STEEL, sides=8) for y in (-0.1, 0.1)]
    parts.append(cylinder((0, 0, 0.12 + foot), 0.035, 0.004, DARK, sides=8))
    return fitted("bathtub", parts, (w, d, h), word)


def shower(random: Random, wanted: WantedSize) -> Item:
    """A tray, thin metal frames without panes (a frosted band stands for the glass), and a pole with its head."""
    w, d, h = wanted.fill(random, (0.8, 1.0), (0.8, 0.95), (1.95, 2.15), always_draw=True)
    metal = Material(pick(random, tuple(METALS), METALS)[1], gloss=0.7)
    tray = [(0, 0), (1, 0), (1, 0.12), (0.9, 0.125), (0.86, 0.07), (0, 0.06)]
    parts = [molded(tray, w, d, CERAMIC, 12), cylinder((0, 0, 0.062), 0.05, 0.006, STEEL, sides=10)]
    x, y, thin = w / 2 - 0.015, d / 2 - 0.015, 0.03
    parts += [block((sx * x, sy * y, 0.1), (thin, thin, h - 0.1), metal) for sx in (-1, 1) for sy in (-1, 1)]
    parts += [block((0, s * y, h - thin), (w - thin, thin, thin), metal) for s in (-1, 1)]
    parts += [block((s * x, 0, h - thin), (thin, d - thin, thin), metal) for s in (-1, 1)]
    door = float(random.choice((-0.12, 0.0, 0.15))) * w
    parts.append(block((door, -y, 0.12), (thin, thin * 0.8, h - 0.14), metal))
    parts.append(box((door + 0.05, -y - 0.04, h * 0.45), (door + 0.07, -y - 0.015, h * 0.6), STEEL))
    bands = (0.45,) if random.random() < 0.5 else (0.3, 0.45, 0.6)
    for low in (h * share for share in bands):
        parts += [block((0, -y, low), (w - 0.05, 0.008, 0.07), PANE), block((x, 0, low), (0.008, d - 0.05, 0.07), PANE)]
    if random.random() < 0.5:
        tiles = pick(random, ("white", "gray", "blue", "green", "beige"))[1]
        wall = Material(tiles, "tiles", darker(tiles, 0.8), float(random.uniform(0.1, 0.3)))
        parts += [box((-x, y + 0.004, 0.12), (x, y + 0.012, h - 0.02), wall)]
    pole, top = y - 0.03, h * 0.93
    riser: list[Point] = [(0, pole, h * 0.5), (0, pole, top), (0, pole - 0.06, top + 0.04), (0, pole - 0.3, top + 0.02)]
    parts.append(tube(riser, 0.012, STEEL, 7))
    parts.append(cylinder((0, pole - 0.3, top - 0.03), 0.11, 0.05, STEEL, 0.03, 14))
    parts.append(block((0, pole - 0.01, h * 0.49), (0.26, 0.05, 0.05), STEEL))
    parts.append(tube([(0.1, pole, h * 0.5), (0.16, pole - 0.08, h * 0.3), (0.2, pole, h * 0.62)], 0.008, STEEL, 5))
    return fitted("shower", parts, (w, d, h), "")


def mirror(random: Random, wanted: WantedSize) -> Item:
    """A framed looking glass for a wall, square, arched or oval, its glass in bands from pale sky to darker gray."""
    w, d, h = wanted.fill(random, (0.4, 0.8), (0.025, 0.035), (0.55, 1.1), always_draw=True)
    word, color = pick(random, tuple(WOODS), WOODS)
    frame = Material(color, "wood", darker(color, 0.8), 0.2)
    if random.random() < 0.5:
        word, color = pick(random, ("gray", "black", "white", "yellow"), COLORS)
        frame = Material(color, gloss=0.5)
    corner, edge = float(random.choice((2.0, 2.0, 4.0, 30.0, 30.0))), float(random.uniform(0.015, 0.05))
    angles = np.linspace(0, 2 * np.pi, 20, endpoint=False) + np.pi / 20
    ring = np.stack((np.cos(angles), np.sin(angles)), axis=1)
    ring /= (np.abs(ring) ** corner).sum(axis=1, keepdims=True) ** (1 / corner)
    parts = [plate_xz([(x * w / 2, z * h / 2) for x, z in ring.tolist()], -d / 2, d / 2, frame)]
    tint, lean = np.array(jitter((186, 204, 216), random, 6)), float(random.uniform(0.1, 0.4))
    for k, share in enumerate((1.0, 0.55, 0.15, -0.3)):  # each band covers the lower part of the one before
        r, g, b = (tint * (1.0 - 0.1 * k)).astype(int).tolist()
        glass = Material((r, g, b), "noise", (r - 12, g - 8, b - 4), 0.6, gloss=0.9)
        inner = [(x * (w / 2 - edge), z * (h / 2 - edge)) for x, z in ring.tolist()]
        line = [(x, min(z, h / 2 * share + lean * x)) for x, z in inner]
        parts.append(plate_xz(line if k else inner, -d / 2 - 0.001 * (k + 1), 0, glass))
    return fitted("mirror", parts, (w, d, h), word)


def _sheet(x0: float, x1: float, z0: float, z1: float, y: float, wave: float, material: Material) -> Part:
    """Cloth that hangs in soft folds: from z1 down to z0, its mean at y, its front only."""
    xs = np.linspace(x0, x1, 13)
    ys = y + wave * np.sin(np.arange(13) * 1.7)
    vertices = np.array([(x, e, z) for z in (z0, z1) for x, e in zip(xs, ys, strict=True)])
    return Part(vertices, grid_faces(2, 13), material)


def towel(random: Random, wanted: WantedSize) -> Item:
    """A towel over a wall rail, one or two abreast; a folded pile when a height below 0.3 m is asked for."""
    word, color = pick(random, CLOTHS)
    cloth = Material(color, "fabric", darker(color, 0.9), 0.04)
    border = Material(darker(color, 0.75 if sum(color) > 300 else 1.5), "fabric", color, 0.04)
    if wanted.height_m is not None and wanted.height_m < 0.3:
        w, d, h = wanted.fill(random, (0.3, 0.45), (0.22, 0.32), (0.08, 0.2), always_draw=True)
        count = max(1, round(h / 0.05))
        parts = []
        for k in range(count):
            fold = cloth if k % 2 == 0 else border
            shape = [(0, 0), (0.96, 0.004), (1, 0.022), (0.96, 0.044), (0, 0.048)]
            parts.append(moved(molded(shape, w * (1 - 0.03 * k), d, fold, 8), (0, 0.004 * (k % 2), 0.05 * k)))
        return fitted("towel", parts, (w, d, h), word)
    w, d, h = wanted.fill(random, (0.45, 0.65), (0.07, 0.09), (0.6, 0.8), always_draw=True)
    bar, wall = h - 0.02, d / 2
    parts = [tube([(-w / 2, wall - 0.045, bar), (w / 2, wall - 0.045, bar)], 0.01, STEEL)]
    parts += [box((x - 0.012, wall - 0.055, bar - 0.02), (x + 0.012, wall, bar + 0.02), STEEL) for x in (-w / 2, w / 2)]
    spans = [(-0.4, 0.4)] if random.random() < 0.55 else [(-0.44, -0.03), (0.03, 0.44)]
    for k, (a, b) in enumerate(spans):
        x0, x1, low = a * w, b * w, h * float(random.uniform(0.05, 0.2)) * k
        parts.append(box((x0, wall - 0.06, bar - 0.005), (x1, wall - 0.03, bar + 0.014), cloth))
        parts.append(box((x0, wall - 0.054, low), (x1, wall - 0.03, bar), cloth))
        high = low + h * 0.14
        for z0, z1, dye in ((low, low + h * 0.08, cloth), (low + h * 0.08, high, border), (high, bar, cloth)):
            parts.append(_sheet(x0, x1, z0, z1, wall - 0.066, 0.008, dye))
    return fitted("towel", parts, (w, d, h), word)


def washing_machine(random: Random, wanted: WantedSize) -> Item:
    """A cube with a round door of dark glass, a drawer for powder, a dial and a display."""
    w, d, h = wanted.fill(random, (0.58, 0.62), (0.55, 0.65), (0.83, 0.88), always_draw=True)
    word, color = pick(random, ("white", "white", "white", "gray", "black"), METALS)
    enamel, y, z = Material(color, gloss=0.5), -d / 2 + 0.05, h * 0.46
    parts = [box((-w / 2, y, 0.02), (w / 2, d / 2, h - 0.03), enamel)]
    parts.append(box((-w / 2, y - 0.005, h - 0.03), (w / 2, d / 2, h), Material(darker(color, 0.92), gloss=0.4)))
    parts += [block((a, b, 0), (0.05, 0.05, 0.02), DARK) for a in (-w * 0.42, w * 0.42) for b in (y + 0.04, d * 0.42)]
    rings = (STEEL, Material((222, 222, 224), gloss=0.6), STEEL if word == "black" else DARK)
    ring = rings[int(random.integers(3))]
    r = w * float(random.uniform(0.29, 0.36))
    rim = lathe([(0, 0), (r, 0), (r, 0.02), (r * 0.78, 0.045), (r * 0.74, 0.02), (0, 0.02)], ring, sides=24)
    parts.append(moved(turned(rim, np.pi / 2, "x"), (0, y, z)))
    parts.append(ellipsoid((0, y - 0.018, z), (r * 0.75, 0.03, r * 0.75), GLASS, 16))
    parts.append(box((r * 0.82, y - 0.05, z - 0.05), (r * 0.96, y, z + 0.05), DARK))
    panel = DARK if random.random() < 0.4 else Material(darker(color, 0.88), gloss=0.4)
    parts.append(box((-w / 2 + 0.004, y - 0.008, h * 0.84), (w / 2 - 0.004, y, h - 0.04), panel))
    parts.append(box((-w * 0.47, y - 0.016, h * 0.85), (-w * 0.2, y, h - 0.048), enamel))
    dial, shown = (0.0, 0.3) if random.random() < 0.5 else (0.38, 0.12)
    parts.append(knob(dial * w, y - 0.008, h * 0.9, 0.032, 0.03, STEEL, 14))
    shining = Material((120, 210, 220), glow=0.7)
    parts.append(block((shown * w, y - 0.008, h * 0.88), (w * 0.18, 0.01, h * 0.045), shining))
    parts.append(box((w * 0.22, y - 0.006, 0.05), (w * 0.44, y, 0.14), Material(darker(color, 0.85))))
    top = SupportSurface(-w / 2 + 0.02, -d / 2 + 0.08, w / 2 - 0.02, d / 2 - 0.02, h, 0.6)
    return fitted("washing machine", parts, (w, d, h), word, (top,))


def laundry_basket(random: Random, wanted: WantedSize) -> Item:
    """A tall wicker hamper with a lid, or an open plastic or wicker basket heaped with clothes."""
    lidded = random.random() < 0.35
    high = (0.5, 0.65) if lidded else (0.35, 0.55)
    w, d, h = wanted.fill(random, (0.38, 0.55), (0.3, 0.42), high, always_draw=True)
    word, color = pick(random, ("beige", "light brown", "brown"), COLORS | WOODS)
    wicker = Material(color, "checks", darker(color, 0.65), 0.045)
    if random.random() < 0.5 and not lidded:
        word, color = pick(random, ("white", "gray", "blue", "green", "pink", "red"))
        wicker = Material(color, "checks", darker(color, 0.5), 0.06)
    corner, band = float(random.choice((2.2, 5.0))), Material(darker(color, 1.1), gloss=0.2)
    top = h * (0.9 if lidded else 0.78)
    wall = [(0, 0), (0.78, 0), (0.97, top), (0.9, top), (0.72, 0.03), (0, 0.03)]
    parts = [molded(wall, w * 0.94, d, wicker, corner)]
    for z, share in ((0.0, 0.8), (top - 0.03, 0.99)):
        hoop = [(share, 0), (share + 0.02, 0), (share + 0.02, 0.03), (share, 0.03)]
        parts.append(moved(molded(hoop, w * 0.94, d, band, corner), (0, 0, z)))
    if lidded:
        cap = [(0, 0), (1.04, 0), (1.03, 0.03), (0.5, h - top), (0, h - top)]
        parts.append(moved(molded(cap, w * 0.94, d, wicker, corner), (0, 0, top)))
    else:
        for k in range(4):
            cloth = Material(pick(random, CLOTHS)[1], "fabric", (90, 90, 96), 0.06)
            at: Point = (w * (-0.24, 0.2, -0.05, 0.08)[k], d * (-0.1, 0.08, 0.14, -0.16)[k], top - 0.02)
            parts.append(ellipsoid(at, (w * 0.24, d * 0.26, (h - top) * (0.6, 1.0, 0.8, 0.7)[k] + 0.02), cloth, 9))
    for s in (-1, 1):
        ear = ((0.45, -0.07, -0.05), (0.52, 0.0, -0.02), (0.45, 0.07, -0.05))
        bow: list[Point] = [(s * w * a, y, top + z) for a, y, z in ear]
        parts.append(tube(bow, 0.012, band, 5))
    return fitted("laundry basket", parts, (w, d, h), word)


def ironing_board(random: Random, wanted: WantedSize) -> Item:
    """A padded board that tapers to one end on crossed legs, a rest at the other end, at times with the iron."""
    w, d, h = wanted.fill(random, (1.2, 1.45), (0.32, 0.42), (0.86, 1.02), always_draw=True)
    iron, texture = random.random() < 0.6, str(random.choice(("stripes", "checks", "fabric", "plain")))
    word, color = pick(random, ("blue", "gray", "red", "green", "pink", "white", "beige", "purple"))
    cover = Material(color, texture, darker(color, 0.7 if random.random() < 0.5 else 1.5), 0.08)
    z, end = h - (0.14 if iron else 0.015), w * 0.32
    half = [(end, -0.5), (end * 0.2, -0.5), (-w * 0.25, -0.43), (-w * 0.4, -0.3), (-w * 0.47, -0.15), (-w * 0.5, -0.04)]
    outline = [(x, y * d) for x, y in half[::-1]] + [(x, -y * d) for x, y in half]
    tray = [(x * 0.98, y * 0.96) for x, y in outline]
    parts = [extrude(outline, z - 0.035, z, cover), extrude(tray, z - 0.05, z - 0.035, STEEL)]
    metal = Material(pick(random, tuple(METALS), METALS)[1], gloss=0.6)
    for x0, x1, y in ((-w * 0.32, w * 0.22, 0.05), (w * 0.3, -w * 0.16, -0.05)):
        parts += [tube([(x0, y, 0.02), (x1, y, z - 0.05)], 0.014, metal, 6)]
        parts += [tube([(x0, -d * 0.46, 0.014), (x0, d * 0.46, 0.014)], 0.014, metal, 6)]
        parts += [block((x0, s * d * 0.46, 0), (0.04, 0.04, 0.032), DARK) for s in (-1, 1)]
    parts += [block((w * 0.4, y * d, z - 0.035), (w * 0.2, 0.014, 0.014), metal) for y in (-0.32, -0.1, 0.1, 0.32)]
    parts.append(block((w * 0.5, 0, z - 0.035), (0.014, d * 0.68, 0.014), metal))
    if iron:
        parts += [moved(part, (w * 0.38, 0, z - 0.02)) for part in _iron(random)]
    return fitted(
        "ironing board", parts, (w, d, h), word, (SupportSurface(-w * 0.3, -d * 0.35, w * 0.2, d * 0.35, z, 0.8),)
    )


def _iron(random: Random) -> list[Part]:
    """A flat iron that points to -x, on z = 0."""
    sole = [(-0.13, 0.0), (-0.06, -0.05), (0.12, -0.058), (0.12, 0.058), (-0.06, 0.05)]
    tint = Material(pick(random, ("blue", "white", "red", "purple"))[1], gloss=0.6)
    body = extrude([(x * 0.9, y * 0.85) for x, y in sole], 0.02, 0.07, tint)
    grip: list[Point] = [(0.08, 0, 0.07), (0.07, 0, 0.15), (-0.06, 0, 0.14), (-0.06, 0, 0.07)]
    return [extrude(sole, 0, 0.02, STEEL), body, tube(grip, 0.012, DARK, 6)]


DESIGNS = {
    "toilet": toilet, "bathtub": bathtub, "shower": shower, "mirror": mirror, "towel": towel,
    "washing machine": washing_machine, "laundry basket": laundry_basket, "ironing board": ironing_board,
}  # fmt: skip
