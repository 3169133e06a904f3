"""Furnishes a house: groups by room type, single items in corners, items on the walls."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from scipy.spatial import ConvexHull

from placegraph.runtime.arrays import F64
from placegraph.tools.simulator.furniture_groups.bedroom_and_office import (
    cupboard_area,
    entrance_area,
    sleeping_area,
    storage_area,
    work_area,
)
from placegraph.tools.simulator.furniture_groups.group_layout import GroupLayout
from placegraph.tools.simulator.furniture_groups.kitchen_and_bathroom import (
    bathing_area,
    cooking_area,
    laundry_area,
    washing_area,
)
from placegraph.tools.simulator.furniture_groups.living_and_dining import (
    dining_area,
    media_area,
    music_area,
    play_area,
    reading_area,
    seating_area,
)
from placegraph.tools.simulator.furniture_groups.single_items import bicycle, draw_single_items, toilet
from placegraph.tools.simulator.furniture_groups.surface_items import add_small_items
from placegraph.tools.simulator.furniture_placement import CELL_M, GroupPose, RoomPlanner
from placegraph.tools.simulator.house_model import NOWHERE, ON_FLOOR, FurnitureLocation, House, PlacedItem
from placegraph.tools.simulator.occupancy_grid import unfurnished_grid
from placegraph.tools.simulator.wall_decor import add_wall_decor

GroupBuilder = Callable[[np.random.Generator, float], Iterator[GroupLayout]]

SALT = 5_003  # a random stream of its own

# Groups of a room type in the order of placing: layouts, probability, smallest room area in m2.
ROOM_GROUPS: dict[str, tuple[tuple[GroupBuilder, float, float], ...]] = {
    "living room": (
        (seating_area, 1.0, 0), (media_area, 0.95, 0), (dining_area, 0.35, 24),
        (reading_area, 0.5, 15), (music_area, 0.35, 14), (cupboard_area, 0.3, 20),
        (work_area, 0.3, 16),
    ),
    "kitchen": (
        (cooking_area, 1.0, 0), (dining_area, 0.75, 8), (laundry_area, 0.15, 11),
        (cupboard_area, 0.25, 10),
    ),
    "dining room": (
        (dining_area, 1.0, 0), (cupboard_area, 0.8, 0), (music_area, 0.4, 9),
        (reading_area, 0.3, 13),
    ),
    "bathroom": (
        (toilet, 1.0, 0), (washing_area, 1.0, 0), (bathing_area, 1.0, 0), (laundry_area, 0.7, 4),
    ),
    "laundry": ((laundry_area, 1.0, 0), (cupboard_area, 0.5, 5), (washing_area, 0.4, 6)),
    "bedroom": (
        (sleeping_area, 1.0, 0), (work_area, 0.3, 10), (storage_area, 0.95, 0),
        (play_area, 0.25, 9), (reading_area, 0.25, 12), (music_area, 0.25, 10),
    ),
    "office": (
        (work_area, 1.0, 0), (reading_area, 0.6, 7), (work_area, 0.35, 12),
        (cupboard_area, 0.5, 9), (music_area, 0.2, 9),
    ),
    "playroom": (
        (play_area, 1.0, 0), (reading_area, 0.45, 8), (seating_area, 0.4, 11),
        (music_area, 0.35, 11), (play_area, 0.4, 12), (work_area, 0.3, 12),
    ),
    "hallway": (
        (bicycle, 0.4, 6), (entrance_area, 0.9, 0), (cupboard_area, 0.25, 9),
        (music_area, 0.2, 12), (reading_area, 0.2, 10),
    ),
    "corridor": ((cupboard_area, 0.35, 7), (entrance_area, 0.25, 0), (reading_area, 0.3, 9)),
}  # fmt: skip
DEFAULT_GROUPS = ((cupboard_area, 0.8, 0.0), (reading_area, 0.5, 6.0))


def furnish(house: House, random_seed: int) -> House:
    """The house with furniture, small items and locations; floors, walls and fixtures stay as they are."""
    items = list(house.items)
    locations: list[FurnitureLocation] = []
    for floor in house.floors:
        origin, walkable = unfurnished_grid(house, floor.index, CELL_M)
        for room in floor.rooms:
            random = np.random.default_rng([random_seed, SALT, room.id])
            planner = RoomPlanner(house, room, origin, walkable)
            _furnish_room(planner, random, items, locations)
            items += add_wall_decor(planner, house, random, len(items))
    return replace(house, items=tuple(items), locations=tuple(locations))


def _furnish_room(
    planner: RoomPlanner, random: np.random.Generator, items: list[PlacedItem], locations: list[FurnitureLocation]
) -> None:
    """Places the groups of a room, then single items."""
    low, high = planner.room.polygon.min(axis=0), planner.room.polygon.max(axis=0)
    x, y = planner.room.polygon.T
    area_m2 = abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1))) / 2
    near: F64 | None = None
    for build_group, chance, min_m2 in ROOM_GROUPS.get(planner.room.type, DEFAULT_GROUPS):
        if random.random() >= chance or area_m2 < min_m2:
            continue
        pose = _place_first_fit(
            planner, build_group(random, area_m2), near if build_group is media_area else None, items, locations
        )
        if pose is not None and build_group is seating_area:  # the television faces the sofa
            forward = np.array([(0, -1), (1, 0), (0, 1), (-1, 0)][pose.quarter], float)
            near = np.clip((pose.x, pose.y) + forward * 20, low, high)
    for layout in draw_single_items(planner.room.type, area_m2, random):
        _place_first_fit(planner, iter((layout,)), None, items, locations)


def _place_first_fit(
    planner: RoomPlanner,
    drafts: Iterator[GroupLayout],
    near: F64 | None,
    items: list[PlacedItem],
    locations: list[FurnitureLocation],
) -> GroupPose | None:
    """Places the first layout that fits, with small items; two items or more become a location."""
    for layout in drafts:
        pose = planner.find_pose(layout, near)
        if pose is None:
            continue
        add_small_items(layout)
        grouped = layout.kind != "" and len(layout.pieces) >= 2
        placed = planner.place_group(layout, pose, len(items), len(locations) if grouped else NOWHERE)
        planner.add(placed)
        items += placed
        if grouped:
            members = tuple(item.id for item in placed)
            locations.append(
                FurnitureLocation(len(locations), layout.kind, planner.room.id, members, floor_outline(placed))
            )
        return pose
    return None


def floor_outline(placed: list[PlacedItem]) -> F64:
    """(K, 2) convex hull, counterclockwise, of the footprints of those items that stand on the floor, world frame."""
    corners = np.concatenate([item.footprint for item in placed if item.support == ON_FLOOR])
    return np.asarray(corners[ConvexHull(corners).vertices])
