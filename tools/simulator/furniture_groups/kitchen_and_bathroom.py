"""Furniture groups of kitchens, bathrooms and laundries. Each function yields layouts, the most complete one first."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from placegraph.tools.simulator.furniture_groups.group_layout import WALL_GAP_M, GroupLayout
from placegraph.tools.simulator.furniture_groups.living_and_dining import item_size
from placegraph.tools.simulator.house_model import ON_WALL

COUNTER_M = {"depth_m": 0.6, "height_m": 0.9}
APPLIANCES = ("microwave", "kettle", "toaster", "coffee machine")


def cooking_area(random: np.random.Generator, area_m2: float) -> Iterator[GroupLayout]:
    """A kitchen run along a wall: refrigerator, counters, sink and stove, with appliances on the counters."""
    order = random.permutation(2).tolist()
    hand = float(random.choice([-1, 1]))
    sizes = ((1.2, 1.2), (0.9, 0.9), (0.9, 0.6), (0.6, 0.4), (0.6, 0.0), (0.4, 0.0))
    for first, second, mirrored in ((*size, side * hand) for size in sizes for side in (1, -1)):
        layout, x = GroupLayout("cooking area", random), 0.0
        basin = layout.design(
            "sink", width_m=0.8 if second else 0.6, depth_m=0.6, height_m=1.13
        )  # the height includes the tap
        stove = layout.design("stove", width_m=0.6, **COUNTER_M)
        items = [
            layout.design("refrigerator", depth_m=0.62, width_m=None if second else 0.6),
            *[(basin, stove)[k] for k in order],
        ]
        tops = [
            layout.design("kitchen counter", width_m=width_m, **COUNTER_M) if width_m else None
            for width_m in (first, second)
        ]
        counters = []
        for item in (items[0], tops[0], items[1], tops[1], items[2]):
            if item is None:
                continue
            width = item_size(item)[0]
            index = layout.place_at_wall(item, mirrored * (x + width / 2))
            counters += [index] if item.name == "kitchen counter" else []
            x += width + 0.01
        for name in (APPLIANCES[0], *random.permutation(APPLIANCES[1:]).tolist()):  # the largest first
            if random.random() < 0.9:
                item = layout.design(name)
                for counter in random.permutation(counters).tolist():
                    half = item_size(layout.pieces[counter].item)[0] / 2
                    if any(layout.place_on(counter, item, float(random.uniform(-half, half)), 0.12) for _ in range(8)):
                        break
        yield layout


def washing_area(random: np.random.Generator, area_m2: float) -> Iterator[GroupLayout]:
    """A washbasin with a mirror above, a towel and perhaps a trash can beside it."""
    side = float(random.choice([-1, 1]))
    for full in (True, False):
        layout = GroupLayout("washing area", random)
        basin = layout.design("sink", width_m=float(random.uniform(0.5, 0.65)), depth_m=0.45, height_m=0.95)
        width, _, height = item_size(basin)
        layout.place_at_wall(basin, 0)
        mirror = layout.design("mirror", width_m=width - 0.06, height_m=float(random.uniform(0.55, 0.8)))
        layout.place_free(
            mirror, 0, -0.006 - item_size(mirror)[1] / 2, on=ON_WALL, z=height + float(random.uniform(0.25, 0.35))
        )
        if full:
            towel = layout.design("towel", width_m=0.45, height_m=0.65, depth_m=0.08)
            layout.place_free(towel, side * (width / 2 + 0.3), -0.006 - item_size(towel)[1] / 2, on=ON_WALL, z=0.75)
            if random.random() < 0.5:
                can = layout.design("trash can", height_m=0.3, width_m=0.22, depth_m=0.22)
                layout.place_at_wall(can, -side * (width / 2 + 0.06 + 0.11))
        yield layout


def bathing_area(random: np.random.Generator, area_m2: float) -> Iterator[GroupLayout]:
    """A bathtub along a wall or a shower, with a rug in front of it."""
    names = ("bathtub", "shower") if random.random() < 0.55 and area_m2 > 4.5 else ("shower",)
    for name in names:
        for depth in (float(random.uniform(0.5, 0.6)), 0.42):
            layout = GroupLayout("bathing area", random)
            item = layout.design(name, width_m=None if name == "shower" else float(random.uniform(1.5, 1.7)))
            tub_width, tub_depth, _ = item_size(item)
            layout.place_at_wall(item, 0)
            rug = layout.design("rug", width_m=min(0.8, tub_width), depth_m=depth)
            layout.place_free(rug, 0, -WALL_GAP_M - tub_depth - 0.06 - depth / 2)
            yield layout


def laundry_area(random: np.random.Generator, area_m2: float) -> Iterator[GroupLayout]:
    """A washing machine, a laundry basket and an ironing board along a wall; at least the machine."""
    side = float(random.choice([-1, 1]))
    for board_yaw in (*random.permutation([0.0, np.pi / 2]).tolist(), None):  # along the wall, across, none
        layout = GroupLayout("laundry area", random)
        machine, basket = layout.design("washing machine"), layout.design("laundry basket")
        x = item_size(machine)[0] / 2
        layout.place_at_wall(machine, 0)
        layout.place_at_wall(basket, side * (x + 0.08 + item_size(basket)[0] / 2))
        if board_yaw is not None:
            board = layout.design("ironing board", width_m=float(random.uniform(1.15, 1.3)))
            long, short, _ = item_size(board)
            wide, deep = (long, short) if board_yaw == 0 else (short, long)
            layout.place_free(board, -side * (x + 0.12 + wide / 2), -WALL_GAP_M - deep / 2, board_yaw)
        yield layout
    alone = GroupLayout("", random)
    alone.place_at_wall(alone.design("washing machine"), 0)
    yield alone


GROUPS = {layouts.__name__: layouts for layouts in (cooking_area, washing_area, bathing_area, laundry_area)}
