"""Single items in corners and along walls: plants, trash cans, suitcases, a bicycle, the toilet."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from placegraph.tools.simulator.furniture_groups.group_layout import GroupLayout
from placegraph.tools.simulator.furniture_groups.living_and_dining import item_size
from placegraph.tools.simulator.house_model import Item

# What may stand about in a room of a type: class and chance; listed twice where two are usual.
SINGLE_ITEMS: dict[str, tuple[tuple[str, float], ...]] = {
    "living room": (
        ("potted plant", 0.6), ("potted plant", 0.3), ("lamp", 0.22), ("guitar", 0.12), ("box", 0.15), ("ball", 0.15),
        ("trash can", 0.15), ("stool", 0.19),
    ),
    "kitchen": (("trash can", 0.68), ("potted plant", 0.22), ("stool", 0.22), ("box", 0.11)),
    "dining room": (("potted plant", 0.52), ("lamp", 0.3), ("stool", 0.15)),
    "bathroom": (("laundry basket", 0.35), ("trash can", 0.22), ("stool", 0.15)),
    "laundry": (("bicycle", 0.25), ("box", 0.38), ("trash can", 0.22), ("ironing board", 0.3), ("suitcase", 0.25)),
    "bedroom": (
        ("pillow", 0.4), ("teddy bear", 0.2), ("potted plant", 0.3), ("suitcase", 0.4), ("backpack", 0.45),
        ("laundry basket", 0.2), ("guitar", 0.08), ("ball", 0.25), ("stool", 0.11), ("box", 0.15),
    ),
    "office": (("potted plant", 0.45), ("box", 0.34), ("backpack", 0.4), ("suitcase", 0.15), ("lamp", 0.22)),
    "playroom": (
        ("pillow", 0.4), ("box", 0.45), ("ball", 0.38), ("teddy bear", 0.4), ("backpack", 0.3),
        ("stool", 0.3), ("lamp", 0.22),
    ),
    "hallway": (("bicycle", 0.35), ("potted plant", 0.38), ("suitcase", 0.4), ("backpack", 0.25), ("box", 0.15)),
    "corridor": (("potted plant", 0.38), ("box", 0.22), ("suitcase", 0.25), ("bench", 0.25), ("bicycle", 0.08)),
}  # fmt: skip
DEFAULT_ITEMS = (("box", 0.5), ("potted plant", 0.4))
AGAINST_WALL = ("bicycle", "guitar", "ironing board", "bench", "suitcase", "lamp")  # backs to the wall


def toilet(random: np.random.Generator, area_m2: float) -> Iterator[GroupLayout]:
    """A toilet at the wall."""
    layout = GroupLayout("", random)
    layout.place_at_wall(layout.design("toilet"), 0)
    yield layout


def bicycle(random: np.random.Generator, area_m2: float) -> Iterator[GroupLayout]:
    """A bicycle along the wall, placed before the furniture takes the space."""
    layout = GroupLayout("", random)
    layout.place_at_wall(layout.design("bicycle"), 0)
    yield layout


def draw_single_items(room_type: str, area_m2: float, random: np.random.Generator) -> Iterator[GroupLayout]:
    """Random single items for a room of a type, fewer where it is small."""
    for name, chance in SINGLE_ITEMS.get(room_type, DEFAULT_ITEMS):
        if random.random() < chance * min(1.0, 0.5 + area_m2 / 20):
            layout = GroupLayout("", random)
            item = _floor_item(layout, name)
            width, depth, _ = item_size(item)
            turn = 0.0 if name in AGAINST_WALL else float(random.uniform(-0.35, 0.35))
            layout.place_free(item, 0, -0.06 - (np.hypot(width, depth) if turn else depth) / 2, turn)
            yield layout


def _floor_item(layout: GroupLayout, name: str) -> Item:
    """An item of a class in a size that stands on the floor."""
    heights = {"potted plant": (0.5, 1.4), "lamp": (1.35, 1.7), "box": (0.25, 0.45), "teddy bear": (0.35, 0.6)}
    if name not in heights:
        return layout.design(name)
    return layout.design(name, height_m=float(layout.random.uniform(*heights[name])))
