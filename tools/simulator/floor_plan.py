"""Floor plans of a house from a seed: rooms, walls with openings, stairs, doors and windows.

A hall along the house holds the stairs and leads to two rows of rooms; see floor_plan_rooms.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from placegraph.runtime.arrays import F64
from placegraph.runtime.errors import ConfigError
from placegraph.tools.simulator.building_mesh import FloorShape, building_parts, split_into_rectangles
from placegraph.tools.simulator.catalogue import design
from placegraph.tools.simulator.floor_plan_openings import (
    DOOR_HIGH_M,
    LEAF_M,
    FloorOpenings,
    add_windows,
    connect_rooms,
)
from placegraph.tools.simulator.floor_plan_rooms import (
    Flight,
    FrameTransform,
    Rectangle,
    RoomCell,
    arrange_rooms,
    house_shell,
    row_extents,
)
from placegraph.tools.simulator.floor_plan_walls import CellSide, FloorWalls, trace_walls
from placegraph.tools.simulator.house_model import (
    ON_FLOOR,
    ON_WALL,
    Floor,
    House,
    Item,
    PlacedItem,
    Room,
    Staircase,
    Wall,
    WallOpening,
)

SALT = 1_301  # a random stream of its own
MAX_FLOORS = 3
ATTEMPTS = 300
LIGHT_BELOW_M = 0.25


@dataclass(frozen=True, eq=False)
class _Storey:
    """One floor of a valid plan, before it has a height."""

    cells: list[RoomCell]
    grid: FloorWalls
    openings: FloorOpenings


def generate_floor_plan(seed: int, floors: int | None = None) -> House:
    """The unfurnished house of a seed with `floors` floors (None: the seed chooses 1 to 3, mostly 2).

    Raises ConfigError for a number of floors other than 1, 2 or 3, or a negative seed.
    """
    if floors is not None and not 1 <= floors <= MAX_FLOORS:
        raise ConfigError(f"a house has 1 to {MAX_FLOORS} floors, not {floors}")
    if seed < 0:
        raise ConfigError(f"a house's seed is 0 or more, not {seed}")
    count = floors or int(np.random.default_rng([seed, SALT]).choice([1, 2, 3], p=[0.2, 0.6, 0.2]))
    for attempt in range(ATTEMPTS):
        random = np.random.default_rng([seed, SALT, attempt])
        plan = _plan(random, count)
        if plan is not None:
            return _build_house(random, seed, *plan)
    raise ConfigError(f"house {seed}: no plan of {count} floors was found in {ATTEMPTS} attempts")


def _plan(random: np.random.Generator, count: int) -> tuple[list[_Storey], list[Flight]] | None:
    """All floors in the plane of the world; None when a room finds no place or no door."""
    common = house_shell(random, count)
    swap, mirror_x, mirror_y = (random.random(3) < 0.5).tolist()
    turn = FrameTransform(swap, mirror_x, mirror_y, common.width_m, common.depth_m)
    flights = [turn.flight(flight) for flight in common.flights]
    storeys = []
    for floor, extent in enumerate(row_extents(random, common, count)):
        arranged = arrange_rooms(random, common, extent, floor, count)
        if arranged is None:
            return None
        cells = [RoomCell(cell.type, turn.rectangle(cell.place)) for cell in arranged]
        below = flights[floor - 1] if floor else None
        well, head = (below.well, below.head) if below else (None, None)
        grid = trace_walls(cells, well, head, common.outer_m, common.inner_m)
        openings = FloorOpenings(grid, [cell.type for cell in cells], _stair_footprints(flights, floor))
        if not connect_rooms(random, openings):
            return None
        add_windows(random, openings)
        storeys.append(_Storey(cells, grid, openings))
    return storeys, flights


def _stair_footprints(flights: list[Flight], floor: int) -> list[Rectangle]:
    """The footprints of the flights that start on this floor."""
    return [flight.treads for flight in flights if flight.floor == floor]


def _build_house(random: np.random.Generator, seed: int, storeys: list[_Storey], flights: list[Flight]) -> House:
    """The house of a plan: heights, ids, structure and items."""
    heights = random.uniform(2.5, 2.8, len(storeys)).round(2).tolist()
    slab = round(random.uniform(0.25, 0.3), 2)
    levels = [round(sum(heights[:k]) + k * slab, 3) for k in range(len(storeys))]
    floors, first = [], 0
    for index, storey in enumerate(storeys):
        rooms = tuple(Room(first + k, index, cell.type, storey.grid.polygons[k]) for k, cell in enumerate(storey.cells))
        walls = _walls(storey, first)
        floors.append(Floor(index, levels[index], heights[index], storey.grid.outline, rooms, walls))
        first += len(rooms)
    stairs = tuple(_stairs(flight, levels, storeys[flight.floor + 1].grid.well) for flight in flights)
    shapes = [
        FloorShape(
            floors[k],
            storey.grid,
            storey.openings,
            slab,
            storey.grid.well,
            storeys[k + 1].grid.well if k + 1 < len(storeys) else None,
        )
        for k, storey in enumerate(storeys)
    ]
    structure = tuple(part for shape in shapes for part in building_parts(random, shape))
    items = _built_in_items(random, storeys, floors, flights)
    lights = tuple(light for shape in shapes for light in _lights(shape))
    return House(seed, tuple(floors), stairs, structure, items, (), lights)


def _walls(storey: _Storey, first_room: int) -> tuple[Wall, ...]:
    """The full-height walls, openings measured from the start of each wall; parapets are structure only."""
    walls = []
    for index, line in enumerate(storey.grid.lines):
        if not line.parapet:
            holes = sorted(storey.openings.by_line.get(index, []), key=lambda hole: hole.start_m)
            shifted = tuple(
                WallOpening(h.kind, h.start_m - line.start_m, h.end_m - line.start_m, h.low_m, h.high_m,
                        tuple(first_room + room for room in h.rooms))
                for h in holes
            )  # fmt: skip
            walls.append(Wall(line.point(line.start_m), line.point(line.end_m), line.thickness_m, shifted))
    return tuple(walls)


def _stairs(flight: Flight, levels: list[float], well: F64 | None) -> Staircase:
    """The model's view of a flight."""
    assert well is not None
    foot, head = np.array([*flight.foot, levels[flight.floor]]), np.array([*flight.head, levels[flight.floor + 1]])
    sizes = (flight.treads.x1 - flight.treads.x0, flight.treads.y1 - flight.treads.y0)
    return Staircase(flight.floor, foot, head, float(min(sizes)), well)


def _built_in_items(
    random: np.random.Generator, storeys: list[_Storey], floors: list[Floor], flights: list[Flight]
) -> tuple[PlacedItem, ...]:
    """Flights of stairs, door leaves and windows, floor by floor."""
    items: list[PlacedItem] = []

    def place(item: Item, xy: tuple[float, float], z: float, yaw: float, room: int, support: int) -> None:
        items.append(PlacedItem(len(items), item, *xy, z, yaw, room, support))

    for storey, floor in zip(storeys, floors, strict=True):
        first = floor.rooms[0].id
        for flight in flights:
            if flight.floor == floor.index:
                (fx, fy), (hx, hy) = flight.foot, flight.head
                rise, run = floors[floor.index + 1].z_m - floor.z_m, abs(hx - fx) + abs(hy - fy)
                sizes = (flight.treads.x1 - flight.treads.x0, flight.treads.y1 - flight.treads.y0)
                item = design("stairs", random, width_m=min(sizes), depth_m=run, height_m=rise)
                yaw = float(np.arctan2(fx - hx, hy - fy))
                place(item, ((fx + hx) / 2, (fy + hy) / 2), floor.z_m, yaw, first, ON_FLOOR)
        for leaf in storey.openings.leaves:
            item = design("door", random, width_m=leaf.width_m, depth_m=LEAF_M, height_m=DOOR_HIGH_M - 0.03)
            place(item, (leaf.x, leaf.y), floor.z_m + 0.005, leaf.yaw, first + leaf.room, ON_FLOOR)
        for side in storey.grid.sides:
            for hole in storey.openings.by_line.get(side.line, []):
                if hole.kind == "window" and hole.rooms == (side.room,):
                    place(*_window(random, storey.grid, side, hole, floor.z_m), first + side.room, ON_WALL)
    return tuple(items)


def _window(
    random: np.random.Generator, grid: FloorWalls, side: CellSide, hole: WallOpening, z_m: float
) -> tuple[Item, tuple[float, float], float, float]:
    """A window that fills its opening near the outer face and faces the room: item, (x, y), z, yaw."""
    line, depth = grid.lines[side.line], 0.08
    sizes = (hole.end_m - hole.start_m - 0.004, hole.high_m - hole.low_m - 0.004)
    item = design("window", random, width_m=sizes[0], depth_m=depth, height_m=sizes[1])
    across = -side.inward * (line.thickness_m / 2 - depth / 2 - 0.02)
    x, y = line.point((hole.start_m + hole.end_m) / 2, across)
    nx, ny = (0, side.inward) if side.axis == 0 else (side.inward, 0)
    return item, (x, y), z_m + hole.low_m + 0.002, float(np.arctan2(nx, -ny))


def _lights(shape: FloorShape) -> list[tuple[float, float, float]]:
    """Lamp positions below the middle of each room's largest rectangle, two in a long one."""
    lights = []
    z = shape.floor.z_m + shape.floor.height_m - LIGHT_BELOW_M
    for room in shape.floor.rooms:
        low, high = _largest_rectangle(room.polygon)
        middle, size = (low + high) / 2, high - low
        axis = int(np.argmax(size))
        step = np.zeros(2)
        if size[axis] > 5.5 or (size[axis] > 4.0 and size[axis] > 2.2 * size[1 - axis]):
            step[axis] = size[axis] / 4
        for shift in [-step, step] if step.any() else [step]:
            lights.append((float(middle[0] + shift[0]), float(middle[1] + shift[1]), z))
    return lights


def _largest_rectangle(polygon: F64) -> tuple[F64, F64]:
    """Low and high corner of the largest rectangle between the polygon's own coordinates inside it."""
    pieces = split_into_rectangles(polygon, ())
    best = max(pieces, key=lambda rectangle: (rectangle.x1 - rectangle.x0) * (rectangle.y1 - rectangle.y0))
    return np.array([best.x0, best.y0]), np.array([best.x1, best.y1])
