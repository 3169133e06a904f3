"""Groups of living and dining rooms: seating, media, reading, music, dining, play; each gives drafts, fullest first."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from placegraph.tools.simulator.groups.draft import WALL_GAP_M, Draft
from placegraph.tools.simulator.model import Item

FACING_WALL, FACING_RIGHT, FACING_LEFT = np.pi, np.pi / 2, -np.pi / 2  # yaw of an item that looks that way
REACH_M = 0.3  # from a seat to the table before it


def size_of(item: Item) -> tuple[float, float, float]:
    """Width, depth and height of an item in metres."""
    width, depth, height = (item.extent[1] - item.extent[0]).tolist()
    return width, depth, height


def seating_area(random: np.random.Generator, area_m2: float) -> Iterator[Draft]:
    """A sofa at a wall, a coffee table before it on a rug, armchairs at its ends, a lamp and a plant beside it."""
    for armchairs in (2, 1, 0) if area_m2 > 20 else (1, 0):
        draft = Draft("seating area", random)
        sofa = draft.design("sofa", width_m=float(random.uniform(1.5, 2.2)) if area_m2 > 14 else 1.4)
        table = draft.design("coffee table")
        width, depth, _ = size_of(sofa)
        table_width, table_depth, _ = size_of(table)
        draft.back(sofa, 0)
        front = -WALL_GAP_M - depth
        middle = front - REACH_M - table_depth / 2
        draft.stand(table, 0, middle)
        if random.random() < 0.8:
            rug_width, rug_depth = max(table_width + 0.5, 1.2), table_depth + 0.6
            draft.stand(draft.design("rug", width_m=rug_width, depth_m=rug_depth), 0, middle)
        armchair = draft.design("armchair")
        chair_width, chair_depth, _ = size_of(armchair)
        for side in random.permutation([-1, 1])[:armchairs].tolist():
            x = side * (table_width / 2 + REACH_M - 0.03 + chair_depth / 2)
            y = min(middle, front - 0.15 - chair_width / 2)
            draft.stand(armchair, x, y, (FACING_LEFT if side > 0 else FACING_RIGHT) + random.uniform(-0.12, 0.12))
        _beside(draft, width / 2, random)
        yield draft


def _beside(draft: Draft, half_width_m: float, random: np.random.Generator) -> None:
    """A floor lamp and perhaps a plant at the ends of a sofa."""
    side = float(random.choice([-1, 1]))
    if random.random() < 0.7:
        lamp = draft.design("lamp", height_m=float(random.uniform(1.35, 1.7)))
        draft.back(lamp, side * (half_width_m + 0.08 + size_of(lamp)[0] / 2))
    if random.random() < 0.4:
        plant = draft.design("potted plant", height_m=float(random.uniform(0.6, 1.2)))
        draft.back(plant, -side * (half_width_m + 0.08 + size_of(plant)[0] / 2))


def media_area(random: np.random.Generator, area_m2: float) -> Iterator[Draft]:
    """A low cabinet with a television on it and speakers on it or beside it."""
    for wide, least in ((True, 1.4), (False, 1.0), (False, 0.8)) if area_m2 > 14 else ((False, 1.0), (False, 0.8)):
        draft = Draft("media area", random)
        width = least + float(random.uniform(0.0, 0.4 if wide else 0.2))
        cabinet = draft.back(
            draft.design("cabinet", width_m=width, height_m=float(random.uniform(0.45, 0.6)), depth_m=0.4), 0
        )
        tv_width = min(float(random.uniform(0.8, 1.25)), width - 0.12)
        draft.put(cabinet, draft.design("tv", width_m=tv_width), 0, 0)
        tall = bool(random.random() < 0.5 and wide)
        speaker = draft.design("speaker", height_m=float(random.uniform(0.7, 1.0)) if tall else 0.28)
        for side in (-1, 1)[: 2 if wide else 1]:
            if tall:
                draft.back(speaker, side * (width / 2 + 0.08 + size_of(speaker)[0] / 2))
            else:
                draft.put(cabinet, speaker, side * width / 2, 0)
        yield draft


def reading_area(random: np.random.Generator, area_m2: float) -> Iterator[Draft]:
    """A bookshelf with an armchair, a floor lamp and sometimes a footstool beside it."""
    side = float(random.choice([-1, 1]))
    for full in (True, False):
        draft = Draft("reading area", random)
        shelf = draft.design("bookshelf", width_m=float(random.uniform(0.7, 1.1 if area_m2 > 12 else 0.8)))
        edge = size_of(shelf)[0] / 2
        draft.back(shelf, 0)
        if full:
            armchair = draft.design("armchair")
            width, depth, _ = size_of(armchair)
            x = side * (edge + 0.2 + width / 2)
            draft.stand(armchair, x, -WALL_GAP_M - 0.14 - depth / 2, -side * random.uniform(0.05, 0.3))
            edge += 0.3 + width
            if random.random() < 0.5:
                stool = draft.design("stool", height_m=0.42)
                draft.stand(stool, x - side * 0.1, -0.4 - depth - size_of(stool)[1] / 2, random.uniform(-0.3, 0.3))
        lamp = draft.design("lamp", height_m=float(random.uniform(1.35, 1.7)))
        draft.back(lamp, side * (edge + 0.1 + size_of(lamp)[0] / 2))
        yield draft


def music_area(random: np.random.Generator, area_m2: float) -> Iterator[Draft]:
    """A piano with its stool, a guitar beside it; where there is no room for a piano a guitar and a stool."""
    side = float(random.choice([-1, 1]))
    for full in (True, False):
        draft = Draft("music area", random)
        guitar, stool = draft.design("guitar"), draft.design("stool", height_m=0.5)
        if full:
            piano = draft.design("piano")
            width, depth, _ = size_of(piano)
            draft.back(piano, 0)
            draft.stand(stool, random.uniform(-0.1, 0.1), -WALL_GAP_M - depth - 0.08 - size_of(stool)[1] / 2)
            if random.random() < 0.65:
                draft.back(guitar, side * (width / 2 + 0.12 + size_of(guitar)[0] / 2))
        else:
            draft.back(guitar, 0)
            draft.back(stool, side * (size_of(guitar)[0] / 2 + 0.15 + size_of(stool)[0] / 2))
            speaker = draft.design("speaker", height_m=float(random.uniform(0.4, 0.6)))
            draft.back(speaker, -side * (size_of(guitar)[0] / 2 + 0.1 + size_of(speaker)[0] / 2))
        yield draft


def dining_area(random: np.random.Generator, area_m2: float) -> Iterator[Draft]:
    """A table with chairs drawn up to it: free in the room, or with one end at a wall where there is less of it."""
    lengths = (float(random.uniform(1.5, 2.0)), 1.3, 0.9) if area_m2 > 13 else (1.2, 0.9)
    for length in lengths:
        yield _table_with_chairs(random, length, float(random.uniform(0.8, 0.95)), False)
    for length in (1.2, 0.8):
        yield _table_with_chairs(random, length, 0.75, True)


def _table_with_chairs(random: np.random.Generator, length_m: float, depth_m: float, at_wall: bool) -> Draft:
    draft = Draft("dining area", random, backed=at_wall)
    table, chairs = draft.design("table", width_m=length_m, depth_m=depth_m), [draft.design("chair")] * 2
    if random.random() < 0.25:
        chairs[1] = draft.design("chair")  # the ends have another kind than the long sides
    width, depth, _ = size_of(table)
    top = -WALL_GAP_M - depth / 2 if at_wall else 0.0
    draft.stand(table, 0, top)
    tuck = float(random.uniform(0.12, 0.22))
    count = 2 if length_m >= 1.2 else 1
    for side in (-1,) if at_wall else (-1, 1):
        for x in (np.arange(count) - (count - 1) / 2) * width / count:
            away = depth / 2 + size_of(chairs[0])[1] / 2 - tuck + random.uniform(-0.04, 0.06)
            draft.stand(
                chairs[0], x, top + side * away, (FACING_WALL if side < 0 else 0.0) + random.uniform(-0.08, 0.08)
            )
    # The ends' chairs stop where those of the long sides, a little turned, begin.
    outermost = (count - 1) / 2 * width / count + size_of(chairs[0])[0] / 2 + 0.06
    for side in (-1, 1):
        if at_wall or random.random() < (0.5 if length_m < 1.8 else 0.75):
            away = max(width / 2 - min(tuck, 0.12), outermost) + size_of(chairs[1])[1] / 2
            yaw = FACING_LEFT if side > 0 else FACING_RIGHT
            draft.stand(chairs[1], side * away, top, yaw + random.uniform(-0.08, 0.08))
    return draft


def play_area(random: np.random.Generator, area_m2: float) -> Iterator[Draft]:
    """Toys along a wall: boxes, a teddy bear, balls, cushions; two rows where the room is large."""
    for rows in (2, 1) if area_m2 > 9 and random.random() < 0.4 else (1,):
        draft = Draft("play area", random)
        for row in range(rows):
            names = (
                ["teddy bear", "pillow" if random.random() < 0.5 else "box", "ball"]
                if row == 0
                else ["ball", "box", "box"]
            )
            x = float(random.uniform(-0.1, 0.1)) - 0.6
            for name in random.permutation(names).tolist():
                item = draft.design(name)
                width, depth, _ = size_of(item)
                reach = float(np.hypot(width, depth)) / 2  # whichever way it is turned
                x += reach + 0.04
                draft.stand(item, x, -WALL_GAP_M - 0.3 - 0.62 * row, random.uniform(-0.4, 0.4) if width < 0.55 else 0.0)
                x += reach + float(random.uniform(0.02, 0.12))
        yield draft
