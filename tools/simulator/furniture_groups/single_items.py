"""Single items in corners and along walls: plants, trash cans, suitcases, a bicycle, the toilet."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

from placegraph.tools.simulator.furniture_groups import CONTENTS
from placegraph.tools.simulator.furniture_groups.group_layout import GroupBuilder, GroupLayout
from placegraph.tools.simulator.furniture_groups.living_and_dining import item_size
from placegraph.tools.simulator.house_model import Item

AGAINST_WALL = ("bicycle", "guitar", "ironing board", "bench", "suitcase", "lamp")  # backs to the wall


def _item_at_wall(name: str, random: np.random.Generator, area_m2: float) -> Iterator[GroupLayout]:
    layout = GroupLayout("", random)
    layout.place_at_wall(layout.design(name), 0)
    yield layout


# placed as groups, before other furniture takes the space
GROUPS: dict[str, GroupBuilder] = {name: partial(_item_at_wall, name) for name in ("toilet", "bicycle")}


def draw_single_items(room_type: str, area_m2: float, random: np.random.Generator) -> Iterator[GroupLayout]:
    """Random single items for a room of a type, fewer where it is small."""
    for name, chance in CONTENTS["single_items"].get(room_type, CONTENTS["single_items"]["default"]):
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
