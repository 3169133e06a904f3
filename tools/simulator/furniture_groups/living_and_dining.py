"""Furniture groups of living and dining rooms. Each function yields layouts, the most complete one first."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from placegraph.tools.simulator.furniture_groups.group_layout import WALL_GAP_M, GroupLayout
from placegraph.tools.simulator.house_model import Item

FACING_WALL, FACING_RIGHT, FACING_LEFT = np.pi, np.pi / 2, -np.pi / 2  # yaw of an item that faces this way
REACH_M = 0.3  # from a seat to the table before it


def item_size(item: Item) -> tuple[float, float, float]:
    """Width, depth and height of an item in metres."""
    width, depth, height = (item.extent[1] - item.extent[0]).tolist()
    return width, depth, height


def seating_area(random: np.random.Generator, area_m2: float) -> Iterator[GroupLayout]:
    """A sofa at a wall, a coffee table on a rug, armchairs at its ends, a lamp and a plant beside it."""
    for armchairs in (2, 1, 0) if area_m2 > 20 else (1, 0):
        layout = GroupLayout("seating area", random)
        sofa = layout.design("sofa", width_m=float(random.uniform(1.5, 2.2)) if area_m2 > 14 else 1.4)
        table = layout.design("coffee table")
        width, depth, _ = item_size(sofa)
        table_width, table_depth, _ = item_size(table)
        layout.place_at_wall(sofa, 0)
        front = -WALL_GAP_M - depth
        middle = front - REACH_M - table_depth / 2
        layout.place_free(table, 0, middle)
        if random.random() < 0.8:
            rug_width, rug_depth = max(table_width + 0.5, 1.2), table_depth + 0.6
            layout.place_free(layout.design("rug", width_m=rug_width, depth_m=rug_depth), 0, middle)
        armchair = layout.design("armchair")
        chair_width, chair_depth, _ = item_size(armchair)
        for side in random.permutation([-1, 1])[:armchairs].tolist():
            x = side * (table_width / 2 + REACH_M - 0.03 + chair_depth / 2)
            y = min(middle, front - 0.15 - chair_width / 2)
            layout.place_free(armchair, x, y, (FACING_LEFT if side > 0 else FACING_RIGHT) + random.uniform(-0.12, 0.12))
        _place_beside_sofa(layout, width / 2, random)
        yield layout


def _place_beside_sofa(layout: GroupLayout, half_width_m: float, random: np.random.Generator) -> None:
    """A floor lamp and perhaps a plant at the ends of a sofa."""
    side = float(random.choice([-1, 1]))
    if random.random() < 0.7:
        lamp = layout.design("lamp", height_m=float(random.uniform(1.35, 1.7)))
        layout.place_at_wall(lamp, side * (half_width_m + 0.08 + item_size(lamp)[0] / 2))
    if random.random() < 0.4:
        plant = layout.design("potted plant", height_m=float(random.uniform(0.6, 1.2)))
        layout.place_at_wall(plant, -side * (half_width_m + 0.08 + item_size(plant)[0] / 2))


def media_area(random: np.random.Generator, area_m2: float) -> Iterator[GroupLayout]:
    """A low cabinet with a television, and speakers on it or beside it."""
    for wide, min_width in ((True, 1.4), (False, 1.0), (False, 0.8)) if area_m2 > 14 else ((False, 1.0), (False, 0.8)):
        layout = GroupLayout("media area", random)
        width = min_width + float(random.uniform(0.0, 0.4 if wide else 0.2))
        cabinet = layout.place_at_wall(
            layout.design("cabinet", width_m=width, height_m=float(random.uniform(0.45, 0.6)), depth_m=0.4), 0
        )
        tv_width = min(float(random.uniform(0.8, 1.25)), width - 0.12)
        layout.place_on(cabinet, layout.design("tv", width_m=tv_width), 0, 0)
        tall = bool(random.random() < 0.5 and wide)
        speaker = layout.design("speaker", height_m=float(random.uniform(0.7, 1.0)) if tall else 0.28)
        for side in (-1, 1)[: 2 if wide else 1]:
            if tall:
                layout.place_at_wall(speaker, side * (width / 2 + 0.08 + item_size(speaker)[0] / 2))
            else:
                layout.place_on(cabinet, speaker, side * width / 2, 0)
        yield layout


def reading_area(random: np.random.Generator, area_m2: float) -> Iterator[GroupLayout]:
    """A bookshelf with an armchair, a floor lamp and sometimes a footstool beside it."""
    side = float(random.choice([-1, 1]))
    for full in (True, False):
        layout = GroupLayout("reading area", random)
        shelf = layout.design("bookshelf", width_m=float(random.uniform(0.7, 1.1 if area_m2 > 12 else 0.8)))
        edge = item_size(shelf)[0] / 2
        layout.place_at_wall(shelf, 0)
        if full:
            armchair = layout.design("armchair")
            width, depth, _ = item_size(armchair)
            x = side * (edge + 0.2 + width / 2)
            layout.place_free(armchair, x, -WALL_GAP_M - 0.14 - depth / 2, -side * random.uniform(0.05, 0.3))
            edge += 0.3 + width
            if random.random() < 0.5:
                stool = layout.design("stool", height_m=0.42)
                layout.place_free(
                    stool, x - side * 0.1, -0.4 - depth - item_size(stool)[1] / 2, random.uniform(-0.3, 0.3)
                )
        lamp = layout.design("lamp", height_m=float(random.uniform(1.35, 1.7)))
        layout.place_at_wall(lamp, side * (edge + 0.1 + item_size(lamp)[0] / 2))
        yield layout


def music_area(random: np.random.Generator, area_m2: float) -> Iterator[GroupLayout]:
    """A piano with its stool and a guitar; without space for a piano, a guitar and a stool."""
    side = float(random.choice([-1, 1]))
    for full in (True, False):
        layout = GroupLayout("music area", random)
        guitar, stool = layout.design("guitar"), layout.design("stool", height_m=0.5)
        if full:
            piano = layout.design("piano")
            width, depth, _ = item_size(piano)
            layout.place_at_wall(piano, 0)
            layout.place_free(stool, random.uniform(-0.1, 0.1), -WALL_GAP_M - depth - 0.08 - item_size(stool)[1] / 2)
            if random.random() < 0.65:
                layout.place_at_wall(guitar, side * (width / 2 + 0.12 + item_size(guitar)[0] / 2))
        else:
            layout.place_at_wall(guitar, 0)
            layout.place_at_wall(stool, side * (item_size(guitar)[0] / 2 + 0.15 + item_size(stool)[0] / 2))
            speaker = layout.design("speaker", height_m=float(random.uniform(0.4, 0.6)))
            layout.place_at_wall(speaker, -side * (item_size(guitar)[0] / 2 + 0.1 + item_size(speaker)[0] / 2))
        yield layout


def dining_area(random: np.random.Generator, area_m2: float) -> Iterator[GroupLayout]:
    """A table with chairs: free in the room, or with one side at a wall where there is less space."""
    lengths = (float(random.uniform(1.5, 2.0)), 1.3, 0.9) if area_m2 > 13 else (1.2, 0.9)
    for length in lengths:
        yield _table_with_chairs(random, length, float(random.uniform(0.8, 0.95)), False)
    for length in (1.2, 0.8):
        yield _table_with_chairs(random, length, 0.75, True)


def _table_with_chairs(random: np.random.Generator, length_m: float, depth_m: float, at_wall: bool) -> GroupLayout:
    layout = GroupLayout("dining area", random, backed=at_wall)
    table, chairs = layout.design("table", width_m=length_m, depth_m=depth_m), [layout.design("chair")] * 2
    if random.random() < 0.25:
        chairs[1] = layout.design("chair")  # chairs at the ends differ
    width, depth, _ = item_size(table)
    top = -WALL_GAP_M - depth / 2 if at_wall else 0.0
    layout.place_free(table, 0, top)
    tuck = float(random.uniform(0.12, 0.22))
    count = 2 if length_m >= 1.2 else 1
    for side in (-1,) if at_wall else (-1, 1):
        for x in (np.arange(count) - (count - 1) / 2) * width / count:
            away = depth / 2 + item_size(chairs[0])[1] / 2 - tuck + random.uniform(-0.04, 0.06)
            layout.place_free(
                chairs[0], x, top + side * away, (FACING_WALL if side < 0 else 0.0) + random.uniform(-0.08, 0.08)
            )
    # Chairs at the ends keep clear of those at the long sides.
    outermost = (count - 1) / 2 * width / count + item_size(chairs[0])[0] / 2 + 0.06
    for side in (-1, 1):
        if at_wall or random.random() < (0.5 if length_m < 1.8 else 0.75):
            away = max(width / 2 - min(tuck, 0.12), outermost) + item_size(chairs[1])[1] / 2
            yaw = FACING_LEFT if side > 0 else FACING_RIGHT
            layout.place_free(chairs[1], side * away, top, yaw + random.uniform(-0.08, 0.08))
    return layout


def play_area(random: np.random.Generator, area_m2: float) -> Iterator[GroupLayout]:
    """Toys along a wall: boxes, a teddy bear, balls, cushions; two rows in a large room."""
    for rows in (2, 1) if area_m2 > 9 and random.random() < 0.4 else (1,):
        layout = GroupLayout("play area", random)
        for row in range(rows):
            names = (
                ["teddy bear", "pillow" if random.random() < 0.5 else "box", "ball"]
                if row == 0
                else ["ball", "box", "box"]
            )
            x = float(random.uniform(-0.1, 0.1)) - 0.6
            for name in random.permutation(names).tolist():
                item = layout.design(name)
                width, depth, _ = item_size(item)
                reach = float(np.hypot(width, depth)) / 2  # for any yaw
                x += reach + 0.04
                layout.place_free(
                    item, x, -WALL_GAP_M - 0.3 - 0.62 * row, random.uniform(-0.4, 0.4) if width < 0.55 else 0.0
                )
                x += reach + float(random.uniform(0.02, 0.12))
        yield layout


GROUPS = {
    layouts.__name__: layouts
    for layouts in (seating_area, media_area, reading_area, music_area, dining_area, play_area)
}
