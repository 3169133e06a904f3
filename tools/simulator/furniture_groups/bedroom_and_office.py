"""Furniture groups of bedrooms, offices and hallways. Each function yields layouts, the most complete one first."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from placegraph.tools.simulator.furniture_groups.group_layout import WALL_GAP_M, GroupLayout
from placegraph.tools.simulator.furniture_groups.living_and_dining import FACING_WALL, item_size
from placegraph.tools.simulator.house_model import ON_WALL


def sleeping_area(random: np.random.Generator, area_m2: float) -> Iterator[GroupLayout]:
    """A bed with its head at the wall, nightstands with lamps, and a rug under its foot."""
    widths = ((1.6, 2), (1.4, 1), (0.9, 1)) if area_m2 > 11 else ((1.2, 1), (0.9, 1), (0.9, 0))
    for bed_width, stands in widths:
        layout = GroupLayout("sleeping area", random)
        bed = layout.design("bed", width_m=bed_width + float(random.uniform(0, 0.15)))
        width, depth, _ = item_size(bed)
        layout.place_at_wall(bed, 0)
        nightstand = layout.design("nightstand")
        lamp = layout.design("lamp", height_m=float(random.uniform(0.35, 0.5)))
        for side in random.permutation([-1, 1])[:stands].tolist():
            x = side * (width / 2 + 0.06 + item_size(nightstand)[0] / 2)
            carrier = layout.place_at_wall(nightstand, x)
            layout.place_on(carrier, lamp, -side * 0.05, 0.06)
        if stands:
            rug = layout.design(
                "rug", width_m=width + 2 * float(random.uniform(0.15, 0.35)), depth_m=float(random.uniform(1.1, 1.4))
            )
            layout.place_free(rug, 0, -WALL_GAP_M - depth + 0.35)
        yield layout


def storage_area(random: np.random.Generator, area_m2: float) -> Iterator[GroupLayout]:
    """A wardrobe and a dresser side by side."""
    side = float(random.choice([-1, 1]))
    for wide in (1.5, 1.0, 0.8):
        if wide > 1.2 and area_m2 < 12:
            continue
        layout = GroupLayout("storage area", random)
        wardrobe = layout.design("wardrobe", width_m=wide)
        dresser = layout.design("dresser", width_m=float(random.uniform(0.7, 0.7 + 0.3 * wide)))
        layout.place_at_wall(wardrobe, 0)
        layout.place_at_wall(dresser, side * (wide / 2 + 0.08 + item_size(dresser)[0] / 2))
        yield layout


def cupboard_area(random: np.random.Generator, area_m2: float) -> Iterator[GroupLayout]:
    """A cabinet beside a bookshelf or dresser, for rooms that are no bedrooms."""
    side = float(random.choice([-1, 1]))
    for width in (1.2, 0.8):
        layout = GroupLayout("storage area", random)
        first = layout.design("cabinet", width_m=width, height_m=float(random.uniform(0.75, 1.0)))
        second = layout.design("bookshelf" if random.random() < 0.6 else "dresser", width_m=0.8 * width)
        layout.place_at_wall(first, 0)
        layout.place_at_wall(second, side * (width / 2 + 0.08 + item_size(second)[0] / 2))
        yield layout


def work_area(random: np.random.Generator, area_m2: float) -> Iterator[GroupLayout]:
    """A desk with its chair and a computer, a printer or a trash can beside it."""
    side = float(random.choice([-1, 1]))
    for width in (1.5, 1.2, 0.95):
        if width > 1.3 and area_m2 < 12:
            continue
        layout = GroupLayout("work area", random)
        desk = layout.design("desk", width_m=width, depth_m=0.7 if width > 1 else 0.55)
        carrier = layout.place_at_wall(desk, 0)
        chair = layout.design("office chair")
        depth = item_size(desk)[1]
        y = -WALL_GAP_M - depth - item_size(chair)[1] / 2 + 0.12
        layout.place_free(chair, random.uniform(-0.1, 0.1), y, FACING_WALL + random.uniform(-0.35, 0.35))
        _place_computer(layout, carrier, width, side)
        if random.random() < 0.6 and width > 1:
            can = layout.design("trash can", height_m=float(random.uniform(0.3, 0.45)))
            layout.place_at_wall(can, -side * (width / 2 + 0.06 + item_size(can)[0] / 2))
        if random.random() < 0.65 and width > 1:
            cabinet = layout.design("cabinet", width_m=0.6, depth_m=0.46, height_m=0.65)
            base = layout.place_at_wall(cabinet, side * (width / 2 + 0.08 + 0.3))
            layout.place_on(base, layout.design("printer", width_m=0.44, depth_m=0.35), 0, 0)
        yield layout


def _place_computer(layout: GroupLayout, desk: int, width_m: float, side: float) -> None:
    """A monitor with a keyboard, or a laptop, or both, and a lamp."""
    random = layout.random
    kind = random.random()
    if kind < 0.8:
        shift = -side * 0.12 * width_m
        layout.place_on(desk, layout.design("monitor", width_m=float(random.uniform(0.5, 0.65))), shift, 0.2)
        layout.place_on(desk, layout.design("keyboard", width_m=float(random.uniform(0.36, 0.45))), shift, -0.2)
    if kind > 0.45:
        layout.place_on(
            desk, layout.design("laptop"), side * width_m * (0.35 if kind < 0.8 else 0.0), -0.1, -side * 0.2
        )
    if random.random() < 0.7:
        layout.place_on(desk, layout.design("lamp", height_m=float(random.uniform(0.35, 0.5))), side * width_m / 2, 0.3)
    elif random.random() < 0.5:
        layout.place_on(desk, layout.design("speaker", height_m=0.22), side * width_m / 2, 0.3)


def entrance_area(random: np.random.Generator, area_m2: float) -> Iterator[GroupLayout]:
    """A shoe rack, a coat rack and a bench in a row, with a mirror above the rack."""
    for names in (("shoe rack", "coat rack", "bench"), ("coat rack", "shoe rack"), ("coat rack", "bench")):
        layout, x = GroupLayout("entrance area", random), 0.0
        for name in random.permutation(names).tolist():
            item = layout.design(name, depth_m=None if name == "coat rack" else 0.32)
            width = item_size(item)[0]
            layout.place_at_wall(item, x + width / 2)
            if (
                name != "coat rack"
                and random.random() < 0.5
                and not any(piece.on == ON_WALL for piece in layout.pieces)
            ):
                mirror = layout.design(
                    "mirror", width_m=min(0.5, width - 0.1), height_m=float(random.uniform(0.7, 0.9))
                )
                layout.place_free(
                    mirror,
                    x + width / 2,
                    -0.006 - item_size(mirror)[1] / 2,
                    on=ON_WALL,
                    z=max(item_size(item)[2] + 0.1, 1.0),
                )
            x += width + float(random.uniform(0.06, 0.15))
        yield layout


GROUPS = {
    layouts.__name__: layouts for layouts in (sleeping_area, storage_area, cupboard_area, work_area, entrance_area)
}
