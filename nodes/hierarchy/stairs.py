"""Stairs from the camera's path: it stood on one floor, climbed, and stood on another.

Source: issue 4, place graph. Stairs that were seen and not climbed are not found.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from placegraph.nodes.hierarchy.floors import FloorConfig, FloorSpan
from placegraph.nodes.hierarchy.traversability import TravelConfig
from placegraph.runtime.arrays import F64, I64, Points

CLIMBING = -1  # of a camera position that stands on no floor
SLICE_M = 0.5  # walls and rails beside a climbing camera are looked for so far above and below it


@dataclass(frozen=True, eq=False)
class Stairs:
    """A climb from floors[0] up to floors[1], numbers of spans; ends (2, 3) lie on them, the lower first."""

    floors: tuple[int, int]
    ends: F64
    length_m: float
    width_m: float


def floors_stood_on(positions_world: Points, spans: list[FloorSpan], floors: FloorConfig, travel: TravelConfig) -> I64:
    """(K,) the number of the span that each camera position (K, 3) stands on, CLIMBING for none.

    Standing is being at the height above a floor that is usual on it: the median of those that can stand on it.
    """
    z = np.asarray(positions_world[:, 2], float)
    standing = np.full(len(z), CLIMBING, np.int64)
    for number, span in enumerate(spans):
        over = z - span.low
        possible = (over > floors.camera_min_m) & (over < floors.camera_max_m)
        if possible.any():
            standing[possible & (np.abs(over - np.median(over[possible])) <= travel.stand_m)] = number
    return standing


def steps_on(number: int, positions_world: Points, standing: I64, config: TravelConfig) -> F64:
    """(S, 2, 3) pieces of the camera's path on one floor, from each position to the next."""
    xyz = np.asarray(positions_world, float)
    pairs = np.stack((xyz[:-1], xyz[1:]), axis=1)
    near = np.linalg.norm(pairs[:, 1] - pairs[:, 0], axis=1) <= config.path_gap_m
    return np.asarray(pairs[near & (standing[:-1] == number) & (standing[1:] == number)])


def find_stairs(
    positions_world: Points, standing: I64, spans: list[FloorSpan], points_world: Points, config: TravelConfig
) -> list[Stairs]:
    """Each flight once, in the order it was first climbed; of several climbs the shortest tells its ends.

    positions_world: (K, 3) the camera's path in order; points_world: (P, 3); metres, world frame.
    """
    xyz = np.asarray(positions_world, float)
    found: list[Stairs] = []
    last = CLIMBING  # the last position that stood on a floor, while the path since holds together
    for k in range(len(xyz)):
        if k and np.linalg.norm(xyz[k] - xyz[k - 1]) > config.path_gap_m:
            last = CLIMBING
        if standing[k] == CLIMBING:
            continue
        if last != CLIMBING and standing[last] != standing[k]:
            floors = (int(standing[last]), int(standing[k]))
            climb = _climb(xyz[last : k + 1], floors, spans, points_world, config)
            _add(found, climb, config)
        last = k
    return found


def _climb(path: F64, floors: tuple[int, int], spans: list[FloorSpan], points: Points, config: TravelConfig) -> Stairs:
    if floors[0] > floors[1]:
        path, floors = path[::-1], (floors[1], floors[0])
    ends = np.stack((path[0], path[-1]))
    half_way = path[np.argmin(np.abs(path[:, 2] - ends[:, 2].mean()))]
    ends[:, 2] = [spans[number].low for number in floors]
    # the camera may bend down on the way: the stairs themselves are at least as long as the straight line
    length = float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())
    length = max(length, float(np.linalg.norm(ends[1] - ends[0])))
    return Stairs(floors, ends, length, _width(half_way, points, config))


def _add(found: list[Stairs], climb: Stairs, config: TravelConfig) -> None:
    for i, known in enumerate(found):
        apart = np.linalg.norm(known.ends - climb.ends, axis=1).max()
        if known.floors == climb.floors and apart <= config.stairs_apart_m:
            found[i] = climb if climb.length_m < known.length_m else known
            return
    found.append(climb)


def _width(eye: F64, points: Points, config: TravelConfig) -> float:
    """Twice the distance from a camera (3,) half way up to what stands beside it; the robot's width at least."""
    most = config.stairs_width_max_m
    beside = points[np.abs(points[:, 2] - eye[2]) < SLICE_M, :2]
    nearest = np.linalg.norm(beside - eye[:2], axis=1).min(initial=most)
    return float(np.clip(2 * nearest, 2 * config.robot_radius_m, most))
