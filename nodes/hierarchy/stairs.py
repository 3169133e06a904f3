"""Stairs from the camera's path: it stood on one floor, climbed, and stood on another.

The paper has no such step. Stairs that were seen but not climbed are not found.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from placegraph.nodes.hierarchy.floors import FloorConfig, FloorSpan
from placegraph.nodes.hierarchy.traversability import TraversabilityConfig
from placegraph.runtime.arrays import F64, I64, Points

NO_FLOOR = -1  # of a camera position that stands on no floor, as while climbing
SLICE_M = 0.5  # chosen by hand: walls and rails count as beside the camera when they are so little above or below it


@dataclass(frozen=True, eq=False)
class Stairs:
    """A climb from floors[0] up to floors[1], numbers of spans; ends (2, 3) lie on them, the lower first."""

    floors: tuple[int, int]
    ends: F64
    length_m: float
    width_m: float


def standing_floors(
    positions_world: Points, spans: list[FloorSpan], floors: FloorConfig, config: TraversabilityConfig
) -> I64:
    """(K,) the number of the span that each camera position (K, 3) stands on, NO_FLOOR for none.

    A camera stands on a floor when it is near its usual height there: the median over positions that can stand on it.
    """
    z = np.asarray(positions_world[:, 2], float)
    standing = np.full(len(z), NO_FLOOR, np.int64)
    for number, span in enumerate(spans):
        over = z - span.low_m
        possible = (over > floors.camera_min_m) & (over < floors.camera_max_m)
        if possible.any():
            standing[possible & (np.abs(over - np.median(over[possible])) <= config.stand_m)] = number
    return standing


def path_segments_on(number: int, positions_world: Points, standing: I64, config: TraversabilityConfig) -> F64:
    """(S, 2, 3) the segments of the camera's path on one floor, from each position to the next."""
    xyz = np.asarray(positions_world, float)
    pairs = np.stack((xyz[:-1], xyz[1:]), axis=1)
    near = np.linalg.norm(pairs[:, 1] - pairs[:, 0], axis=1) <= config.path_gap_m
    return np.asarray(pairs[near & (standing[:-1] == number) & (standing[1:] == number)])


def find_stairs(
    positions_world: Points, standing: I64, spans: list[FloorSpan], points_world: Points, config: TraversabilityConfig
) -> list[Stairs]:
    """Each flight once, in the order it was first climbed; of several climbs the shortest defines it.

    positions_world: (K, 3) the camera's path in order; points_world: (P, 3); metres, world frame.
    """
    xyz = np.asarray(positions_world, float)
    flights: list[Stairs] = []
    last = NO_FLOOR  # the last position that stood on a floor, while the path since then has no gap
    for k in range(len(xyz)):
        if k and np.linalg.norm(xyz[k] - xyz[k - 1]) > config.path_gap_m:
            last = NO_FLOOR
        if standing[k] == NO_FLOOR:
            continue
        if last != NO_FLOOR and standing[last] != standing[k]:
            floors = (int(standing[last]), int(standing[k]))
            climb = _stairs_of_climb(xyz[last : k + 1], floors, spans, points_world, config)
            _add_or_shorten(flights, climb, config)
        last = k
    return flights


def _stairs_of_climb(
    path: F64, floors: tuple[int, int], spans: list[FloorSpan], points: Points, config: TraversabilityConfig
) -> Stairs:
    if floors[0] > floors[1]:
        path, floors = path[::-1], (floors[1], floors[0])
    ends = np.stack((path[0], path[-1]))
    half_way = path[np.argmin(np.abs(path[:, 2] - ends[:, 2].mean()))]
    ends[:, 2] = [spans[number].low_m for number in floors]
    # the camera may bend down on the way: the stairs themselves are at least as long as the straight line
    length = float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())
    length = max(length, float(np.linalg.norm(ends[1] - ends[0])))
    return Stairs(floors, ends, length, _width(half_way, points, config))


def _add_or_shorten(flights: list[Stairs], climb: Stairs, config: TraversabilityConfig) -> None:
    for i, flight in enumerate(flights):
        apart = np.linalg.norm(flight.ends - climb.ends, axis=1).max()
        if flight.floors == climb.floors and apart <= config.stairs_apart_m:
            flights[i] = climb if climb.length_m < flight.length_m else flight
            return
    flights.append(climb)


def _width(camera: F64, points: Points, config: TraversabilityConfig) -> float:
    """Twice the distance from a camera (3,) half way up to what stands beside it; the robot's width at least."""
    max_width = config.stairs_width_max_m
    beside = points[np.abs(points[:, 2] - camera[2]) < SLICE_M, :2]
    nearest = np.linalg.norm(beside - camera[:2], axis=1).min(initial=max_width)
    return float(np.clip(2 * nearest, 2 * config.robot_radius_m, max_width))
