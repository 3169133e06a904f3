"""Furniture for a laid-out house: groups by the type of a room, things on their own in corners, things on the walls."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from scipy.spatial import ConvexHull

from placegraph.runtime.arrays import F64
from placegraph.tools.simulator.groups import clutter, living, rest, wet
from placegraph.tools.simulator.groups.draft import Draft
from placegraph.tools.simulator.groups.dressing import dress
from placegraph.tools.simulator.hangings import hang_all
from placegraph.tools.simulator.model import NOWHERE, ON_FLOOR, House, Location, PlacedItem
from placegraph.tools.simulator.site import CELL_M, Pose, Site
from placegraph.tools.simulator.space import bare_grid

Build = Callable[[np.random.Generator, float], Iterator[Draft]]

SALT = 5_003  # keeps the furniture's randomness apart from what else is drawn from the seed

# What a room of a type holds, in the order in which it is brought in: the group, its chance, area needed in m2.
PROGRAMMES: dict[str, tuple[tuple[Build, float, float], ...]] = {
    "living room": (
        (living.seating_area, 1.0, 0), (living.media_area, 0.95, 0), (living.dining_area, 0.35, 24),
        (living.reading_area, 0.5, 15), (living.music_area, 0.35, 14), (rest.cupboard_area, 0.3, 20),
        (rest.work_area, 0.3, 16),
    ),
    "kitchen": (
        (wet.cooking_area, 1.0, 0), (living.dining_area, 0.75, 8), (wet.laundry_area, 0.15, 11),
        (rest.cupboard_area, 0.25, 10),
    ),
    "dining room": (
        (living.dining_area, 1.0, 0), (rest.cupboard_area, 0.8, 0), (living.music_area, 0.4, 9),
        (living.reading_area, 0.3, 13),
    ),
    "bathroom": (
        (clutter.toilet, 1.0, 0), (wet.washing_area, 1.0, 0), (wet.bathing_area, 1.0, 0), (wet.laundry_area, 0.7, 4),
    ),
    "laundry": ((wet.laundry_area, 1.0, 0), (rest.cupboard_area, 0.5, 5), (wet.washing_area, 0.4, 6)),
    "bedroom": (
        (rest.sleeping_area, 1.0, 0), (rest.work_area, 0.3, 10), (rest.storage_area, 0.95, 0),
        (living.play_area, 0.25, 9), (living.reading_area, 0.25, 12), (living.music_area, 0.25, 10),
    ),
    "office": (
        (rest.work_area, 1.0, 0), (living.reading_area, 0.6, 7), (rest.work_area, 0.35, 12),
        (rest.cupboard_area, 0.5, 9), (living.music_area, 0.2, 9),
    ),
    "playroom": (
        (living.play_area, 1.0, 0), (living.reading_area, 0.45, 8), (living.seating_area, 0.4, 11),
        (living.music_area, 0.35, 11), (living.play_area, 0.4, 12), (rest.work_area, 0.3, 12),
    ),
    "hallway": (
        (clutter.bicycle, 0.4, 6), (rest.entrance_area, 0.9, 0), (rest.cupboard_area, 0.25, 9),
        (living.music_area, 0.2, 12), (living.reading_area, 0.2, 10),
    ),
    "corridor": ((rest.cupboard_area, 0.35, 7), (rest.entrance_area, 0.25, 0), (living.reading_area, 0.3, 9)),
}  # fmt: skip
OTHER_ROOMS = ((rest.cupboard_area, 0.8, 0.0), (living.reading_area, 0.5, 6.0))


def furnish(house: House, random_seed: int) -> House:
    """A laid-out house with furniture, small things and locations; its floors, walls and fixtures stay as they are."""
    items = list(house.items)
    locations: list[Location] = []
    for floor in house.floors:
        origin, walkable = bare_grid(house, floor.index, CELL_M)
        for room in floor.rooms:
            random = np.random.default_rng([random_seed, SALT, room.id])
            site = Site(house, room, origin, walkable)
            _furnish_room(site, random, items, locations)
            items += hang_all(site, house, random, len(items))
    return replace(house, items=tuple(items), locations=tuple(locations))


def _furnish_room(site: Site, random: np.random.Generator, items: list[PlacedItem], locations: list[Location]) -> None:
    """Bring in a room's groups, then the things that stand on their own."""
    low, high = site.room.polygon.min(axis=0), site.room.polygon.max(axis=0)
    x, y = site.room.polygon.T
    area_m2 = abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1))) / 2
    wanted: F64 | None = None
    for build, chance, min_m2 in PROGRAMMES.get(site.room.type, OTHER_ROOMS):
        if random.random() >= chance or area_m2 < min_m2:
            continue
        pose = _bring_in(site, build(random, area_m2), wanted if build is living.media_area else None, items, locations)
        if pose is not None and build is living.seating_area:  # the television faces the sofa
            forward = np.array([(0, -1), (1, 0), (0, 1), (-1, 0)][pose.quarter], float)
            wanted = np.clip((pose.x, pose.y) + forward * 20, low, high)
    for draft in clutter.singles(site.room.type, area_m2, random):
        _bring_in(site, iter((draft,)), None, items, locations)


def _bring_in(
    site: Site, drafts: Iterator[Draft], wanted: F64 | None, items: list[PlacedItem], locations: list[Location]
) -> Pose | None:
    """Place the first draft that fits, dressed; a draft of two things or more becomes a location."""
    for draft in drafts:
        pose = site.find(draft, wanted)
        if pose is None:
            continue
        dress(draft)
        grouped = draft.kind != "" and len(draft.pieces) >= 2
        placed = site.posed(draft, pose, len(items), len(locations) if grouped else NOWHERE)
        site.add(placed)
        items += placed
        if grouped:
            members = tuple(one.id for one in placed)
            locations.append(Location(len(locations), draft.kind, site.room.id, members, outline(placed)))
        return pose
    return None


def outline(placed: list[PlacedItem]) -> F64:
    """(K, 2) convex hull, counterclockwise, of the footprints of those items that stand on the floor, world frame."""
    corners = np.concatenate([one.footprint for one in placed if one.support == ON_FLOOR])
    return np.asarray(corners[ConvexHull(corners).vertices])
