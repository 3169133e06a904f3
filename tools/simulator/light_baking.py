"""Light baked into the triangles of a house: shadow rays to the lamps, and ambient occlusion.

Computed once per house at the corners of the triangles and linear in between.
"""

from __future__ import annotations

import numpy as np
from embreex.rtcore_scene import EmbreeScene

from placegraph.runtime.arrays import F64, I64
from placegraph.tools.simulator.house_model import House

_LAMPS = 3  # lamps per triangle
_AMBIENT_RAYS = 12  # ambient occlusion rays per corner
_CLOSE_M = 0.45  # an obstacle at this distance occludes 63 %
_COVER_M = 0.08  # thinner items (rugs, pictures) cast no shadow on their support


def nearest_lamps(house: House, points: F64) -> F64:
    """(T, _LAMPS, 3) the nearest lamps on the floor of each point; far above where there are fewer."""
    lamps = np.array([*house.lights, *[(0.0, 0.0, 1e4 + k) for k in range(_LAMPS)]], float)
    levels = np.array(sorted(floor.z_m for floor in house.floors))
    level, lamp_level = (np.searchsorted(levels, z - 0.02, side="right") for z in (points[:, 2] + 0.04, lamps[:, 2]))
    apart = np.stack([((points - lamp) ** 2).sum(axis=1) for lamp in lamps], axis=1)
    apart += 1e6 * (level[:, None] != lamp_level) * (lamps[:, 2] < 9e3)
    nearest = []
    for _ in range(_LAMPS):
        nearest.append(apart.argmin(axis=1))
        apart[np.arange(len(points)), nearest[-1]] = np.inf
    return np.asarray(lamps[np.stack(nearest, axis=1)])


def bake_light(house: House, scene: EmbreeScene, corners: F64) -> F64:
    """(T, 3) light at the corners (T, 3, 8) of a mesh, about 0.3 in a nook to 1.2 under a lamp.

    Corners at one point with one normal share their light, which is smooth and saves three quarters of the rays.
    """
    world, normals = corners[..., :3], corners[..., 5:8]
    inward = world.mean(axis=1, keepdims=True) - world
    inward *= np.minimum(1, 0.04 / np.maximum(np.linalg.norm(inward, axis=-1, keepdims=True), 1e-9))
    group, count = _corner_groups(world, normals)
    point, normal = (_mean(values.reshape(-1, 3), group, count) for values in (world + inward, normals))
    point += 0.006 * normal  # the corner itself may touch another surface, hence also the pull inward
    covered = _ray_lengths_m(scene, point, normal, _COVER_M) < 0.999 * _COVER_M
    point += (covered * (_COVER_M + 0.01))[:, None] * normal
    light = _ambient_light(scene, point, normal) + _lamp_light(scene, point, normal, nearest_lamps(house, point))
    return np.asarray(light[group].reshape(world.shape[:2]))


def _ambient_light(scene: EmbreeScene, point: F64, normal: F64) -> F64:
    """(N,) ambient light, less in nooks and near contact; more of it comes from above."""
    # the same directions everywhere: random ones cause blotches on plain walls
    height = 1 - (2 * np.arange(_AMBIENT_RAYS) + 1) / _AMBIENT_RAYS
    turn, ring = np.arange(_AMBIENT_RAYS) * np.pi * (3 - np.sqrt(5)), np.sqrt(1 - height**2)
    total = np.zeros(len(point))
    for sphere in np.stack((ring * np.cos(turn), ring * np.sin(turn), height), axis=1):
        way = normal + 0.98 * sphere
        free_m = _ray_lengths_m(scene, point, way, 4 * _CLOSE_M)
        total += (0.34 + 0.06 * way[:, 2]) / _AMBIENT_RAYS * (1 - np.exp(-free_m / _CLOSE_M))
    return total


def _lamp_light(scene: EmbreeScene, point: F64, normal: F64, lamps: F64) -> F64:
    """(N,) direct light of the lamps (N, _LAMPS, 3)."""
    total = np.zeros(len(point))
    for k in range(_LAMPS):
        way = lamps[:, k] - point
        apart_m = np.linalg.norm(way, axis=1)
        facing = np.einsum("ij,ij->i", way, normal) / np.maximum(apart_m, 1e-6)
        open_m = np.maximum(apart_m - 0.4, 0.01)  # the lampshade around the lamp throws no shadow
        seen = _ray_lengths_m(scene, point, way, open_m) > 0.999 * open_m  # Embree computes in float32
        total += seen * np.clip(0.15 + 0.85 * facing, 0, 1) * 1.2 / np.maximum(apart_m, 0.9)
    return total


def _ray_lengths_m(scene: EmbreeScene, point: F64, way: F64, limit_m: F64 | float) -> F64:
    """(N,) free length of a ray from each point, at most `limit_m`."""
    unit = way / np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-9)
    limit = np.broadcast_to(limit_m, len(point)).astype(np.float32)
    ends = scene.run(point.astype(np.float32), unit.astype(np.float32), dists=limit, query="DISTANCE")
    return np.asarray(np.minimum(ends, limit).astype(np.float64))


def _corner_groups(world: F64, normal: F64) -> tuple[I64, I64]:
    """Corners at one point with one normal: (3 T,) group of each corner, and the size of each group."""
    place = np.round((world - world.min(axis=(0, 1))) * 500).astype(np.int64)  # steps of 2 mm, 17 bits of them
    facing = np.round(normal * 3 + 3).astype(np.int64)
    key = ((place[..., 0] << 34) + (place[..., 1] << 17) + place[..., 2]) * 512
    key += facing[..., 0] * 64 + facing[..., 1] * 8 + facing[..., 2]
    _, group, count = np.unique(key.ravel(), return_inverse=True, return_counts=True)
    return group, count


def _mean(values: F64, group: I64, count: I64) -> F64:
    """(G, 3) mean of each group's values (N, 3)."""
    return np.stack([np.bincount(group, values[:, k]) / count for k in range(3)], axis=1)
