"""Small items on furniture: what usually stands on what, and how often."""

from __future__ import annotations

from placegraph.tools.simulator.furniture_groups import CONTENTS
from placegraph.tools.simulator.furniture_groups.group_layout import GroupLayout
from placegraph.tools.simulator.house_model import Item

HIGHEST_M = 2.1  # highest surface that gets items, a wardrobe's

SMALL_HEIGHTS_M: dict[str, tuple[float, float]] = CONTENTS["surface_heights_m"]


def small_item(layout: GroupLayout, name: str) -> Item:
    """An item of a class in a size that fits onto furniture."""
    if name not in SMALL_HEIGHTS_M:
        return layout.design(name)
    height = float(layout.random.uniform(*SMALL_HEIGHTS_M[name]))
    return layout.design(name, height_m=height, width_m=height * 1.3 if name == "box" else None)


def add_small_items(layout: GroupLayout) -> None:
    """Scatters small items on all furniture of a group that has surfaces for them."""
    for index, piece in enumerate(list(layout.pieces)):
        boards = piece.item.surfaces
        low = [k for k, surface in enumerate(boards) if piece.z + surface.z < HIGHEST_M]
        if not low:
            continue
        for name, chance, tries in CONTENTS["surface_items"].get(piece.item.name, ()):
            for _ in range(tries):
                if layout.random.random() < chance:
                    layout.scatter_on(index, small_item(layout, name), low)
