"""The camera trajectory of a person who maps a house: every room of every floor, and up all stairs.

On each floor the robot goes from survey spot to survey spot and turns at each until it has seen what is visible there.
World frame: metres, z up. Camera frame: x right, y down, z forward.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from placegraph.runtime.arrays import F64, I64
from placegraph.runtime.errors import SourceError
from placegraph.tools.simulator.camera_motion import camera_poses, smooth_sway
from placegraph.tools.simulator.house_model import Floor, House, Room, Staircase
from placegraph.tools.simulator.occupancy_grid import free_grid, points_in_polygon
from placegraph.tools.simulator.robot_navigation import (
    STEP_S,
    TURN_RADII_M,
    FreeSpace,
    RobotMotion,
    RoomVisibility,
    RouteField,
    build_free_space,
    room_visibility,
    route,
    routes_to,
    wrap_angle,
)

SALT = 4_201  # a random stream of its own
CELL_M = 0.05
RADIUS_M = 0.25  # of the robot
EYE_M = (1.25, 1.4)  # lowest and highest camera above the floor

HALF_VIEW = np.radians(
    30.0
)  # to either side; slightly less than the camera's, so that targets are not at the image border
TURN_COST = 1.0 / np.radians(120.0)  # worth lost per radian of turning
DEPTH_COST = 1.0  # worth lost per metre into the room
MIN_STEPS_INSIDE = 12  # path points, .02 m apart, that the robot enters a room at least
MIN_SPOT_SHARE, MIN_SPOT_WORTH = 0.15, 2.5  # smallest share of a room, and worth, that a further spot must show
STAIR_TILT = np.radians(6.0)  # looking at the steps
STAIR_REACH_M = 0.8  # from a step before or after a flight to the nearest free cell


class CameraTrajectory(NamedTuple):
    """Camera poses: stamps_ns (N,) int64 from 0, world_from_camera (N, 4, 4) in metres."""

    stamps_ns: I64
    world_from_camera: F64


@dataclass(frozen=True, eq=False)
class SurveySpot:
    """A spot (2,) from which much of a room is visible, and the routes to it."""

    visibility: RoomVisibility
    xy: F64
    routes: RouteField


@dataclass(eq=False)
class _SurveyState:
    house: House
    motion: RobotMotion
    eye_m: float  # camera above the floor
    processed_samples: int = 0  # samples already counted as seen


def camera_trajectory(house: House, seed: int, rate_hz: float = 10.0) -> CameraTrajectory:
    """The trajectory of a seed through a house, `rate_hz` frames a second.

    Raises SourceError when a room or a flight of stairs cannot be reached.
    """
    random = np.random.default_rng([seed, SALT])
    grounds = [floor_free_space(house, floor) for floor in house.floors]
    start = np.append(_start_position(house, grounds[0]), house.floors[0].z_m)
    state = _SurveyState(
        house, RobotMotion(start, 0.0, float(random.uniform(0.52, 0.6))), float(random.uniform(*EYE_M))
    )
    for floor, free_space in zip(house.floors, grounds, strict=True):
        if floor is house.floors[-1]:
            _survey_floor(state, floor, free_space, None)
            break
        flight = next((flight for flight in house.stairs if flight.floor == floor.index), None)
        if flight is None:
            raise SourceError(f"house {house.seed}: no stairs lead from floor {floor.index} to the rooms above it")
        _survey_floor(
            state, floor, free_space, routes_to(free_space, landing_cell(house, flight, free_space, up=False))
        )
        above = grounds[floor.index + 1]
        head = above.middles(np.array([landing_cell(house, flight, above, up=True)]))[0]
        _climb_stairs(state, flight, np.append(head, house.floors[floor.index + 1].z_m))
    return _camera_frames(state, random, rate_hz)


def floor_free_space(house: House, floor: Floor) -> FreeSpace:
    """The free space of a floor. Raises SourceError unless all its rooms are connected."""
    free_space = build_free_space(*free_grid(house, floor.index, cell_m=CELL_M, radius_m=RADIUS_M), CELL_M)
    places = free_space.middles(np.flatnonzero(free_space.reachable))
    for room in floor.rooms:
        if not np.any(points_in_polygon(room.polygon, places)):
            raise SourceError(f"house {house.seed}: the {room.type} (room {room.id}) cannot be reached on foot")
    return free_space


def _survey_spots(state: _SurveyState, floor: Floor, room: Room, free_space: FreeSpace) -> list[SurveySpot]:
    """The spots from which a room is surveyed, the one with the largest view first."""
    visibility = room_visibility(state.house, floor, room)
    cells = np.flatnonzero(free_space.reachable)
    cells = cells[points_in_polygon(room.polygon, free_space.middles(cells))]
    clear = free_space.clearance(free_space.middles(cells))
    min_clearance = next(
        (clearance_m for clearance_m in (0.25, 0.1) if np.sum(clear > clearance_m) >= 20), 0.0
    )  # where the room allows
    cells = cells[clear > min_clearance]
    cells = cells[:: max(1, len(cells) // 250)]
    spots = free_space.middles(cells)
    visible, _ = visibility.views(np.column_stack((spots, np.full(len(spots), floor.z_m + state.eye_m))))
    depth = np.maximum(np.linalg.norm(spots[:, None] - visibility.passage_middles, axis=2).min(axis=1), 0.6)
    survey_spots: list[SurveySpot] = []
    missing = visibility.worth.copy()
    while len(survey_spots) < 4:
        gain = visible @ missing
        best = int(np.argmax(gain + 0.5 * np.minimum(free_space.clearance(spots), 0.5) - DEPTH_COST * depth))
        if survey_spots and gain[best] < max(MIN_SPOT_WORTH, MIN_SPOT_SHARE * visibility.worth.sum()):
            break
        survey_spots.append(SurveySpot(visibility, spots[best], routes_to(free_space, int(cells[best]))))
        missing[visible[best]] = 0.0
    return survey_spots


def _survey_floor(state: _SurveyState, floor: Floor, free_space: FreeSpace, end: RouteField | None) -> None:
    """Visits all survey spots of a floor, looks around at each, and ends at the goal of `end`."""
    remaining = [spot for room in floor.rooms for spot in _survey_spots(state, floor, room, free_space)]
    visibilities = list(dict.fromkeys(spot.visibility for spot in remaining))
    while remaining:
        spot = remaining.pop(_next_spot(remaining, int(free_space.cells(state.motion.xyz[:2])[0])))
        eye = np.append(spot.xy, floor.z_m + state.eye_m)[None]
        if (
            spot.visibility.entered
            and spot.visibility.views(eye)[0][0] @ _unseen_worth(spot.visibility) < MIN_SPOT_WORTH
        ):
            continue
        path = route(free_space, spot.routes, state.motion.xyz[:2])
        near = np.linalg.norm(path - spot.xy, axis=1) <= min(TURN_RADII_M[0], float(free_space.clearance(spot.xy)[0]))
        outside = np.flatnonzero(~points_in_polygon(spot.visibility.room.polygon, path)).max(initial=-1)
        before = max(np.flatnonzero(~near).max(initial=-1), outside + MIN_STEPS_INSIDE)
        if not state.motion.samples:
            state.motion.heading = _heading(path)
        _follow(state, path[: int(before) + 2], floor.z_m)
        _update_seen(state, visibilities)
        follower = remaining[_next_spot(remaining, spot.routes.goal)].routes if remaining else end
        _look_around(state, spot, free_space, follower)
        _update_seen(state, visibilities)
    if end is not None:
        _follow(state, route(free_space, end, state.motion.xyz[:2]), floor.z_m)


def _next_spot(remaining: list[SurveySpot], cell: int) -> int:
    """Index of the spot to visit next: the nearest, except that rooms with three passages or more come last."""
    return int(
        np.argmin(
            [
                spot.routes.cost[cell] + (100.0 if len(spot.visibility.passage_middles) >= 3 else 0.0)
                for spot in remaining
            ]
        )
    )


def _heading(path: F64) -> float:
    """The heading towards the point of a path .8 m ahead, radians."""
    way = path[min(40, len(path) - 1)] - path[0]
    return float(np.arctan2(way[1], way[0]))


def _unseen_worth(visibility: RoomVisibility) -> F64:
    return np.where(visibility.seen, 0.0, visibility.worth)


def _follow(state: _SurveyState, path: F64, z_m: float) -> None:
    state.motion.follow(np.column_stack((path, np.full(len(path), z_m))))


def _look_around(state: _SurveyState, spot: SurveySpot, free_space: FreeSpace, follower: RouteField | None) -> None:
    """Turns, on a small circle where there is space, to see the most unseen targets for the least turning."""
    motion = state.motion
    turns = [float(turn) for turn in np.radians((0, 90, -90, 180, -180, 270, -270, 330))]  # for the last spot
    if follower is not None:
        turn = wrap_angle(_heading(route(free_space, follower, motion.xyz[:2])) - motion.heading)
        turns = [turn, turn - 2 * np.pi, turn + 2 * np.pi]
    visible, bearing = spot.visibility.views(np.append(spot.xy, motion.xyz[2] + state.eye_m)[None])
    offset, worth = bearing[0] - motion.heading, np.where(visible[0], _unseen_worth(spot.visibility), 0.0)
    best, plan = -np.inf, [0.0]
    for first in np.radians((0, -40, 40, -80, 80, -120, 120)):
        for last in turns:
            low, high = min(0.0, first, last) - HALF_VIEW, max(0.0, first, last) + HALF_VIEW
            gain = worth[(offset - low) % (2 * np.pi) < high - low].sum()
            score = gain - TURN_COST * (abs(first) + abs(last - first))
            if score > best + 1e-9:
                best, plan = score, [float(first), last]
    motion.turn_to([motion.heading + step for step in plan], free_space.turn_radius(motion.xyz[:2], motion.heading))


def _update_seen(state: _SurveyState, visibilities: list[RoomVisibility]) -> None:
    """Marks the targets that the robot has seen from inside each room since the last call."""
    samples = np.array(state.motion.samples[state.processed_samples :: 10]).reshape(-1, 6)
    state.processed_samples = len(state.motion.samples)
    for visibility in visibilities:
        inside = samples[points_in_polygon(visibility.room.polygon, samples[:, :2])]
        if len(inside):
            visibility.entered = True
            visible, bearing = visibility.views(inside[:, :3] + (0.0, 0.0, state.eye_m))
            aside = np.abs((bearing - inside[:, 3:4] + np.pi) % (2 * np.pi) - np.pi)
            visibility.seen |= np.any(visible & (aside < HALF_VIEW), axis=0)


def _start_position(house: House, free_space: FreeSpace) -> F64:
    """(2,) where the trajectory starts: at the entrance, else in the hallway, the living room or the first room."""
    floor = house.floors[0]
    for wall in floor.walls:
        for opening in wall.openings:
            if opening.kind == "door" and len(opening.rooms) == 1:
                return np.asarray(free_space.middles(np.array([free_space.nearest(wall.middle_of(opening))]))[0])
    rank = {"hallway": 0, "living room": 1}
    room = min(floor.rooms, key=lambda room_candidate: (rank.get(room_candidate.type, 2), room_candidate.id))
    return np.asarray(free_space.middles(np.array([free_space.nearest(room.polygon.mean(axis=0))]))[0])


def landing_cell(house: House, flight: Staircase, free_space: FreeSpace, up: bool) -> int:
    """The free cell in front of the foot of a flight, or with `up` behind its head. Raises SourceError when blocked."""
    way = (flight.head - flight.foot)[:2] / np.linalg.norm((flight.head - flight.foot)[:2])
    end = flight.head[:2] + 0.35 * way if up else flight.foot[:2] - 0.35 * way
    cell = free_space.nearest(end)
    if np.linalg.norm(free_space.middles(np.array([cell]))[0] - end) > STAIR_REACH_M:
        raise SourceError(
            f"house {house.seed}: the {'head' if up else 'foot'} of the stairs of floor {flight.floor} is blocked"
        )
    return cell


def _climb_stairs(state: _SurveyState, flight: Staircase, landing: F64) -> None:
    """Moves from the lower landing up the flight to the landing (3,) above."""
    state.motion.follow(np.stack((state.motion.xyz, flight.foot, flight.head, landing)), STAIR_TILT)
    state.processed_samples = len(state.motion.samples)


def _camera_frames(state: _SurveyState, random: np.random.Generator, rate_hz: float) -> CameraTrajectory:
    """The trajectory sampled at rate_hz, with the sway of a walking camera."""
    samples = np.array(state.motion.samples)
    ticks = np.arange(len(samples)) * STEP_S
    stamps = np.arange(int(ticks[-1] * rate_hz) + 1) / rate_hz
    x, y, z, heading, speed, tilt = (np.interp(stamps, ticks, column) for column in samples.T)
    pitch = random.uniform(np.radians(13), np.radians(17)) + tilt + smooth_sway(random, stamps, 8.0, np.radians(3))
    roll = smooth_sway(random, stamps, 3.0, np.radians(0.5))
    pace = np.clip(speed / state.motion.cruise_mps, 0, 1)
    bob = 0.01 * pace * np.sin(2 * np.pi * 1.6 * stamps + random.uniform(0, 2 * np.pi))
    world_from_camera = camera_poses(np.stack((x, y, z + state.eye_m + bob), axis=1), heading, pitch, roll)
    return CameraTrajectory(np.round(stamps * 1e9).astype(np.int64), world_from_camera)
