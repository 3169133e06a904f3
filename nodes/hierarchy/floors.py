"""Floors from the heights of horizontal layers and the camera's path.

Source: paper, floor layer (height histogram, peaks, DBSCAN, the two strongest of each cluster, pairs).
Departs: a layer weighs by the plan area it covers, so that walls and dense scans of one corner do not drown a floor;
weak layers are kept, since h > .9 h_max loses floors of partial scans; of each pair the camera's path decides what is
a floor (someone stood above it) and what a ceiling; there is always a floor where there are points. Levels less than
`storey_m` above a floor (steps, landings, split levels) belong to it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydantic import BaseModel
from scipy.ndimage import gaussian_filter1d
from scipy.signal import find_peaks

from placegraph.runtime.arrays import F64, I64, Points


class FloorConfig(BaseModel, frozen=True, strict=True, extra="forbid"):
    """Parameters of the floor layer."""

    bin_m: float = 0.01  # paper, floor layer
    smooth_m: float = 0.02  # departs: depth noise spreads a floor over some bins
    separation_m: float = 0.2  # paper, delta_f
    keep_share: float = 0.2  # departs: paper .9 (p_h); a user of HOV-SG needed .2 on partial scans
    slab_m: float = 0.6  # DBSCAN eps: ceiling and next floor are one cluster, floor and table (.7) are not
    cell_m: float = 0.1  # plan cells that make up a layer's area
    rise_share: float = 0.3  # departs: of a layer's area, what it has more than the heights around it: walls have peaks
    storey_m: float = 2.0  # least height from a floor to its ceiling or the next floor
    # departs: of a floor whose ceiling is not in view, as a camera held level at 1.4 m sees it from 5 m on only
    ceiling_m: float = 2.5
    camera_min_m: float = 0.15  # a robot's sensor, or a person's hand, above its floor
    camera_max_m: float = 2.2
    below_share: float = 0.1  # of the seen plan area; more than this well below a layer says that it is no floor
    upper_share: float = 0.25  # of a slab's stronger layer, for its upper one to be a floor and not beds on that floor
    stood_share: float = 0.1  # of the path above the floors below, for a layer to carry it
    camera_share: float = 0.05  # of the path must be too high for the floors below before another is looked for


@dataclass(frozen=True)
class FloorSpan:
    """Heights in metres, world frame: of the floor, of its ceiling (or the highest point), and where its zone ends."""

    low: float
    high: float
    zone_low: float  # points from here
    zone_high: float  # to here are this floor's
    expected: float = -np.inf  # of a ceiling that was not seen

    @property
    def ceiling(self) -> float:
        """Where the floor ends: at its ceiling, or where one is expected, or above that at the highest point."""
        return max(self.high, self.expected)


@dataclass(frozen=True)
class _Layer:
    height: float
    area: float


def find_floors(points_world: Points, camera_positions_world: Points, config: FloorConfig) -> list[FloorSpan]:
    """Floors from the lowest up; none only where there are no points.

    points_world: (P, 3) one point per voxel of the map; camera_positions_world: (K, 3); metres, world frame.
    Source: paper, section "Floor Layer"; departures at the head of this file.
    """
    if not len(points_world):
        return []
    z = np.asarray(points_world[:, 2], float)
    plan, cells = _plan_cells(points_world, config)
    slabs = _slabs(_layers(z, plan, cells, config), config)
    cameras = np.sort(np.asarray(camera_positions_world[:, 2], float))
    lows = [_ground(z, plan, cells, slabs, cameras, config)]
    while True:
        standing = cameras[cameras > lows[-1] + config.camera_max_m]
        if len(standing) < max(1, config.camera_share * len(cameras)):
            break
        upper = _floor_above(slabs, lows[-1] + config.storey_m, standing, config)
        if upper is None:
            break
        lows.append(upper)
    return _spans(lows, slabs, z, config)


def _layers(z: F64, plan: I64, cells: int, config: FloorConfig) -> list[_Layer]:
    """Strong peaks of covered plan area over height, lowest first."""
    bottom = np.floor(z.min() / config.bin_m) - 1
    level = (z / config.bin_m - bottom).astype(np.int64)
    keys = np.sort(level * cells + plan)  # twice as fast as np.unique, and this is most of the floor layer's time
    covered = keys[np.r_[True, keys[1:] != keys[:-1]]] // cells
    area = np.bincount(covered, minlength=int(level.max()) + 2) * config.cell_m**2
    area = gaussian_filter1d(area.astype(float), config.smooth_m / config.bin_m, mode="constant")
    distance = max(1, round(config.separation_m / config.bin_m))
    # padded: a peak at either end is one too
    peaks, found = find_peaks(np.r_[0.0, area, 0.0], distance=distance, prominence=0.0)
    if not len(peaks):
        return []
    covered = area[peaks - 1]
    strong = (covered > config.keep_share * covered.max()) & (found["prominences"] >= config.rise_share * covered)
    return [_Layer((p + bottom - 0.5) * config.bin_m, float(area[p - 1])) for p in peaks[strong]]


def _plan_cells(points: Points, config: FloorConfig) -> tuple[I64, int]:
    """The plan cell (N,) of each point, and how many there are in all."""
    # a column at a time: along the rows of (N, 2) minima take longer than all the rest
    x, y = (np.floor(np.asarray(points[:, axis], float) / config.cell_m).astype(np.int64) for axis in (0, 1))
    x, y = x - x.min(), y - y.min()
    depth = int(y.max()) + 1
    return x * depth + y, (int(x.max()) + 1) * depth


def _slabs(layers: list[_Layer], config: FloorConfig) -> list[list[_Layer]]:
    """Layers in clusters. In one dimension, with every point a core point, DBSCAN is a cut at each gap over eps."""
    slabs: list[list[_Layer]] = []
    for layer in layers:
        if slabs and layer.height - slabs[-1][-1].height <= config.slab_m:
            slabs[-1].append(layer)
        else:
            slabs.append([layer])
    return slabs


def _below(layer: _Layer, cameras: F64, config: FloorConfig) -> int:
    over = cameras - layer.height
    return int(((over > config.camera_min_m) & (over < config.camera_max_m)).sum())


def _ground(z: F64, plan: I64, cells: int, slabs: list[list[_Layer]], cameras: F64, config: FloorConfig) -> float:
    """The lowest layer that someone stood above and that has next to nothing beneath it."""
    lowest = np.full(cells, np.inf)
    np.minimum.at(lowest, plan, z)
    seen = np.count_nonzero(lowest < np.inf)
    for layer in (layer for slab in slabs for layer in slab):
        beneath = np.count_nonzero(lowest < layer.height - config.separation_m)
        if beneath > config.below_share * seen:
            break
        if _below(layer, cameras, config) or not len(cameras):
            return layer.height
    return float(np.percentile(z, 0.5))  # provisional: no floor in view yet


def _floor_above(slabs: list[list[_Layer]], least: float, standing: F64, config: FloorConfig) -> float | None:
    """The next floor at or above `least`: of a slab's two strongest layers the upper, if it may be a floor at all."""
    for slab in slabs:
        pair = sorted(sorted(slab, key=lambda layer: -layer.area)[:2], key=lambda layer: -layer.height)
        for layer in pair:
            comparable = layer.area >= config.upper_share * max(other.area for other in pair)
            stood_on = _below(layer, standing, config) >= config.stood_share * len(standing)
            if layer.height >= least and comparable and stood_on:
                return layer.height
    return None


def _spans(lows: list[float], slabs: list[list[_Layer]], z: F64, config: FloorConfig) -> list[FloorSpan]:
    layers = [layer for slab in slabs for layer in slab]
    margin = config.separation_m / 2  # noise below a floor is that floor's
    top, z_min, z_max = float(np.percentile(z, 99.5)), float(z.min()), float(z.max())
    spans = []
    for i, low in enumerate(lows):
        last = i + 1 == len(lows)
        limit = top + margin if last else lows[i + 1] - margin
        above = [layer for layer in layers if low + config.storey_m <= layer.height <= limit]
        # nothing at storey height or more: what was seen ends the floor, of a lower one but for the walls of its stairs
        between = z[(z >= low) & (z <= limit)]
        seen = top if last else float(np.percentile(between, 98)) if len(between) else low
        high = max(above, key=lambda layer: layer.area).height if above else min(seen, limit)
        zone = (z_min if i == 0 else low - margin, z_max if last else limit)
        expected = -np.inf if above else min(low + config.ceiling_m, limit if not last else np.inf)
        spans.append(FloorSpan(low, max(high, low), *zone, expected))
    return spans
