"""Furnishes a house: groups by room type, single items in corners, items on the walls."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from scipy.spatial import ConvexHull

from placegraph.runtime.arrays import F64
from placegraph.tools.simulator.furniture_groups import (
    CONTENTS,
    bedroom_and_office,
    kitchen_and_bathroom,
    living_and_dining,
    single_items,
)
from placegraph.tools.simulator.furniture_groups.group_layout import GroupBuilder, GroupLayout
from placegraph.tools.simulator.furniture_groups.single_items import draw_single_items
from placegraph.tools.simulator.furniture_groups.surface_items import add_small_items
from placegraph.tools.simulator.furniture_placement import CELL_M, GroupPose, RoomPlanner
from placegraph.tools.simulator.house_model import NOWHERE, ON_FLOOR, FurnitureLocation, House, PlacedItem
from placegraph.tools.simulator.occupancy_grid import unfurnished_grid
from placegraph.tools.simulator.wall_decor import add_wall_decor

SALT = 5_003  # a random stream of its own

GROUPS: dict[str, GroupBuilder] = (
    living_and_dining.GROUPS | bedroom_and_office.GROUPS | kitchen_and_bathroom.GROUPS | single_items.GROUPS
)


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
    room_type, area_m2 = planner.room.type, planner.room.area_m2
    facing_sofa: F64 | None = None
    for name, chance, min_m2 in CONTENTS["room_groups"].get(room_type, CONTENTS["room_groups"]["default"]):
        if random.random() >= chance or area_m2 < min_m2:
            continue
        near = facing_sofa if name == "media_area" else None
        pose = _place_first_fit(planner, GROUPS[name](random, area_m2), near, items, locations)
        if pose is not None and name == "seating_area":  # the television faces the sofa
            forward = np.array([(0, -1), (1, 0), (0, 1), (-1, 0)][pose.quarter], float)
            facing_sofa = np.clip((pose.x, pose.y) + forward * 20, low, high)
    for layout in draw_single_items(room_type, area_m2, random):
        _place_first_fit(planner, iter((layout,)), None, items, locations)


def _place_first_fit(
    planner: RoomPlanner,
    layouts: Iterator[GroupLayout],
    near: F64 | None,
    items: list[PlacedItem],
    locations: list[FurnitureLocation],
) -> GroupPose | None:
    """Places the first layout that fits, with small items; two items or more become a location."""
    for layout in layouts:
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
