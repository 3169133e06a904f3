"""What hangs on walls and ceilings or is at windows: pictures, clocks, mirrors, towels, lamps, curtains, radiators."""

from __future__ import annotations

import numpy as np

from placegraph.tools.simulator.catalogue import design
from placegraph.tools.simulator.model import NOWHERE, ON_CEILING, ON_WALL, House, Item, PlacedItem
from placegraph.tools.simulator.sides import Gap, Side
from placegraph.tools.simulator.site import Site
from placegraph.tools.simulator.space import inside

OFF_WALL_M = 0.006  # a lining must not show through
CORNER_M = 0.1
MIDDLE_M = 1.5  # height of the middle of pictures: eye level
COLD_ROOMS = ("hallway", "corridor")

Random = np.random.Generator


def hang_all(site: Site, house: House, random: Random, first_id: int) -> list[PlacedItem]:
    """Everything on the walls and the ceiling of one room, ids from `first_id`; the site notes it, too."""
    start = len(site.items)
    _windows(site, random, first_id)
    for name, count in _wall_things(site.room.type, float(random.random()), random):
        for _ in range(count):
            item, z = _wall_item(name, random)
            placed = _somewhere(site, item, z, random, first_id + len(site.items) - start)
            if placed is not None:
                site.add([placed])
    _lamps(site, house, random, first_id + len(site.items) - start)
    return site.items[start:]


def _wall_things(room_type: str, luck: float, random: Random) -> list[tuple[str, int]]:
    """Classes and how many of each to hang in a room."""
    if room_type in ("bathroom", "laundry"):
        return [("towel", int(luck < 0.5)), ("clock", int(luck > 0.9))]
    if room_type == "kitchen":
        return [("clock", int(luck < 0.6)), ("picture", int(luck < 0.35)), ("towel", int(luck > 0.5))]
    if room_type in COLD_ROOMS:
        return [("mirror", int(luck < 0.35)), ("picture", int(random.integers(0, 3))), ("clock", int(luck > 0.75))]
    return [("clock", int(luck < 0.3)), ("picture", int(random.integers(0, 3))), ("mirror", int(luck > 0.75))]


def _wall_item(name: str, random: Random) -> tuple[Item, float]:
    """A design for the wall and the height of its lowest point above the floor."""
    if name == "towel":
        return design(name, random, width_m=float(random.uniform(0.4, 0.55)), height_m=0.65, depth_m=0.08), 0.75
    if name == "mirror":
        item = design(name, random, width_m=float(random.uniform(0.4, 0.6)), height_m=float(random.uniform(0.8, 1.2)))
        return item, 0.7
    item = design(name, random)
    half = (item.extent[1, 2] - item.extent[0, 2]) / 2
    return item, (1.9 if name == "clock" else MIDDLE_M + float(random.uniform(-0.08, 0.08))) - float(half)


def _at(
    site: Site, side: Side, item: Item, along_m: float, z: float, number: int, support: int = ON_WALL
) -> PlacedItem:
    """An item with its back to a side of the room."""
    x, y = side.at(along_m, OFF_WALL_M + float(item.extent[1, 1])).tolist()
    return PlacedItem(number, item, x, y, site.floor.z_m + z, side.yaw, site.room.id, support, NOWHERE)


def _somewhere(site: Site, item: Item, z: float, random: Random, number: int) -> PlacedItem | None:
    """A free place on a wall for an item, or None."""
    (x0, _, _), (x1, _, high) = item.extent.tolist()
    half = (x1 - x0) / 2
    for _ in range(25):
        side = site.sides[int(random.choice(len(site.sides), p=_shares(site)))]
        low, top = half + CORNER_M, side.length_m - half - CORNER_M
        if top <= low or z + high > site.floor.height_m - 0.05:
            continue
        t = float(random.uniform(low, top))
        placed = _at(site, side, item, t, z, number)
        walled = side.is_wall(t - half, t + half) and side.is_closed(t - half, t + half, z, z + high, CORNER_M)
        if walled and site.is_bare(side.strip(t - half, t + half, 0.16)) and site.is_clear(placed, 0.06):
            return placed
    return None


def _shares(site: Site) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    lengths = np.array([side.length_m for side in site.sides])
    return np.asarray(lengths / lengths.sum())


def _windows(site: Site, random: Random, first_id: int) -> None:
    """Radiators below windows and curtains before them, where furniture leaves them room."""
    start = len(site.items)
    for side in site.sides:
        for gap in side.gaps:
            if gap.kind != "window" or gap.start_m < 0 or gap.end_m > side.length_m:
                continue
            for placed in (_radiator(site, side, gap, random), _curtain(site, side, gap, random)):
                if placed is None or not site.is_clear(placed, 0.01) or site.is_kept_free(placed):
                    continue
                if site.stays_walkable([placed]):
                    site.add([_numbered(placed, first_id + len(site.items) - start)])


def _numbered(placed: PlacedItem, number: int) -> PlacedItem:
    return PlacedItem(number, placed.item, placed.x, placed.y, placed.z, placed.yaw, placed.room, placed.support)


def _radiator(site: Site, side: Side, gap: Gap, random: Random) -> PlacedItem | None:
    if random.random() > 0.65:
        return None
    width = min(float(random.uniform(0.6, 1.2)), gap.end_m - gap.start_m)
    item = design("radiator", random, width_m=width, height_m=max(min(0.6, gap.low_m - 0.08), 0.35))
    return _at(site, side, item, (gap.start_m + gap.end_m) / 2, 0.0, 0)


def _curtain(site: Site, side: Side, gap: Gap, random: Random) -> PlacedItem | None:
    if random.random() > 0.7 or site.room.type in ("bathroom", "laundry"):
        return None
    top = min(gap.high_m + 0.12, site.floor.height_m - 0.06)
    middle = (gap.start_m + gap.end_m) / 2
    half = min((gap.end_m - gap.start_m) / 2 + 0.22, middle - 0.02, side.length_m - middle - 0.02)
    for low in (0.03, max(gap.low_m - 0.1, 0.03)):  # down to the floor, or short where something stands there
        item = design("curtain", random, width_m=2 * half, height_m=top - low, depth_m=0.1)
        placed = _at(site, side, item, middle, low, 0)
        if site.is_clear(placed, 0.01):
            return placed
    return None


def _lamps(site: Site, house: House, random: Random, first_id: int) -> None:
    """A ceiling lamp where the room's lights are, or in its middle."""
    floor, number = site.floor, first_id
    spots = [
        light for light in house.lights
        if floor.z_m < light[2] < floor.z_m + floor.height_m and inside(site.room.polygon, np.array(light[:2]))
    ] or [(float(site.middle[0]), float(site.middle[1]), 0.0)]  # fmt: skip
    item = design("ceiling lamp", random, height_m=float(random.uniform(0.2, 0.5)))
    for x, y, _ in spots:
        z = floor.z_m + floor.height_m - float(item.extent[1, 2])
        placed = PlacedItem(number, item, x, y, z, 0.0, site.room.id, ON_CEILING)
        if site.is_clear(placed, 0.02):
            site.add([placed])
            number += 1
