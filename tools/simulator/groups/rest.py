"""Groups of bedrooms, offices and hallways: sleeping, storage, work, entrance; each gives drafts, fullest first."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from placegraph.tools.simulator.groups.draft import WALL_GAP_M, Draft
from placegraph.tools.simulator.groups.living import FACING_WALL, size_of
from placegraph.tools.simulator.model import ON_WALL


def sleeping_area(random: np.random.Generator, area_m2: float) -> Iterator[Draft]:
    """A bed, its head at the wall, nightstands with lamps beside it, a rug under its foot."""
    widths = ((1.6, 2), (1.4, 1), (0.9, 1)) if area_m2 > 11 else ((1.2, 1), (0.9, 1), (0.9, 0))
    for bed_width, stands in widths:
        draft = Draft("sleeping area", random)
        bed = draft.design("bed", width_m=bed_width + float(random.uniform(0, 0.15)))
        width, depth, _ = size_of(bed)
        draft.back(bed, 0)
        nightstand = draft.design("nightstand")
        lamp = draft.design("lamp", height_m=float(random.uniform(0.35, 0.5)))
        for side in random.permutation([-1, 1])[:stands].tolist():
            x = side * (width / 2 + 0.06 + size_of(nightstand)[0] / 2)
            carrier = draft.back(nightstand, x)
            draft.put(carrier, lamp, -side * 0.05, 0.06)
        if stands:
            rug = draft.design(
                "rug", width_m=width + 2 * float(random.uniform(0.15, 0.35)), depth_m=float(random.uniform(1.1, 1.4))
            )
            draft.stand(rug, 0, -WALL_GAP_M - depth + 0.35)
        yield draft


def storage_area(random: np.random.Generator, area_m2: float) -> Iterator[Draft]:
    """A wardrobe and a dresser side by side."""
    side = float(random.choice([-1, 1]))
    for wide in (1.5, 1.0, 0.8):
        if wide > 1.2 and area_m2 < 12:
            continue
        draft = Draft("storage area", random)
        wardrobe = draft.design("wardrobe", width_m=wide)
        dresser = draft.design("dresser", width_m=float(random.uniform(0.7, 0.7 + 0.3 * wide)))
        draft.back(wardrobe, 0)
        draft.back(dresser, side * (wide / 2 + 0.08 + size_of(dresser)[0] / 2))
        yield draft


def cupboard_area(random: np.random.Generator, area_m2: float) -> Iterator[Draft]:
    """A cabinet beside a bookshelf or another cabinet, for rooms where nobody dresses."""
    side = float(random.choice([-1, 1]))
    for width in (1.2, 0.8):
        draft = Draft("storage area", random)
        first = draft.design("cabinet", width_m=width, height_m=float(random.uniform(0.75, 1.0)))
        second = draft.design("bookshelf" if random.random() < 0.6 else "dresser", width_m=0.8 * width)
        draft.back(first, 0)
        draft.back(second, side * (width / 2 + 0.08 + size_of(second)[0] / 2))
        yield draft


def work_area(random: np.random.Generator, area_m2: float) -> Iterator[Draft]:
    """A desk with its chair, a computer on it, a printer or a trash can beside it."""
    side = float(random.choice([-1, 1]))
    for width in (1.5, 1.2, 0.95):
        if width > 1.3 and area_m2 < 12:
            continue
        draft = Draft("work area", random)
        desk = draft.design("desk", width_m=width, depth_m=0.7 if width > 1 else 0.55)
        carrier = draft.back(desk, 0)
        chair = draft.design("office chair")
        depth = size_of(desk)[1]
        y = -WALL_GAP_M - depth - size_of(chair)[1] / 2 + 0.12
        draft.stand(chair, random.uniform(-0.1, 0.1), y, FACING_WALL + random.uniform(-0.35, 0.35))
        _computer(draft, carrier, width, side)
        if random.random() < 0.6 and width > 1:
            can = draft.design("trash can", height_m=float(random.uniform(0.3, 0.45)))
            draft.back(can, -side * (width / 2 + 0.06 + size_of(can)[0] / 2))
        if random.random() < 0.65 and width > 1:
            cabinet = draft.design("cabinet", width_m=0.6, depth_m=0.46, height_m=0.65)
            base = draft.back(cabinet, side * (width / 2 + 0.08 + 0.3))
            draft.put(base, draft.design("printer", width_m=0.44, depth_m=0.35), 0, 0)
        yield draft


def _computer(draft: Draft, desk: int, width_m: float, side: float) -> None:
    """A monitor with a keyboard, or a laptop, or both, and a lamp."""
    random = draft.random
    kind = random.random()
    if kind < 0.8:
        shift = -side * 0.12 * width_m
        draft.put(desk, draft.design("monitor", width_m=float(random.uniform(0.5, 0.65))), shift, 0.2)
        draft.put(desk, draft.design("keyboard", width_m=float(random.uniform(0.36, 0.45))), shift, -0.2)
    if kind > 0.45:
        draft.put(desk, draft.design("laptop"), side * width_m * (0.35 if kind < 0.8 else 0.0), -0.1, -side * 0.2)
    if random.random() < 0.7:
        draft.put(desk, draft.design("lamp", height_m=float(random.uniform(0.35, 0.5))), side * width_m / 2, 0.3)
    elif random.random() < 0.5:
        draft.put(desk, draft.design("speaker", height_m=0.22), side * width_m / 2, 0.3)


def entrance_area(random: np.random.Generator, area_m2: float) -> Iterator[Draft]:
    """A shoe rack, a coat rack and a bench in a row, a mirror above the rack."""
    for names in (("shoe rack", "coat rack", "bench"), ("coat rack", "shoe rack"), ("coat rack", "bench")):
        draft, x = Draft("entrance area", random), 0.0
        for name in random.permutation(names).tolist():
            item = draft.design(name, depth_m=None if name == "coat rack" else 0.32)
            width = size_of(item)[0]
            draft.back(item, x + width / 2)
            if name != "coat rack" and random.random() < 0.5 and not any(one.on == ON_WALL for one in draft.pieces):
                mirror = draft.design("mirror", width_m=min(0.5, width - 0.1), height_m=float(random.uniform(0.7, 0.9)))
                draft.stand(
                    mirror,
                    x + width / 2,
                    -0.006 - size_of(mirror)[1] / 2,
                    on=ON_WALL,
                    z=max(size_of(item)[2] + 0.1, 1.0),
                )
            x += width + float(random.uniform(0.06, 0.15))
        yield draft
