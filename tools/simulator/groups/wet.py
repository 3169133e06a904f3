"""Groups of kitchens, bathrooms and laundries: cooking, washing, bathing, laundry; each gives drafts, fullest first."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from placegraph.tools.simulator.groups.draft import WALL_GAP_M, Draft
from placegraph.tools.simulator.groups.living import size_of
from placegraph.tools.simulator.model import ON_WALL

COUNTER_M = {"depth_m": 0.6, "height_m": 0.9}
APPLIANCES = ("microwave", "kettle", "toaster", "coffee machine")


def cooking_area(random: np.random.Generator, area_m2: float) -> Iterator[Draft]:
    """A kitchen run along a wall: refrigerator, counters, sink, stove, with appliances on the counters."""
    order = random.permutation(2).tolist()
    hand = float(random.choice([-1, 1]))
    sizes = ((1.2, 1.2), (0.9, 0.9), (0.9, 0.6), (0.6, 0.4), (0.6, 0.0), (0.4, 0.0))
    for first, second, mirrored in ((*size, side * hand) for size in sizes for side in (1, -1)):
        draft, x = Draft("cooking area", random), 0.0
        basin = draft.design("sink", width_m=0.8 if second else 0.6, depth_m=0.6, height_m=1.13)  # the tap counts
        stove = draft.design("stove", width_m=0.6, **COUNTER_M)
        items = [
            draft.design("refrigerator", depth_m=0.62, width_m=None if second else 0.6),
            *[(basin, stove)[k] for k in order],
        ]
        tops = [draft.design("kitchen counter", width_m=one, **COUNTER_M) if one else None for one in (first, second)]
        counters = []
        for item in (items[0], tops[0], items[1], tops[1], items[2]):
            if item is None:
                continue
            width = size_of(item)[0]
            index = draft.back(item, mirrored * (x + width / 2))
            counters += [index] if item.name == "kitchen counter" else []
            x += width + 0.01
        for name in (APPLIANCES[0], *random.permutation(APPLIANCES[1:]).tolist()):  # the largest first
            if random.random() < 0.9:
                item = draft.design(name)
                for counter in random.permutation(counters).tolist():
                    half = size_of(draft.pieces[counter].item)[0] / 2
                    if any(draft.put(counter, item, float(random.uniform(-half, half)), 0.12) for _ in range(8)):
                        break
        yield draft


def washing_area(random: np.random.Generator, area_m2: float) -> Iterator[Draft]:
    """A washbasin with a mirror above, a towel and perhaps a trash can beside it."""
    side = float(random.choice([-1, 1]))
    for full in (True, False):
        draft = Draft("washing area", random)
        basin = draft.design("sink", width_m=float(random.uniform(0.5, 0.65)), depth_m=0.45, height_m=0.95)
        width, _, height = size_of(basin)
        draft.back(basin, 0)
        mirror = draft.design("mirror", width_m=width - 0.06, height_m=float(random.uniform(0.55, 0.8)))
        draft.stand(
            mirror, 0, -0.006 - size_of(mirror)[1] / 2, on=ON_WALL, z=height + float(random.uniform(0.25, 0.35))
        )
        if full:
            towel = draft.design("towel", width_m=0.45, height_m=0.65, depth_m=0.08)
            draft.stand(towel, side * (width / 2 + 0.3), -0.006 - size_of(towel)[1] / 2, on=ON_WALL, z=0.75)
            if random.random() < 0.5:
                can = draft.design("trash can", height_m=0.3, width_m=0.22, depth_m=0.22)
                draft.back(can, -side * (width / 2 + 0.06 + 0.11))
        yield draft


def bathing_area(random: np.random.Generator, area_m2: float) -> Iterator[Draft]:
    """A bathtub along a wall or a shower, with a rug before it."""
    names = ("bathtub", "shower") if random.random() < 0.55 and area_m2 > 4.5 else ("shower",)
    for name in names:
        for depth in (float(random.uniform(0.5, 0.6)), 0.42):
            draft = Draft("bathing area", random)
            item = draft.design(name, width_m=None if name == "shower" else float(random.uniform(1.5, 1.7)))
            tub_width, tub_depth, _ = size_of(item)
            draft.back(item, 0)
            rug = draft.design("rug", width_m=min(0.8, tub_width), depth_m=depth)
            draft.stand(rug, 0, -WALL_GAP_M - tub_depth - 0.06 - depth / 2)
            yield draft


def laundry_area(random: np.random.Generator, area_m2: float) -> Iterator[Draft]:
    """A washing machine, a laundry basket and an ironing board in a row along a wall; at least the machine."""
    side = float(random.choice([-1, 1]))
    for board_yaw in (*random.permutation([0.0, np.pi / 2]).tolist(), None):  # along the wall, across, none
        draft = Draft("laundry area", random)
        machine, basket = draft.design("washing machine"), draft.design("laundry basket")
        x = size_of(machine)[0] / 2
        draft.back(machine, 0)
        draft.back(basket, side * (x + 0.08 + size_of(basket)[0] / 2))
        if board_yaw is not None:
            board = draft.design("ironing board", width_m=float(random.uniform(1.15, 1.3)))
            long, short, _ = size_of(board)
            wide, deep = (long, short) if board_yaw == 0 else (short, long)
            draft.stand(board, -side * (x + 0.12 + wide / 2), -WALL_GAP_M - deep / 2, board_yaw)
        yield draft
    alone = Draft("", random)
    alone.back(alone.design("washing machine"), 0)
    yield alone
