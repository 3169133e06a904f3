"""Materials of the floors, walls and ceilings of a room by its type."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from placegraph.tools.simulator.color_palette import WOODS, darker, jitter
from placegraph.tools.simulator.house_model import Color, Material

PAINTS: tuple[Color, ...] = (
    (236, 233, 224), (226, 219, 203), (214, 222, 224), (205, 217, 203), (228, 210, 196), (196, 208, 224),
    (232, 222, 182), (210, 196, 208), (178, 192, 186), (222, 190, 168), (168, 180, 198), (214, 212, 208),
)  # fmt: skip
TILES: tuple[Color, ...] = (
    (222, 224, 222),
    (196, 206, 210),
    (170, 190, 196),
    (206, 198, 184),
    (150, 154, 156),
    (190, 206, 190),
)
CARPETS: tuple[Color, ...] = ((150, 142, 132), (120, 128, 140), (170, 154, 132), (128, 108, 104), (112, 126, 116))
WET = ("bathroom", "laundry")


@dataclass(frozen=True)
class Finish:
    """The materials of one room; the dado covers the wall's lower part up to `dado_m`."""

    floor: Material
    wall: Material
    dado: Material
    dado_m: float
    baseboard: Material | None
    beam: Material | None
    beam_m: float


def building_material(random: np.random.Generator) -> Material:
    """Plain plaster of walls' cores, slabs and ceilings."""
    return Material(jitter((232, 230, 224), random, 5.0), "noise", (214, 212, 206), 0.6, _seed(random))


def trim_material(random: np.random.Generator) -> Material:
    """Of thresholds, door casings, sills and rails."""
    name = str(random.choice(["white", "white", "light brown", "brown"]))
    color = jitter(WOODS[name], random)
    return Material(color, "plain" if name == "white" else "wood", darker(color, 0.75), 0.4, _seed(random), 0.2)


def room_finish(random: np.random.Generator, room_type: str) -> Finish:
    """The random finish of a room of a type."""
    wall, dado, dado_m = _wall(random), None, 0.0
    if room_type in WET:
        dado, dado_m = _tiles(random, 0.12, 0.3), float(random.choice([1.2, 1.5, 2.0]))
    elif random.random() < 0.2:
        dado, dado_m = Material(darker(wall.color, 0.75), "noise", darker(wall.color, 0.7), 0.4, _seed(random)), 0.95
    white = Material(jitter((230, 229, 224), random, 5.0), gloss=0.15)
    wood = jitter(WOODS["brown"], random)
    beam = Material(wood, "wood", darker(wood, 0.7), 0.5, _seed(random)) if random.random() < 0.22 else None
    baseboard = None if room_type in WET else white
    return Finish(
        _floor(random, room_type), wall, dado or wall, dado_m, baseboard, beam, float(random.uniform(0.1, 0.16))
    )


def _wall(random: np.random.Generator) -> Material:
    color = jitter(PAINTS[int(random.integers(len(PAINTS)))], random, 6.0)
    style = float(random.random())
    if style < 0.35:
        return Material(color)
    if style < 0.7:
        return Material(color, "noise", darker(color, 0.92), float(random.uniform(0.3, 0.9)), _seed(random))
    if style < 0.88:
        return Material(
            color,
            "stripes",
            darker(color, float(random.uniform(0.8, 0.93))),
            float(random.uniform(0.15, 0.5)),
            _seed(random),
        )
    if style < 0.94:
        return Material(color, "checks", darker(color, 0.9), float(random.uniform(0.2, 0.5)), _seed(random))
    return Material(jitter((168, 104, 84), random), "bricks", (196, 190, 180), 0.5, _seed(random))


def _tiles(random: np.random.Generator, min_m: float, max_m: float) -> Material:
    color = jitter(TILES[int(random.integers(len(TILES)))], random, 6.0)
    return Material(color, "tiles", darker(color, 0.7), float(random.uniform(min_m, max_m)), _seed(random), gloss=0.35)


def _floor(random: np.random.Generator, room_type: str) -> Material:
    wet = room_type in (*WET, "kitchen")
    style = float(random.random())
    if wet and (room_type != "kitchen" or style < 0.7):
        return _tiles(random, 0.25, 0.6)
    if room_type in ("bedroom", "office", "playroom", "living room") and style < 0.3:
        color = jitter(CARPETS[int(random.integers(len(CARPETS)))], random)
        return Material(color, "noise", darker(color, 0.8), 0.25, _seed(random))
    if room_type in ("hallway", "corridor") and style < 0.3:
        color = jitter((206, 200, 190), random)
        return Material(color, "marble", darker(color, 0.8), 1.0, _seed(random), gloss=0.4)
    color = jitter(WOODS[str(random.choice(["brown", "light brown", "light brown", "beige"]))], random)
    return Material(color, "wood", darker(color, 0.78), float(random.uniform(0.6, 1.2)), _seed(random), gloss=0.25)


def _seed(random: np.random.Generator) -> int:
    return int(random.integers(1_000_000))
