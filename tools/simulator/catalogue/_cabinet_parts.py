"""Finishes, drawer and door fronts, and cases that pieces of furniture share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from placegraph.tools.simulator.catalogue._item_assembly import Random
from placegraph.tools.simulator.color_palette import METALS, WOODS, darker, pick
from placegraph.tools.simulator.house_model import Material, Part
from placegraph.tools.simulator.mesh_primitives import box, cylinder, moved, turned

_GAP_M = 0.006  # between two drawer fronts


_PANEL_M = 0.016  # thickness of a front


_DARK = Material((28, 26, 26))


def wood(random: Random, names: Sequence[str] = tuple(WOODS)) -> tuple[str, Material]:
    """A wood of one of the named colours: its word and material."""
    name, color = pick(random, names, WOODS)
    return name, Material(color, "wood", darker(color, 0.82), 0.4, int(random.integers(1000)), gloss=0.15)


def finish(random: Random, painted: float = 0.25) -> tuple[str, Material]:
    """A wood, or (with probability `painted`) a coat of paint: its word and material."""
    if random.random() >= painted:
        return wood(random)
    name, color = pick(random, ("gray", "green", "blue", "white", "yellow", "red", "beige", "pink"))
    return name, Material(color, gloss=0.25)


def metal(random: Random) -> Material:
    """A metal for legs, rails and handles."""
    return Material(pick(random, tuple(METALS), METALS)[1], gloss=0.5)


@dataclass(frozen=True)
class Fronts:
    """How the drawers and doors of one piece look: panel, handle and its kind (knob, bar or groove)."""

    panel: Material
    pull: Material
    kind: str

    @property
    def reach_m(self) -> float:
        """How far the handles stand out of the panels."""
        return 0.002 if self.kind == "groove" else 0.028

    def drawer(self, x0: float, x1: float, z0: float, z1: float, y: float) -> list[Part]:
        """A drawer front between x0, x1, z0, z1 whose panel faces -y at y."""
        x, z, wide = (x0 + x1) / 2, (z0 + z1) / 2, x1 - x0
        if self.kind == "bar":
            return [self._panel(x0, x1, z0, z1, y), self._bar(x, z, min(0.3 * wide, 0.2), 0.014, y)]
        if self.kind == "groove":
            low = z1 - min(0.03, (z1 - z0) / 4)
            groove = box((x - wide * 0.2, y - self.reach_m, low), (x + wide * 0.2, y, z1 - _GAP_M), _DARK)
            return [self._panel(x0, x1, z0, z1, y), groove]
        places = (x - wide / 4, x + wide / 4) if wide > 0.6 else (x,)
        return [self._panel(x0, x1, z0, z1, y)] + [self._knob(place, z, y) for place in places]

    def door(self, x0: float, x1: float, z0: float, z1: float, y: float, handle_left: bool) -> list[Part]:
        """A door between x0, x1, z0, z1 whose panel faces -y at y, with its handle near one edge."""
        x = x0 + 0.05 if handle_left else x1 - 0.05
        z = min((z0 + z1) / 2 + 0.1 * (z1 - z0), z0 + 1.1)
        parts = [self._panel(x0, x1, z0, z1, y)]
        if self.kind == "bar":
            return [*parts, self._bar(x, z, 0.014, min(0.3, (z1 - z0) / 3), y)]
        if self.kind == "groove":
            edge = x0 + 0.018 if handle_left else x1 - 0.018
            return [*parts, box((edge - 0.012, y - self.reach_m, z - 0.1), (edge + 0.012, y, z + 0.1), _DARK)]
        return [*parts, self._knob(x, z, y)]

    def _panel(self, x0: float, x1: float, z0: float, z1: float, y: float) -> Part:
        return box((x0 + _GAP_M, y, z0 + _GAP_M), (x1 - _GAP_M, y + _PANEL_M, z1 - _GAP_M), self.panel)

    def _bar(self, x: float, z: float, wide: float, high: float, y: float) -> Part:
        return box((x - wide / 2, y - self.reach_m, z - high / 2), (x + wide / 2, y, z + high / 2), self.pull)

    def _knob(self, x: float, z: float, y: float) -> Part:
        knob = cylinder((0, 0, 0), 0.012, self.reach_m, self.pull, top_radius_m=0.019, sides=6)
        return moved(turned(knob, np.pi / 2, "x"), (x, y, z))


def fronts_of(random: Random, body: Material) -> Fronts:
    """Fronts that go with a body: mostly its own material, else white, wood or a colour."""
    panel = body if random.random() < 0.7 else finish(random, 0.5)[1]
    pull, kind = metal(random), str(random.choice(["knob", "bar", "groove"]))
    if sum(panel.color) < 220:  # on near black, gaps and handles would not be seen
        panel = Material(darker(panel.color, 1.45), panel.texture, panel.color, panel.scale_m, panel.seed, panel.gloss)
        pull = Material((176, 178, 182), gloss=0.6)
    return Fronts(panel, pull, kind)


def case(w: float, d: float, z0: float, z1: float, y: float, body: Material) -> list[Part]:
    """A closed case from z0 to z1 behind fronts whose panels face -y at y; dark shows through the gaps between them."""
    back = y + _PANEL_M
    recess = box((-w / 2 + 0.012, back - 0.003, z0 + 0.012), (w / 2 - 0.012, back, z1 - 0.03), _DARK)
    return [
        box((-w / 2, back, z0), (w / 2, d / 2, z1 - 0.025), body),
        recess,
        box((-w / 2, y - 0.002, z1 - 0.025), (w / 2, d / 2, z1), body),
    ]


def standing(random: Random, w: float, d: float, h: float, body: Material) -> tuple[list[Part], float]:
    """What a case stands on, a plinth or four legs: the parts and the height above them in metres."""
    if random.random() < 0.5:
        high = min(0.07, 0.12 * h)
        return [box((-w / 2 + 0.01, -d / 2 + 0.05, 0), (w / 2 - 0.01, d / 2, high), dark_of(body))], high
    high = min(float(random.uniform(0.1, 0.18)), 0.2 * h)
    leg = metal(random) if random.random() < 0.4 else wood(random)[1]
    x, y = w / 2 - 0.05, d / 2 - 0.05
    legs = [cylinder((a * x, b * y, 0), 0.014, high, leg, 0.022, sides=8) for a in (-1, 1) for b in (-1, 1)]
    return legs, high


def dark_of(material: Material) -> Material:
    """A much darker plain material, for insides and plinths."""
    return Material(darker(material.color, 0.55))
