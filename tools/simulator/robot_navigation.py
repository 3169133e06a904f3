"""Free space of a floor, routes through it, the motion of the robot, and what is visible in a room.

Positions are metres in the world frame, headings radians from x to y. A path stays on free cells.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components, dijkstra

from placegraph.runtime.arrays import F64, I32, I64, Bool
from placegraph.tools.simulator.house_model import ON_FLOOR, Floor, House, Room

STEP_S = 0.02  # of the motion; frames are interpolated
NEAR_M, FAR_M = 0.6, 4.5  # distances at which an item is seen well
LOW, HIGH = np.radians(-40.0), np.radians(10.0)  # elevations that the downward looking camera sees
TALL_M = 1.4  # higher furniture occludes
ITEM_WORTH, WALL_WORTH = 1.0, 0.4
ROOMY_CLEARANCE_M = 0.35  # no cost for clearance above this
SPACING_M = 0.02  # between the points of a path
LOOK_AHEAD_M = 0.5
TURN_RADII_M = (0.35, 0.25, 0.15, 0.08)  # radii of the circle on which the robot looks around
TURN_RATE = np.radians(38.0)  # rad/s
TURN_ACCELERATION = np.radians(110.0)  # rad/s^2
ACCELERATION = 0.7  # m/s^2


@dataclass(frozen=True, eq=False)
class FreeSpace:
    """Where the centre of the robot may be on one floor: free (H, W), rows along y, with a corner at origin_m."""

    origin_m: F64
    free: Bool
    cell_m: float
    clearance_m: F64  # (H, W) from a cell to the nearest that is not free; 0 there
    graph: csr_array  # (H * W, H * W) costs of steps between neighbouring free cells
    reachable: Bool  # (H * W,) the largest connected part of the free cells

    def cells(self, xy: F64) -> NDArray[np.intp]:
        """(N,) flat indices of the cells that hold points (N, 2), world frame; -1 outside of the grid."""
        col, row = np.floor((np.atleast_2d(xy) - self.origin_m) / self.cell_m).astype(np.intp).T
        inside = (row >= 0) & (row < self.free.shape[0]) & (col >= 0) & (col < self.free.shape[1])
        return np.where(inside, row * self.free.shape[1] + col, -1)

    def middles(self, cells: NDArray[np.intp]) -> F64:
        """(N, 2) middles in metres, world frame, of cells (N,)."""
        row, col = np.divmod(cells, self.free.shape[1])
        return np.asarray(self.origin_m + (np.stack((col, row), axis=-1) + 0.5) * self.cell_m)

    def clearance(self, xy: F64) -> F64:
        """(N,) metres from the cells of points (N, 2) to the nearest that is not free; 0 where not free."""
        cells = self.cells(xy)
        return np.where(cells >= 0, self.clearance_m.reshape(-1)[cells], 0.0)

    def nearest(self, xy: F64) -> int:
        """The reachable cell that is nearest to a point (2,); there must be one."""
        cells = np.flatnonzero(self.reachable)
        return int(cells[np.argmin(np.linalg.norm(self.middles(cells) - xy, axis=1))])

    def turn_radius(self, xy: F64, heading: float) -> float:
        """The largest of a few radii with which a circle through xy (2,), centred straight ahead, is free."""
        angles = np.linspace(0, 2 * np.pi, 120)
        ring = np.stack((np.cos(angles), np.sin(angles)), axis=1) + unit_vector(heading)
        return next((radius for radius in TURN_RADII_M if self.clearance(xy + radius * ring).min() > self.cell_m), 0.0)


@dataclass(frozen=True, eq=False)
class RouteField:
    """The cheapest routes from all cells to one: cost (H * W,), infinite without a route, and the next cell."""

    goal: int
    cost: F64
    next_cell: I32


def build_free_space(origin_m: F64, free: Bool, cell_m: float) -> FreeSpace:
    """The free space of a grid (H, W), rows along y, whose first corner is at origin_m (2,), world frame."""
    padded = np.pad(free, 1)  # what lies beyond the grid is not free
    clearance = np.asarray(distance_transform_edt(padded), float)[1:-1, 1:-1] * cell_m
    toll = 1.0 + 4.0 * np.clip(1.0 - clearance / ROOMY_CLEARANCE_M, 0.0, 1.0)
    index = np.arange(free.size).reshape(free.shape)
    width = free.shape[1]
    starts, ends, costs = [], [], []
    for down, right in ((0, 1), (1, 0), (1, 1), (1, -1)):
        row = slice(0, free.shape[0] - down)
        first = (row, slice(0, width - right) if right >= 0 else slice(1, width))
        second = (slice(down, None), slice(right, None) if right >= 0 else slice(0, width - 1))
        open_way = free[first] & free[second]
        if down and right:  # a diagonal step must not cut a corner
            open_way &= free[first[0], second[1]] & free[second[0], first[1]]
        starts.append(index[first][open_way])
        ends.append(index[second][open_way])
        costs.append((toll[first] + toll[second])[open_way] * (0.5 * cell_m * np.hypot(down, right)))
    entries = (np.concatenate(costs), (np.concatenate(starts), np.concatenate(ends)))
    graph = csr_array(coo_array(entries, shape=(free.size, free.size)))
    _, part = connected_components(graph, directed=False)
    reachable = (part == np.argmax(np.bincount(part, weights=free.reshape(-1)))) & free.reshape(-1)
    return FreeSpace(np.asarray(origin_m, float), free, cell_m, clearance, graph, reachable)


def routes_to(free_space: FreeSpace, goal: int) -> RouteField:
    """The cheapest routes to a cell from everywhere."""
    cost, next_cell = dijkstra(free_space.graph, directed=False, indices=goal, return_predecessors=True)
    return RouteField(goal, cost, next_cell)


def route(free_space: FreeSpace, routes: RouteField, start_xy: F64) -> F64:
    """(N, 2) a smooth path on free cells from a point (2,) to the goal's centre, metres, world frame."""
    cells = [int(free_space.cells(start_xy)[0])]
    while cells[-1] != routes.goal:
        cells.append(int(routes.next_cell[cells[-1]]))
    points = np.concatenate((np.reshape(start_xy, (1, 2)), free_space.middles(np.array(cells, np.intp))))
    return _smoothed(free_space, _shortcut(free_space, points))


def resample(points: F64, spacing_m: float = SPACING_M) -> F64:
    """(M, D) the polyline (N, D) with points at most spacing_m apart."""
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    along = np.concatenate(([0.0], np.cumsum(lengths)))
    if along[-1] == 0.0:
        return points[:1]
    at = np.linspace(0.0, along[-1], int(np.ceil(along[-1] / spacing_m)) + 1)
    return np.stack([np.interp(at, along, column) for column in points.T], axis=1)


def _shortcut(free_space: FreeSpace, points: F64) -> F64:
    """The path with straight lines of up to 3 m where they keep the same clearance."""
    clear = free_space.clearance(points)
    kept_indices = [0]
    while kept_indices[-1] < len(points) - 1:
        start = kept_indices[-1]
        end = min(start + 60, len(points) - 1)
        while end > start + 1:
            min_clearance = min(float(clear[start : end + 1].min()), 0.6 * ROOMY_CLEARANCE_M)
            if free_space.clearance(resample(points[[start, end]])).min() >= min_clearance:
                break
            end -= 1
        kept_indices.append(end)
    return points[kept_indices]


def _smoothed(free_space: FreeSpace, points: F64) -> F64:
    """The path with rounded corners: points move towards the middle of their neighbours while clearance allows."""
    path = resample(points, 0.05)
    for _ in range(80):
        clear = np.minimum(free_space.clearance(path), 0.4 * ROOMY_CLEARANCE_M)
        middle = 0.5 * path[1:-1] + 0.25 * (path[:-2] + path[2:])
        is_clear = free_space.clearance(middle) >= clear[1:-1]
        path[1:-1] = np.where(is_clear[:, None], middle, path[1:-1])
    path = resample(path)
    off = free_space.clearance(path) <= 0.0  # a line between two free cells may touch the corner of a third
    if off.any():
        path[off] = free_space.middles(np.array([free_space.nearest(xy) for xy in path[off]], np.intp))
    return path


@dataclass
class RobotMotion:
    """State of the robot, and a sample of (x, y, z, heading, speed, tilt) every STEP_S."""

    xyz: F64  # of the point on the floor below the camera, metres, world
    heading: float  # radians, never wrapped
    cruise_mps: float
    tilt: float = 0.0  # radians the camera looks further down than usual
    speed_mps: float = 0.0
    turn_rate: float = 0.0  # rad/s
    samples: list[tuple[float, float, float, float, float, float]] = field(default_factory=list)

    def follow(self, points: F64, tilt: float = 0.0) -> None:
        """Moves along a path (N, 3), metres, world frame, looking ahead (`tilt` radians further down)."""
        path = resample(points)
        if len(path) < 2:
            return
        along = np.linspace(0.0, float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum()), len(path))
        done = 0.0
        while done < along[-1] - 0.005:
            ahead = path[min(int(np.searchsorted(along, done + LOOK_AHEAD_M)), len(path) - 1)]
            way = ahead[:2] - self.xyz[:2]
            error = wrap_angle(np.arctan2(way[1], way[0]) - self.heading) if np.hypot(*way) > 0.15 else 0.0
            self._turn(error, tilt)
            braked = float(np.sqrt(2 * ACCELERATION * (along[-1] - done))) + 0.03
            target_speed = min(self.cruise_mps * float(np.clip((1.15 - abs(error)) / 0.85, 0, 1)), braked)
            self.speed_mps += float(np.clip(target_speed - self.speed_mps, -0.03, ACCELERATION * STEP_S))
            done += self.speed_mps * STEP_S
            self.xyz = np.array([np.interp(done, along, column) for column in path.T])
            self._sample()

    def turn_to(self, goals: list[float], radius_m: float) -> None:
        """Turns to headings one after the other on a circle whose centre is `radius_m` straight ahead."""
        middle = self.xyz[:2] + radius_m * unit_vector(self.heading)
        for goal in goals:  # the last few degrees are turned while moving on
            while abs(goal - self.heading) > np.radians(30.0 if goal == goals[-1] else 10.0):
                self._turn(goal - self.heading, 0.0)
                self.xyz = np.append(middle - radius_m * unit_vector(self.heading), self.xyz[2])
                self.speed_mps = 0.0
                self._sample()

    def _turn(self, error: float, tilt: float) -> None:
        target_rate = float(np.clip(2.5 * error, -TURN_RATE, TURN_RATE))
        max_change = TURN_ACCELERATION * STEP_S
        self.turn_rate += float(np.clip(target_rate - self.turn_rate, -max_change, max_change))
        self.heading += self.turn_rate * STEP_S
        self.tilt += (tilt - self.tilt) * STEP_S / 0.8

    def _sample(self) -> None:
        x, y, z = self.xyz.tolist()
        self.samples.append((x, y, z, self.heading, self.speed_mps, self.tilt))


def wrap_angle(angle: float) -> float:
    """The same angle in [-pi, pi), radians."""
    return float((angle + np.pi) % (2 * np.pi) - np.pi)


def unit_vector(heading: float) -> F64:
    """(2,) the unit vector of a heading."""
    return np.array([np.cos(heading), np.sin(heading)])


@dataclass(eq=False)
class RoomVisibility:
    """Targets (T, 3) in a room with their worth, and the edges (E, 2, 2) in plan that occlude them."""

    room: Room
    targets: F64
    worth: F64
    owner: I64  # (T,) item id, -1 for a wall
    edges: F64
    edge_owner: I64  # (E,) item id, -1 for a wall
    seen: Bool  # (T,)
    passage_middles: F64  # (K, 2) middles of doors and archways
    entered: bool = False

    def views(self, eyes: F64) -> tuple[Bool, F64]:
        """(S, T) whether each eye (S, 3) sees each target, and the bearing of the target in radians."""
        way = self.targets[None] - eyes[:, None]
        flat = np.hypot(way[..., 0], way[..., 1])
        rise = np.arctan2(way[..., 2], flat)
        visible = (flat > NEAR_M) & (flat < FAR_M) & (rise > LOW) & (rise < HIGH)
        reach = way[..., :2] * np.maximum(1.0 - 0.4 / np.maximum(flat, 0.5), 0.0)[..., None]
        for (a, b), owner in zip(self.edges, self.edge_owner, strict=True):
            hit = _segments_cross(eyes[:, None, :2], reach, a, b - a)
            visible &= ~hit | ((self.owner == owner) & (owner >= 0))[None]
        return visible, np.arctan2(way[..., 1], way[..., 0])


def room_visibility(house: House, floor: Floor, room: Room) -> RoomVisibility:
    """The targets of a room: its items, and points on its walls every .6 m."""
    around = np.vstack((room.polygon, room.polygon[:1]))
    walls = resample(around, 0.6)[:-1]
    items = [item for item in house.items if item.room == room.id]
    targets = [item.box.mean(axis=0) for item in items] + [np.append(xy, floor.z_m + 1.0) for xy in walls]
    edges, owners = list(np.stack((around[:-1], around[1:]), axis=1)), [-1] * len(room.polygon)
    for item in items:
        if item.support == ON_FLOOR and item.box[1, 2] - floor.z_m > TALL_M:
            edges += list(np.stack((item.footprint, np.roll(item.footprint, -1, axis=0)), axis=1))
            owners += [item.id] * 4
    worth = np.array([ITEM_WORTH] * len(items) + [WALL_WORTH] * len(walls))
    owner = np.array([item.id for item in items] + [-1] * len(walls), np.int64)
    seen = np.zeros(len(targets), bool)
    return RoomVisibility(
        room,
        np.array(targets),
        worth,
        owner,
        np.array(edges),
        np.array(owners, np.int64),
        seen,
        _passage_middles(floor, room),
    )


def _passage_middles(floor: Floor, room: Room) -> F64:
    """(K, 2) middles of the doors and archways of a room; of the room itself when there are none."""
    middles = []
    for wall in floor.walls:
        middles += [wall.middle_of(opening) for opening in wall.openings if room.id in opening.rooms]
    return np.array(middles or [room.polygon.mean(axis=0)])


def _segments_cross(starts: F64, directions: F64, a: F64, side: F64) -> Bool:
    """Which segments from starts (S, 1, 2) along directions (S, T, 2) cross the one from a (2,) along side (2,)."""
    across = directions[..., 0] * side[1] - directions[..., 1] * side[0]
    across = np.where(np.abs(across) < 1e-12, 1e-12, across)
    gap = a - starts
    t = (gap[..., 0] * side[1] - gap[..., 1] * side[0]) / across
    u = (gap[..., 0] * directions[..., 1] - gap[..., 1] * directions[..., 0]) / across
    return np.asarray((t > 0) & (t < 1) & (u >= 0) & (u <= 1))
