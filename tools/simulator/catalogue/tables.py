"""Tables, coffee tables, desks and nightstands."""

from __future__ import annotations

import itertools

import numpy as np

from placegraph.tools.simulator.catalogue._cabinet_parts import case, dark_of, finish, fronts_of, metal, standing, wood
from placegraph.tools.simulator.catalogue._item_assembly import Random, WantedSize, assembled, drawn
from placegraph.tools.simulator.house_model import Item, Material, Part, SupportSurface
from placegraph.tools.simulator.mesh_primitives import block, box, extrude, lathe, moved, tube

Size = float | None


def _table_top(random: Random, w: float, d: float, z0: float, h: float, stuff: Material, round_it: bool) -> Part:
    """A table top, w by d, round or with corners."""
    if not round_it:
        return box((-w / 2, -d / 2, z0), (w / 2, d / 2, h), stuff)
    angles = np.linspace(0, 2 * np.pi, 28, endpoint=False).tolist()
    return extrude([(w / 2 * np.cos(a), d / 2 * np.sin(a)) for a in angles], z0, h, stuff)


def top_surface(w: float, d: float, h: float, round_it: bool) -> SupportSurface:
    """The free top of a table w by d: all of it, or the rectangle inside a round one."""
    x, y = (0.33 * w, 0.33 * d) if round_it else (w / 2 - 0.02, d / 2 - 0.02)
    return SupportSurface(-x, -y, x, y, h)


def _table_legs(style: str, w: float, d: float, high: float, stuff: Material, thick: float) -> list[Part]:
    """What holds a table top at a height: four legs, a column, two trestles, hairpins, or two panels."""
    x, y = w / 2 - thick, d / 2 - thick
    if style == "column":
        foot = lathe([(0, 0), (0.34, 0), (0.32, 0.02), (0.07, 0.05), (0, 0.05)], stuff)
        foot = Part(foot.vertices * (w, d, 1), foot.faces, stuff)
        return [foot, lathe([(0, 0.04), (0.06, 0.04), (0.04, high / 2), (0.08, high), (0, high)], stuff)]
    if style == "trestles":
        parts = [tube([(a * (x - 0.1), b * (y - 0.03), 0.02), (a * (x - 0.1), b * 0.08, high)], 0.026, stuff, sides=4)
                 for a in (-1, 1) for b in (-1, 1)]  # fmt: skip
        return [*parts, block((0, 0, 0.3 * high), (2 * x - 0.2, 0.03, 0.07), stuff)]
    if style == "hairpins":
        parts = []
        for a, b in ((-1, -1), (-1, 1), (1, -1), (1, 1)):
            floor = (a * x, b * y, 0.006)
            ends = [(a * (x - 0.1), b * (y - 0.02), high), (a * (x - 0.02), b * (y - 0.1), high)]
            parts += [tube([floor, end], 0.008, stuff, 5) for end in ends]
        return parts
    if style == "panels":
        return [block((a * (x - 0.03), 0, 0), (0.04, d - 0.08, high), stuff) for a in (-1, 1)]
    turned_leg = [(0, 0), (thick * 0.3, 0), (thick * 0.45, high * 0.6), (thick * 0.6, high), (0, high)]
    corners = [(a * x, b * y) for a in (-1, 1) for b in (-1, 1)]
    if style == "round legs":
        return [lathe(turned_leg, stuff, (x, y, 0), sides=8) for x, y in corners]
    rails = [block((0, b * y, high - 0.08), (2 * x, 0.022, 0.08), stuff) for b in (-1, 1)]
    rails += [block((a * x, 0, high - 0.08), (0.022, 2 * y, 0.08), stuff) for a in (-1, 1)]
    return [block((x, y, 0), (thick, thick, high), stuff) for x, y in corners] + rails


def table(random: Random, wanted: WantedSize) -> Item:
    """A dining table from small and round to long: on legs, a column, trestles or panels."""
    shape = str(random.choice(["round", "long", "long", "square"]))
    w = drawn(random, wanted.width_m, *((1.3, 2.0) if shape == "long" else (0.75, 1.1)))
    d = drawn(random, wanted.depth_m, *((0.8, 0.95) if shape == "long" else (w, w)))
    h = drawn(random, wanted.height_m, 0.72, 0.77)
    round_it = shape == "round" and 0.6 < w / d < 1.7
    name, top = finish(random, 0.12)
    style = "column" if round_it else str(random.choice(["square legs", "square legs", "trestles", "panels"]))
    if round_it and random.random() < 0.4:
        style = "round legs"
    thick = float(random.uniform(0.02, 0.04))
    legs = top if random.random() < 0.6 else (metal(random) if random.random() < 0.5 else wood(random)[1])
    share = 0.75 if style == "round legs" else 1.0
    parts = _table_legs(style, share * w, share * d, h - thick, legs, float(random.uniform(0.05, 0.08)))
    parts.append(_table_top(random, w, d, h - thick, h, top, round_it))
    return assembled("table", parts, (w, d, h), name, (top_surface(w, d, h, round_it),))


def coffee_table(random: Random, wanted: WantedSize) -> Item:
    """A low table: round, with a shelf below, on hairpins or panels, or with a dark glass top."""
    style = str(random.choice(["round", "shelf", "hairpins", "panels", "glass"]))
    w = drawn(random, wanted.width_m, *((0.65, 0.9) if style == "round" else (0.85, 1.25)))
    d = drawn(random, wanted.depth_m, *((w, w) if style == "round" else (0.48, 0.68)))
    h = drawn(random, wanted.height_m, 0.36, 0.46)
    name, top = finish(random, 0.2)
    round_it, thick = style == "round" and 0.6 < w / d < 1.7, float(random.uniform(0.025, 0.05))
    under = metal(random) if style in ("hairpins", "glass") else top
    below = {"round": "round legs", "shelf": "square legs", "glass": "square legs"}.get(style, style)
    share = 0.8 if round_it else 1.0
    parts = _table_legs(below, share * w, share * d, h - thick, under, 0.045)
    surfaces = [top_surface(w, d, h, round_it)]
    if style in ("shelf", "panels"):
        parts.append(block((0, 0, 0.1), (w - 0.12, d - 0.12, 0.02), top))
        surfaces.append(SupportSurface(0.12 - w / 2, 0.1 - d / 2, w / 2 - 0.12, d / 2 - 0.1, 0.12, h - thick - 0.2))
    if style == "glass":
        name, top = "", Material((58, 78, 82), gloss=0.9)
    parts.append(_table_top(random, w, d, h - thick, h, top, round_it))
    return assembled("coffee table", parts, (w, d, h), name, surfaces)


def desk(random: Random, wanted: WantedSize) -> Item:
    """A work table: drawers on one side, on both, or shallow ones under the top; a modesty panel at the back."""
    style = str(random.choice(["pedestal", "two pedestals", "shallow"]))
    w, d, h = wanted.fill(random, (1.05, 1.6), (0.55, 0.75), (0.72, 0.77))
    name, top = finish(random, 0.15)
    body = top if random.random() < 0.6 else finish(random, 0.4)[1]
    fronts = fronts_of(random, body)
    t, y = 0.03, 0.02 - d / 2 + fronts.reach_m
    parts = [box((-w / 2, -d / 2, h - t), (w / 2, d / 2, h), top)]
    wide, side = min(0.42, 0.3 * w), 1 if random.random() < 0.5 else -1
    sides = (-1, 1) if style == "two pedestals" else (side,)
    if style == "shallow":
        steel = metal(random)
        for a in (-1, 1):
            x = a * (w / 2 - 0.08)
            parts += [block((x, 0, 0), (0.07, d - 0.04, 0.04), steel), block((x, 0.05, 0), (0.07, 0.07, h - t), steel)]
        parts += [moved(p, (0, 0, 0)) for p in case(w - 0.3, d - 0.04, h - t - 0.13, h - t, y, body)]
        edges = np.linspace(-w / 2 + 0.16, w / 2 - 0.16, 3).tolist()
        parts += [p for k in (0, 1) for p in fronts.drawer(edges[k], edges[k + 1], h - t - 0.125, h - t - 0.025, y)]
    else:
        for a in sides:
            x = a * (w / 2 - wide / 2 - 0.02)
            parts += [moved(p, (x, 0, 0)) for p in case(wide, d - 0.04, 0.05, h - t, y, body)]
            parts.append(block((x, 0.02, 0), (wide - 0.04, d - 0.1, 0.05), dark_of(body)))
            levels = np.linspace(0.06, h - t - 0.025, 4).tolist()
            for z0, z1 in itertools.pairwise(levels):
                parts += fronts.drawer(x - wide / 2 + 0.01, x + wide / 2 - 0.01, z0, z1, y)
    if style == "pedestal":
        parts.append(block((-side * (w / 2 - 0.035), 0, 0), (0.03, d - 0.04, h - t), body))
    parts.append(box((0.08 - w / 2, d / 2 - 0.06, 0.32 * h), (w / 2 - 0.08, d / 2 - 0.04, h - t), body))
    return assembled("desk", parts, (w, d, h), name, (top_surface(w, d, h, False),))


def nightstand(random: Random, wanted: WantedSize) -> Item:
    """A small case beside a bed: two drawers, a drawer above an open shelf, or a drawer above a door."""
    style = str(random.choice(["drawers", "open", "door"]))
    w, d, h = wanted.fill(random, (0.38, 0.52), (0.34, 0.44), (0.45, 0.62))
    name, body = finish(random)
    fronts = fronts_of(random, body)
    base, z0 = standing(random, w, d, h, body)
    y, x, split = fronts.reach_m - d / 2, w / 2 - 0.012, h - 0.45 * (h - z0)
    parts, surfaces = list(base), [top_surface(w, d, h, False)]
    if style == "open":
        split = h - 0.17
        parts += [box((a, y, z0), (a + 0.02, d / 2, h), body) for a in (-w / 2, w / 2 - 0.02)]
        parts += [
            box((-w / 2, y, z0), (w / 2, d / 2, z0 + 0.02), body),
            box((0.01 - w / 2, d / 2 - 0.01, z0), (w / 2 - 0.01, d / 2 - 0.001, split), dark_of(body)),
        ]
        parts += case(w - 0.002, d, split, h, y, body)
        surfaces.append(
            SupportSurface(0.04 - w / 2, y + 0.02, w / 2 - 0.04, d / 2 - 0.03, z0 + 0.02, split - z0 - 0.03)
        )
    else:
        parts += case(w, d, z0, h, y, body)
        parts += (fronts.drawer(-x, x, z0 + 0.012, split, y) if style == "drawers"
                  else fronts.door(-x, x, z0 + 0.012, split, y, handle_left=random.random() < 0.5))  # fmt: skip
    parts += fronts.drawer(-x, x, split, h - 0.03, y)
    return assembled("nightstand", parts, (w, d, h), name, surfaces)


DESIGNS = {"table": table, "coffee table": coffee_table, "desk": desk, "nightstand": nightstand}
