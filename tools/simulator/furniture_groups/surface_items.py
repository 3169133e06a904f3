"""Small items on furniture: what usually stands on what, and how often."""

from __future__ import annotations

from placegraph.tools.simulator.furniture_groups.group_layout import GroupLayout
from placegraph.tools.simulator.house_model import Item

HIGHEST_M = 2.1  # highest surface that gets items, a wardrobe's

# What may be on a piece: class, probability, number of draws.
SURFACE_ITEMS: dict[str, tuple[tuple[str, float, int], ...]] = {
    "table": (("bowl", 0.35, 1), ("vase", 0.28, 1), ("cup", 0.35, 3), ("bottle", 0.35, 1), ("book", 0.14, 1)),
    "coffee table": (("book", 0.42, 1), ("cup", 0.35, 2), ("bowl", 0.21, 1), ("vase", 0.17, 1)),
    "desk": (("cup", 0.35, 1), ("book", 0.35, 2), ("bottle", 0.14, 1), ("potted plant", 0.14, 1)),
    "nightstand": (("book", 0.28, 1), ("cup", 0.24, 1), ("bottle", 0.1, 1)),
    "kitchen counter": (("bowl", 0.28, 1), ("bottle", 0.35, 2), ("cup", 0.35, 2), ("vase", 0.07, 1)),
    "bookshelf": (("vase", 0.28, 1), ("book", 0.35, 2), ("potted plant", 0.28, 1), ("box", 0.28, 1), ("bowl", 0.14, 1)),
    "dresser": (("lamp", 0.24, 1), ("vase", 0.28, 1), ("potted plant", 0.24, 1), ("book", 0.28, 1), ("box", 0.17, 1)),
    "cabinet": (("vase", 0.24, 1), ("potted plant", 0.24, 1), ("bowl", 0.21, 1), ("book", 0.21, 1), ("box", 0.14, 1)),
    "wardrobe": (("box", 0.32, 2), ("suitcase", 0.1, 1)),
    "shoe rack": (("potted plant", 0.21, 1), ("box", 0.21, 1), ("bowl", 0.21, 1)),
    "bench": (("backpack", 0.24, 1), ("pillow", 0.35, 1)),
    "sofa": (("pillow", 0.49, 2), ("book", 0.1, 1), ("teddy bear", 0.07, 1)),
    "bed": (("pillow", 0.35, 1), ("teddy bear", 0.17, 1), ("book", 0.14, 1), ("backpack", 0.07, 1)),
    "armchair": (("pillow", 0.28, 1),),
    "washing machine": (("bottle", 0.35, 1), ("towel", 0.21, 1), ("box", 0.14, 1)),
    "piano": (("vase", 0.21, 1), ("book", 0.35, 1), ("lamp", 0.21, 1)),
    "refrigerator": (("box", 0.14, 1), ("potted plant", 0.1, 1)),
}
SMALL_HEIGHTS_M: dict[str, tuple[float, float]] = {  # heights of classes that also come in sizes for the floor
    "potted plant": (0.22, 0.34), "lamp": (0.34, 0.48), "box": (0.12, 0.24), "teddy bear": (0.2, 0.32),
    "vase": (0.16, 0.3),
}  # fmt: skip


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
        for name, chance, tries in SURFACE_ITEMS.get(piece.item.name, ()):
            for _ in range(tries):
                if layout.random.random() < chance:
                    layout.scatter_on(index, small_item(layout, name), low)
