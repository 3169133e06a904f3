"""The walk of a camera through a house, as of a person who maps it: every room of every floor, and up all stairs.

On each floor the robot goes from lookout to lookout; at each it turns until it has seen what the lookout shows. World
frame: metres, z up. Camera frame: x right, y down, z forward.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from placegraph.runtime.arrays import F64, I64, Bool
from placegraph.runtime.errors import SourceError
from placegraph.tools.simulator.gait import camera_poses, sway
from placegraph.tools.simulator.model import Floor, House, Room, Stairs
from placegraph.tools.simulator.path import (
    LOOPS_M,
    STEP_S,
    Ground,
    Motion,
    Outlook,
    Ways,
    ground,
    outlook_of,
    route,
    ways_to,
    wrapped,
)
from placegraph.tools.simulator.space import free_grid, inside

SALT = 4_201  # sets the walk's randomness apart from that of plan and furniture
CELL_M = 0.05
RADIUS_M = 0.25  # of the robot
EYE_M = (1.25, 1.4)  # camera above the floor, at least and at most
NO_ROOM = -1  # of a frame on the stairs

HALF_VIEW = np.radians(30.0)  # to either side; a little less than the camera's, so nothing stays at the image's edge
TURN_PRICE = 1.0 / np.radians(120.0)  # worth of a radian of turning
WAY_PRICE = 1.0  # worth of a metre further into the room
STEP_IN = 12  # points of a path, .02 m each, that the robot goes into a room at least
SPOT_SHARE, SPOT_WORTH = 0.15, 2.5  # a further lookout must show at least this share of a room, and this worth
STAIR_TILT = np.radians(6.0)  # looking at the steps
STAIR_REACH_M = 0.8  # from a step before or after a flight to the nearest free cell


class Walk(NamedTuple):
    """Camera poses along the way: stamps_ns (N,) int64 from 0, world_from_camera (N, 4, 4) metres."""

    stamps_ns: I64
    world_from_camera: F64


@dataclass(frozen=True, eq=False)
class Lookout:
    """A spot (2,) from which much of a room is seen, and the ways to it."""

    outlook: Outlook
    xy: F64
    ways: Ways


@dataclass(eq=False)
class _Tour:
    house: House
    motion: Motion
    eye_m: float  # camera above the floor
    marked: int = 0  # samples whose view has been taken into account


def walk(house: House, seed: int, rate_hz: float = 10.0) -> Walk:
    """The walk of a seed through a house, rate_hz frames a second.

    Raises:
        SourceError: a room or a flight of stairs cannot be reached.
    """
    random = np.random.default_rng([seed, SALT])
    grounds = [ground_of(house, floor) for floor in house.floors]
    start = np.append(_start(house, grounds[0]), house.floors[0].z_m)
    tour = _Tour(house, Motion(start, 0.0, float(random.uniform(0.52, 0.6))), float(random.uniform(*EYE_M)))
    for floor, here in zip(house.floors, grounds, strict=True):
        if floor is house.floors[-1]:
            _survey(tour, floor, here, None)
            break
        flight = next((one for one in house.stairs if one.floor == floor.index), None)
        if flight is None:
            raise SourceError(f"house {house.seed}: no stairs lead from floor {floor.index} to the rooms above it")
        _survey(tour, floor, here, ways_to(here, landing_of(house, flight, here, up=False)))
        above = grounds[floor.index + 1]
        head = above.middles(np.array([landing_of(house, flight, above, up=True)]))[0]
        _climb(tour, flight, np.append(head, house.floors[floor.index + 1].z_m))
    return _filmed(tour, random, rate_hz)


def covered(house: House, one: Walk, half_view: tuple[float, float] = (0.6, 0.47)) -> Bool:
    """Whether the middle of each item (I,) was in view, .5 to 4.5 m ahead; half_view in radians, across and upright."""
    result = np.zeros(len(house.items), bool)
    camera_from_world = np.linalg.inv(one.world_from_camera)
    for k, item in enumerate(house.items):
        x, y, z = (camera_from_world[:, :3, :3] @ item.box.mean(axis=0) + camera_from_world[:, :3, 3]).T
        framed = (np.abs(x) < z * np.tan(half_view[0])) & (np.abs(y) < z * np.tan(half_view[1]))
        result[k] = bool(np.any(framed & (z > 0.5) & (z < 4.5)))
    return result


def rooms_of_frames(house: House, world_from_camera: F64) -> I64:
    """(N,) the Room.id of each camera pose (N, 4, 4), NO_ROOM on stairs; in a doorway that of the room it leaves."""
    xyz = world_from_camera[:, :3, 3]
    rooms = np.full(len(xyz), NO_ROOM, np.int64)
    for floor in house.floors:
        level = (xyz[:, 2] > floor.z_m + EYE_M[0] - 0.02) & (xyz[:, 2] < floor.z_m + EYE_M[1] + 0.02)
        for room in floor.rooms:
            rooms[level & inside(room.polygon, xyz[:, :2])] = room.id
        for k in np.flatnonzero(level):
            rooms[k] = rooms[k - 1] if rooms[k] == NO_ROOM and k else rooms[k]
    return rooms


def ground_of(house: House, floor: Floor) -> Ground:
    """The ground of a floor; every room must be part of what hangs together."""
    made = ground(*free_grid(house, floor.index, cell_m=CELL_M, radius_m=RADIUS_M), CELL_M)
    places = made.middles(np.flatnonzero(made.reachable))
    for room in floor.rooms:
        if not np.any(inside(room.polygon, places)):
            raise SourceError(f"house {house.seed}: the {room.type} (room {room.id}) cannot be reached on foot")
    return made


def _lookouts(tour: _Tour, floor: Floor, room: Room, ground: Ground) -> list[Lookout]:
    """The spots from which a room is surveyed, the one that shows most first."""
    outlook = outlook_of(tour.house, floor, room)
    cells = np.flatnonzero(ground.reachable)
    cells = cells[inside(room.polygon, ground.middles(cells))]
    clear = ground.clearance(ground.middles(cells))
    wanted = next((least for least in (0.25, 0.1) if np.sum(clear > least) >= 20), 0.0)  # where the room allows
    cells = cells[clear > wanted]
    cells = cells[:: max(1, len(cells) // 250)]
    spots = ground.middles(cells)
    visible, _ = outlook.views(np.column_stack((spots, np.full(len(spots), floor.z_m + tour.eye_m))))
    depth = np.maximum(np.linalg.norm(spots[:, None] - outlook.passages, axis=2).min(axis=1), 0.6)
    found: list[Lookout] = []
    missing = outlook.worth.copy()
    while len(found) < 4:
        gain = visible @ missing
        best = int(np.argmax(gain + 0.5 * np.minimum(ground.clearance(spots), 0.5) - WAY_PRICE * depth))
        if found and gain[best] < max(SPOT_WORTH, SPOT_SHARE * outlook.worth.sum()):
            break
        found.append(Lookout(outlook, spots[best], ways_to(ground, int(cells[best]))))
        missing[visible[best]] = 0.0
    return found


def _survey(tour: _Tour, floor: Floor, ground: Ground, end: Ways | None) -> None:
    """Goes to all lookouts of a floor, looks around at each, and ends where the ways `end` lead."""
    left = [spot for room in floor.rooms for spot in _lookouts(tour, floor, room, ground)]
    outlooks = list(dict.fromkeys(spot.outlook for spot in left))
    while left:
        spot = left.pop(_nearest(left, int(ground.cells(tour.motion.xyz[:2])[0])))
        eye = np.append(spot.xy, floor.z_m + tour.eye_m)[None]
        if spot.outlook.entered and spot.outlook.views(eye)[0][0] @ _missing(spot.outlook) < SPOT_WORTH:
            continue
        path = route(ground, spot.ways, tour.motion.xyz[:2])
        near = np.linalg.norm(path - spot.xy, axis=1) <= min(LOOPS_M[0], float(ground.clearance(spot.xy)[0]))
        outside = np.flatnonzero(~inside(spot.outlook.room.polygon, path)).max(initial=-1)
        before = max(np.flatnonzero(~near).max(initial=-1), outside + STEP_IN)
        if not tour.motion.samples:
            tour.motion.heading = _heading(path)
        _follow(tour, path[: int(before) + 2], floor.z_m)
        _mark(tour, outlooks)
        follower = left[_nearest(left, spot.ways.goal)].ways if left else end
        _look_around(tour, spot, ground, follower)
        _mark(tour, outlooks)
    if end is not None:
        _follow(tour, route(ground, end, tour.motion.xyz[:2]), floor.z_m)


def _nearest(left: list[Lookout], cell: int) -> int:
    """Which lookout to go to next: the nearest, but rooms that one passes through anyway wait to the last."""
    return int(np.argmin([one.ways.cost[cell] + (100.0 if len(one.outlook.passages) >= 3 else 0.0) for one in left]))


def _heading(path: F64) -> float:
    """The heading towards what of a path lies .8 m ahead."""
    way = path[min(40, len(path) - 1)] - path[0]
    return float(np.arctan2(way[1], way[0]))


def _missing(outlook: Outlook) -> F64:
    return np.where(outlook.seen, 0.0, outlook.worth)


def _follow(tour: _Tour, path: F64, z_m: float) -> None:
    tour.motion.follow(np.column_stack((path, np.full(len(path), z_m))))


def _look_around(tour: _Tour, spot: Lookout, ground: Ground, follower: Ways | None) -> None:
    """Turns, on a small circle where there is room, by what shows most of the unseen for least turning."""
    motion = tour.motion
    turns = [float(turn) for turn in np.radians((0, 90, -90, 180, -180, 270, -270, 330))]  # of the last look of all
    if follower is not None:
        turn = wrapped(_heading(route(ground, follower, motion.xyz[:2])) - motion.heading)
        turns = [turn, turn - 2 * np.pi, turn + 2 * np.pi]
    visible, bearing = spot.outlook.views(np.append(spot.xy, motion.xyz[2] + tour.eye_m)[None])
    offset, worth = bearing[0] - motion.heading, np.where(visible[0], _missing(spot.outlook), 0.0)
    best, plan = -np.inf, [0.0]
    for first in np.radians((0, -40, 40, -80, 80, -120, 120)):
        for last in turns:
            low, high = min(0.0, first, last) - HALF_VIEW, max(0.0, first, last) + HALF_VIEW
            gain = worth[(offset - low) % (2 * np.pi) < high - low].sum()
            score = gain - TURN_PRICE * (abs(first) + abs(last - first))
            if score > best + 1e-9:
                best, plan = score, [float(first), last]
    motion.look([motion.heading + step for step in plan], ground.loop_radius(motion.xyz[:2], motion.heading))


def _mark(tour: _Tour, outlooks: list[Outlook]) -> None:
    """Takes into account what the robot has seen, from inside of each room, since the last time."""
    samples = np.array(tour.motion.samples[tour.marked :: 10]).reshape(-1, 6)
    tour.marked = len(tour.motion.samples)
    for outlook in outlooks:
        there = samples[inside(outlook.room.polygon, samples[:, :2])]
        if len(there):
            outlook.entered = True
            visible, bearing = outlook.views(there[:, :3] + (0.0, 0.0, tour.eye_m))
            aside = np.abs((bearing - there[:, 3:4] + np.pi) % (2 * np.pi) - np.pi)
            outlook.seen |= np.any(visible & (aside < HALF_VIEW), axis=0)


def _start(house: House, ground: Ground) -> F64:
    """(2,) where the walk starts: by the entrance, or else in the hallway, the living room, or the first room."""
    floor = house.floors[0]
    for wall in floor.walls:
        for hole in wall.openings:
            if hole.kind == "door" and len(hole.rooms) == 1:
                a, b = np.array(wall.a), np.array(wall.b)
                middle = a + (b - a) / np.linalg.norm(b - a) * (hole.start_m + hole.end_m) / 2
                return np.asarray(ground.middles(np.array([ground.nearest(middle)]))[0])
    rank = {"hallway": 0, "living room": 1}
    room = min(floor.rooms, key=lambda one: (rank.get(one.type, 2), one.id))
    return np.asarray(ground.middles(np.array([ground.nearest(room.polygon.mean(axis=0))]))[0])


def landing_of(house: House, flight: Stairs, ground: Ground, up: bool) -> int:
    """The free cell from which a flight is climbed, or, `up`, onto which one steps at its head."""
    way = (flight.head - flight.foot)[:2] / np.linalg.norm((flight.head - flight.foot)[:2])
    end = flight.head[:2] + 0.35 * way if up else flight.foot[:2] - 0.35 * way
    cell = ground.nearest(end)
    if np.linalg.norm(ground.middles(np.array([cell]))[0] - end) > STAIR_REACH_M:
        raise SourceError(
            f"house {house.seed}: the {'head' if up else 'foot'} of the stairs of floor {flight.floor} is blocked"
        )
    return cell


def _climb(tour: _Tour, flight: Stairs, landing: F64) -> None:
    """From the landing below up the flight to the landing (3,) above."""
    tour.motion.follow(np.stack((tour.motion.xyz, flight.foot, flight.head, landing)), STAIR_TILT)
    tour.marked = len(tour.motion.samples)


def _filmed(tour: _Tour, random: np.random.Generator, rate_hz: float) -> Walk:
    """The frames of a tour: its samples at rate_hz, with the sway of a walking camera."""
    samples = np.array(tour.motion.samples)
    ticks = np.arange(len(samples)) * STEP_S
    stamps = np.arange(int(ticks[-1] * rate_hz) + 1) / rate_hz
    x, y, z, heading, speed, tilt = (np.interp(stamps, ticks, column) for column in samples.T)
    pitch = random.uniform(np.radians(13), np.radians(17)) + tilt + sway(random, stamps, 8.0, np.radians(3))
    roll = sway(random, stamps, 3.0, np.radians(0.5))
    pace = np.clip(speed / tour.motion.cruise_mps, 0, 1)
    bob = 0.01 * pace * np.sin(2 * np.pi * 1.6 * stamps + random.uniform(0, 2 * np.pi))
    world_from_camera = camera_poses(np.stack((x, y, z + tour.eye_m + bob), axis=1), heading, pitch, roll)
    return Walk(np.round(stamps * 1e9).astype(np.int64), world_from_camera)
