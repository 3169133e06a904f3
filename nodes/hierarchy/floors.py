"""Floors from the heights of horizontal layers and the camera's path.

Source: paper, floor layer (height histogram, peaks, DBSCAN, the two strongest of each cluster, pairs).
Not as in the paper: a layer weighs by the plan area it covers, so that walls and dense scans of one corner do not hide
a floor; weak layers are kept, since h > .9 h_max loses floors of partial scans; the camera's path decides which layer
of a pair is a floor (someone stood above it) and which a ceiling; where there are points there is a floor. Levels less
than `storey_m` above a floor (steps, landings, split levels) belong to it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydantic import BaseModel
from scipy.ndimage import gaussian_filter1d
from scipy.signal import find_peaks

from placegraph.runtime.arrays import F64, I64, Points


class FloorConfig(BaseModel, frozen=True, strict=True, extra="forbid"):
    """Parameters of the floor layer. Values without a source were chosen by hand."""

    bin_m: float = 0.01  # paper, floor layer
    smooth_m: float = 0.02  # depth noise spreads a floor over some bins
    separation_m: float = 0.2  # paper, delta_f
    keep_share: float = 0.2  # of the largest layer's area, at least; the paper's .9 (p_h) loses floors of partial scans
    slab_m: float = 0.6  # DBSCAN eps: ceiling and next floor are one cluster, floor and table (.7) are not
    cell_m: float = 0.1  # plan cells that make up a layer's area
    # Minimum prominence of a layer over the heights around it, as a share of its area: the peaks of walls are small.
    rise_share: float = 0.3
    storey_m: float = 2.0  # minimum height from a floor to its ceiling or the next floor
    ceiling_m: float = 2.5  # assumed where no ceiling is in view: a level camera at 1.4 m sees it from 5 m on only
    camera_min_m: float = 0.15  # a robot's sensor, or a person's hand, above its floor
    camera_max_m: float = 2.2
    # A layer is not the lowest floor when more than this share of the seen plan area has points well below it.
    below_share: float = 0.1
    # A slab's upper layer is no floor (but the tops of beds) below this share of the area of the slab's largest layer.
    upper_share: float = 0.25
    # Minimum share of the camera path above the lower floors that must lie over a layer for it to be a floor.
    stood_share: float = 0.1
    # Minimum share of the camera path that must be too high for the floors found so far before another is looked for.
    camera_share: float = 0.05


@dataclass(frozen=True)
class FloorSpan:
    """Heights in metres, world frame: of a floor, of its ceiling or highest point, and of the zone of its points."""

    low_m: float
    high_m: float
    zone_low_m: float
    zone_high_m: float
    expected_ceiling_m: float = -np.inf  # where a ceiling is expected that was not seen

    @property
    def ceiling_m(self) -> float:
        """The seen ceiling, or the expected one, or the highest point above that."""
        return max(self.high_m, self.expected_ceiling_m)


@dataclass(frozen=True)
class _Layer:
    """A horizontal layer of the cloud: height (m, world) and covered plan area (m2)."""

    height: float
    area: float


def find_floors(points_world: Points, camera_positions_world: Points, config: FloorConfig) -> list[FloorSpan]:
    """Floors from the lowest up; none only where there are no points.

    points_world: (P, 3) one point per voxel of the map; camera_positions_world: (K, 3); metres, world frame.
    Source: paper, section "Floor Layer"; differences at the head of this file.
    """
    if not len(points_world):
        return []
    z = np.asarray(points_world[:, 2], float)
    plan, cells = _plan_cells(points_world, config)
    slabs = _slabs(_layers(z, plan, cells, config), config)
    cameras = np.sort(np.asarray(camera_positions_world[:, 2], float))
    lows = [_lowest_floor(z, plan, cells, slabs, cameras, config)]
    while True:
        above = cameras[cameras > lows[-1] + config.camera_max_m]
        if len(above) < max(1, config.camera_share * len(cameras)):
            break
        upper = _floor_above(slabs, lows[-1] + config.storey_m, above, config)
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
    peaks, properties = find_peaks(np.r_[0.0, area, 0.0], distance=distance, prominence=0.0)
    if not len(peaks):
        return []
    areas = area[peaks - 1]
    strong = (areas > config.keep_share * areas.max()) & (properties["prominences"] >= config.rise_share * areas)
    return [_Layer((p + bottom - 0.5) * config.bin_m, float(area[p - 1])) for p in peaks[strong]]


def _plan_cells(points: Points, config: FloorConfig) -> tuple[I64, int]:
    """The plan cell (N,) of each point, and how many there are in all."""
    # a column at a time: along the rows of (N, 2) minima take longer than all the rest
    x, y = (np.floor(np.asarray(points[:, axis], float) / config.cell_m).astype(np.int64) for axis in (0, 1))
    x, y = x - x.min(), y - y.min()
    depth = int(y.max()) + 1
    return x * depth + y, (int(x.max()) + 1) * depth


def _slabs(layers: list[_Layer], config: FloorConfig) -> list[list[_Layer]]:
    """Clusters of layers. In one dimension, with all points core points, DBSCAN is a cut at each gap over eps."""
    slabs: list[list[_Layer]] = []
    for layer in layers:
        if slabs and layer.height - slabs[-1][-1].height <= config.slab_m:
            slabs[-1].append(layer)
        else:
            slabs.append([layer])
    return slabs


def _count_standing(layer: _Layer, cameras: F64, config: FloorConfig) -> int:
    """How many cameras (heights) may stand on a layer."""
    over = cameras - layer.height
    return int(((over > config.camera_min_m) & (over < config.camera_max_m)).sum())


def _lowest_floor(z: F64, plan: I64, cells: int, slabs: list[list[_Layer]], cameras: F64, config: FloorConfig) -> float:
    """The lowest layer that someone stood above and that has next to nothing beneath it."""
    lowest = np.full(cells, np.inf)
    np.minimum.at(lowest, plan, z)
    seen = np.count_nonzero(lowest < np.inf)
    for layer in (layer for slab in slabs for layer in slab):
        beneath = np.count_nonzero(lowest < layer.height - config.separation_m)
        if beneath > config.below_share * seen:
            break
        if _count_standing(layer, cameras, config) or not len(cameras):
            return layer.height
    return float(np.percentile(z, 0.5))  # provisional: no floor in view yet


def _floor_above(slabs: list[list[_Layer]], min_m: float, cameras: F64, config: FloorConfig) -> float | None:
    """The next floor at or above `min_m`: the upper of a slab's two strongest layers, if it may be a floor at all."""
    for slab in slabs:
        pair = sorted(sorted(slab, key=lambda layer: -layer.area)[:2], key=lambda layer: -layer.height)
        for layer in pair:
            comparable = layer.area >= config.upper_share * max(peer.area for peer in pair)
            stood_on = _count_standing(layer, cameras, config) >= config.stood_share * len(cameras)
            if layer.height >= min_m and comparable and stood_on:
                return layer.height
    return None


def _spans(lows: list[float], slabs: list[list[_Layer]], z: F64, config: FloorConfig) -> list[FloorSpan]:
    layers = [layer for slab in slabs for layer in slab]
    margin = config.separation_m / 2  # points less than this below a floor are its noise
    top, z_min, z_max = float(np.percentile(z, 99.5)), float(z.min()), float(z.max())
    spans = []
    for i, low in enumerate(lows):
        last = i + 1 == len(lows)
        limit = top + margin if last else lows[i + 1] - margin
        above = [layer for layer in layers if low + config.storey_m <= layer.height <= limit]
        # Without a layer at storey height the highest points end the floor. A lower floor's highest 2 % are left out,
        # as they may be the walls of its stairs.
        between = z[(z >= low) & (z <= limit)]
        seen = top if last else float(np.percentile(between, 98)) if len(between) else low
        high = max(above, key=lambda layer: layer.area).height if above else min(seen, limit)
        zone = (z_min if i == 0 else low - margin, z_max if last else limit)
        expected_ceiling = -np.inf if above else min(low + config.ceiling_m, limit if not last else np.inf)
        spans.append(FloorSpan(low, max(high, low), *zone, expected_ceiling))
    return spans
