"""What decorates a room's walls and floor: pictures, clocks, rugs and curtains."""

from __future__ import annotations

import numpy as np

from placegraph.tools.simulator.catalogue._item_assembly import (
    Random,
    WantedSize,
    chance,
    circle,
    drawn,
    fitted,
    hoop,
    merged,
    plate_xz,
    rounded,
)
from placegraph.tools.simulator.color_palette import COLORS, METALS, MUTED, VIVID, WOODS, darker, jitter, pick
from placegraph.tools.simulator.house_model import Color, Item, Material, Part
from placegraph.tools.simulator.mesh_primitives import block, box, ellipsoid, extrude, grid_faces, tube, turned


def _wood(random: Random) -> tuple[str, Material]:
    name, color = pick(random, list(WOODS), WOODS)
    return name, Material(color, "wood", darker(color, 0.75), 0.3, int(random.integers(1000)), gloss=0.2)


def frame(width_m: float, height_m: float, bar_m: float, y: tuple[float, float], material: Material) -> Part:
    """Four bars around a rectangle of width x height in the x-z plane that stands on z = 0, metres."""
    w, (y0, y1) = width_m / 2, y
    bars = [
        box((-w, y0, 0), (w, y1, bar_m), material),
        box((-w, y0, height_m - bar_m), (w, y1, height_m), material),
        box((-w, y0, bar_m), (bar_m - w, y1, height_m - bar_m), material),
        box((w - bar_m, y0, bar_m), (w, y1, height_m - bar_m), material),
    ]
    return merged(bars)


def picture(random: Random, wanted: WantedSize) -> Item:
    """A painting in a plain or a stepped frame, with or without a mat, or a bare canvas."""
    width, depth = drawn(random, wanted.width_m, 0.35, 1.1), drawn(random, wanted.depth_m, 0.02, 0.045)
    height = width * float(random.choice([0.66, 0.75, 1.0, 1.3, 1.5])) if wanted.height_m is None else wanted.height_m
    height = min(height, 1.2) if wanted.height_m is None else height
    first, second = (pick(random, (*VIVID, *MUTED))[1] for _ in range(2))
    image = Material(first, "picture", second, 0.0, int(random.integers(100_000)))
    kind = int(random.integers(4))
    back, front = depth / 2, -depth / 2
    if kind == 0:
        parts = [box((-width / 2, front, 0), (width / 2, front + 0.004, height), image)]
        parts.append(
            box((-width / 2, front + 0.004, 0), (width / 2, back, height), Material((214, 206, 190), "fabric"))
        )
        return fitted("picture", parts, (width, depth, height))
    bar = float(random.uniform(0.02, 0.06))
    gold = Material(jitter((186, 146, 66), random), "noise", (140, 104, 44), 0.04, gloss=0.5)
    border = gold if chance(random, 0.25) else _wood(random)[1]
    parts = [frame(width, height, bar, (front, back), border)]
    inner = bar
    if kind == 1:
        inner = bar + float(random.uniform(0.12, 0.2)) * min(width, height)
        mat = Material(jitter((238, 234, 222), random, 5))
        parts.append(box((bar - width / 2, 0.002, bar), (width / 2 - bar, back, height - bar), mat))
    elif kind == 2:
        inner = bar + 0.012
        lip = Material(darker(border.color, 0.5))
        parts.append(box((bar - width / 2, front + 0.008, bar), (width / 2 - bar, back, height - bar), lip))
    plane = (0.0 if kind == 1 else front + 0.005) if kind != 3 else 0.004
    parts.append(box((inner - width / 2, plane, inner), (width / 2 - inner, back - 0.001, height - inner), image))
    return fitted("picture", parts, (width, depth, height))


def _hand(angle: float, length_m: float, wide_m: float, y: float, material: Material) -> Part:
    """A hand or a tick from the middle of a dial, `angle` clockwise from twelve."""
    bar = box((-wide_m / 2, y - 0.002, -0.12 * length_m), (wide_m / 2, y, length_m), material)
    return turned(bar, angle, "y")


def _ticks(radius_m: float, y: float, material: Material) -> Part:
    """Twelve strokes, the quarters bolder: flat, as only their front is ever seen."""
    strokes = []
    for hour in range(12):
        half = 0.035 * radius_m if hour % 3 == 0 else 0.016 * radius_m
        low = (0.66 if hour % 3 == 0 else 0.76) * radius_m
        corners = [(-half, y, low), (half, y, low), (half, y, radius_m * 0.9), (-half, y, radius_m * 0.9)]
        flat = Part(np.array(corners), np.array([[0, 1, 2], [0, 2, 3]], np.int32), material)
        strokes.append(turned(flat, hour * np.pi / 6, "y"))
    return merged(strokes)


def _case(random: Random, radius_m: float, depth_m: float) -> tuple[str, list[Part], Color]:
    """The clock's body with its front rim, around (0, 0): round, square or a sun of rays; the dial's colour."""
    kind = int(random.choice([0, 1, 1, 1, 2]))
    name, color = pick(random, ("black", "white", "gray", "red", "blue", "green", "yellow"))
    case = Material(color, gloss=0.4)
    if chance(random, 0.35):
        name, case = _wood(random)
    dial = (34, 34, 38) if chance(random, 0.2) else jitter((240, 238, 228), random, 4)
    front = -depth_m / 2
    if kind == 0:
        square = rounded(2 * radius_m, 2 * radius_m, radius_m * 0.25)
        return name, [plate_xz(square, front + 0.004, depth_m / 2, case)], dial
    parts = [plate_xz(circle(radius_m, 20), front + 0.004, depth_m / 2, case)]
    if kind == 1:
        parts.append(hoop((0, front + 0.004, 0), radius_m * 0.96, radius_m * 0.06, case, 20, 4))
    else:
        for k in range(12):
            ray = plate_xz(
                [(-0.06 * radius_m, 0.9 * radius_m), (0.06 * radius_m, 0.9 * radius_m), (0.0, 1.5 * radius_m)],
                0, depth_m / 2, case,
            )  # fmt: skip
            parts.append(turned(ray, k * np.pi / 6, "y"))
    return name, parts, dial


def clock(random: Random, wanted: WantedSize) -> Item:
    """A wall clock with hour strokes and two or three hands; one size that is given holds for both directions."""
    size = drawn(random, wanted.height_m if wanted.width_m is None else wanted.width_m, 0.24, 0.4)
    depth, radius = drawn(random, wanted.depth_m, 0.035, 0.06), size / 2
    name, parts, dial = _case(random, radius, depth)
    ink = (228, 226, 220) if dial[0] < 100 else (26, 26, 30)
    y = -depth / 2
    parts.append(plate_xz(circle(radius * 0.9, 20), y + 0.002, y + 0.006, Material(dial)))
    parts.append(_ticks(radius * 0.96, y + 0.001, Material(ink)))
    minute, hour = random.integers(60), random.integers(12)
    parts.append(_hand(float(minute) * np.pi / 30, radius * 0.7, radius * 0.05, y + 0.001, Material(ink)))
    turn = (float(hour) + float(minute) / 60) * np.pi / 6
    parts.append(_hand(turn, radius * 0.45, radius * 0.075, y, Material(ink)))
    if chance(random, 0.5):
        red = Material(COLORS["red"])
        parts.append(_hand(float(random.uniform(0, 6.28)), radius * 0.75, radius * 0.02, y - 0.001, red))
    return fitted("clock", parts, (wanted.width_m or size, depth, wanted.height_m or size), name)


def rug(random: Random, wanted: WantedSize) -> Item:
    """A rectangular rug with a border and perhaps fringes, or a round one with rings."""
    width, depth, height = wanted.fill(random, (1.2, 2.4), (0.8, 1.7), (0.01, 0.02))
    name, color = pick(random, (*VIVID, *MUTED))
    texture = str(random.choice(["fabric", "stripes", "checks", "noise", "picture"]))
    second = darker(color, 0.75) if texture in ("fabric", "noise") else pick(random, (*VIVID, *MUTED))[1]
    scale = 0.0 if texture == "picture" else float(random.uniform(0.08, 0.4))
    field = Material(color, texture, second, scale, int(random.integers(100_000)))
    edge = Material(pick(random, (*VIVID, *MUTED))[1], "fabric", darker(color, 0.5), 0.04)
    inset = float(random.uniform(0.05, 0.1)) * min(width, depth)
    low, high = height * 0.8, height
    if chance(random, 0.3):
        if wanted.width_m is None and wanted.depth_m is None:
            width = depth = min(width, depth) * 1.1
        shares = ((1.0, low, edge), (1 - 2 * inset / width, high, field), (0.4, high + 0.001, edge))
        parts = [extrude(circle(s * width / 2, 28, y_radius_m=s * depth / 2), 0, z, m) for s, z, m in shares]
        return fitted("rug", parts, (width, depth, height), name)
    fringe = 0.05 if chance(random, 0.4) else 0.0
    body = width - 2 * fringe
    parts = [block((0, 0, 0), (body, depth, low), edge)]
    parts.append(block((0, 0, 0), (body - 2 * inset, depth - 2 * inset, high), field))
    if fringe:
        wool = Material(jitter((226, 214, 188), random))
        tufts = []
        for y in np.linspace(-depth / 2 + 0.02, depth / 2 - 0.02, 15):
            for side in (-1, 1):
                tufts.append(block((side * (width - fringe) / 2, float(y), 0), (fringe, 0.025, low * 0.6), wool))
        parts.append(merged(tufts))
    return fitted("rug", parts, (width, depth, height), name)


def _panel(wide_m: float, tall_m: float, wave_m: float, folds: float, tied: bool, cloth: Material) -> Part:
    """A hanging cloth from x = 0 to wide_m, wavy in y; a tied one is drawn in to x = 0 below its middle."""
    columns = int(folds * (4 if tied else 6)) + 1
    share = np.linspace(0, 1, columns)
    rows = ((0.0, 0.62), (0.38, 0.3), (0.62, 0.72), (1.0, 1.0)) if tied else ((0.0, 1.0), (1.0, 0.96))
    sheet = []
    for z, wide in rows:
        y = wave_m * np.sin(2 * np.pi * folds * share)
        sheet.append(np.stack((share * wide * wide_m, y, np.full(columns, z * tall_m)), axis=1))
    front = np.concatenate(sheet)
    outside = grid_faces(len(rows), columns)
    behind = front + np.array([0, 0.004, 0])
    return Part(np.concatenate((front, behind)), np.concatenate((outside, outside[:, ::-1] + len(front))), cloth)


def curtain(random: Random, wanted: WantedSize) -> Item:
    """Two wavy cloths on a rod, drawn aside or tied back, with the middle between them open."""
    width, depth, height = wanted.fill(random, (1.5, 1.8), (0.1, 0.14), (2.0, 2.3))
    name, color = pick(random, (*VIVID, *MUTED))
    texture = str(random.choice(["plain", "fabric", "noise"]))  # folds would tear a pattern apart
    cloth = Material(color, texture, darker(color, 0.8), float(random.uniform(0.1, 0.3)), int(random.integers(1000)))
    rod = Material(pick(random, list(METALS), METALS)[1], gloss=0.5) if chance(random, 0.5) else _wood(random)[1]
    top, tied = height - 0.05, chance(random, 0.4)
    wide = width * float(random.uniform(0.24, 0.34))
    folds = float(np.clip(round(wide / random.uniform(0.08, 0.12)), 3, 7))
    parts = []
    for side in (-1, 1):
        sheet = _panel(wide, top, depth * 0.42, folds, tied, cloth)
        x = sheet.vertices[:, 0] if side < 0 else wide - sheet.vertices[:, 0]
        moved_x = np.column_stack(
            (x - width / 2 + 0.04 if side < 0 else x + width / 2 - 0.04 - wide, sheet.vertices[:, 1:])
        )
        parts.append(Part(moved_x, sheet.faces if side < 0 else sheet.faces[:, ::-1].copy(), cloth))
        if tied:
            at = (side * (width / 2 - 0.04 - wide * 0.15), 0, top * 0.36)
            parts.append(block(at, (wide * 0.34, depth * 0.95, 0.05), Material(darker(color, 0.6))))
        parts.append(ellipsoid((side * (width / 2 - 0.03), 0, top + 0.01), (0.03, 0.03, 0.03), rod, sides=7))
    if chance(random, 0.3):
        low = (0.05 - width / 2, -depth / 2, top - 0.15)
        parts.append(
            box(low, (width / 2 - 0.05, 0.3 * depth, top + 0.03), Material(darker(color, 0.8), "fabric", color, 0.1))
        )
    parts.append(tube([(0.03 - width / 2, 0, top + 0.01), (width / 2 - 0.03, 0, top + 0.01)], 0.014, rod, sides=6))
    return fitted("curtain", parts, (width, depth, height), name)


DESIGNS = {"picture": picture, "clock": clock, "rug": rug, "curtain": curtain}
