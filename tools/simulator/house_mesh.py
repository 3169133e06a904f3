"""All triangles of a house in one list with the vertex attributes that the renderer needs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from placegraph.runtime.arrays import F64, I64
from placegraph.runtime.errors import ConfigError
from placegraph.tools.simulator.house_model import House, Material, Part
from placegraph.tools.simulator.texture_atlas import TILE_PX

_EDGE_M = 0.5  # longer edges are cut: light is linear in between
_SMOOTH = 0.8  # faces whose normals differ less (cosine) look like one curved surface


@dataclass(frozen=True, eq=False)
class HouseMesh:
    """The triangles of a house and their attributes.

    corners (T, 3, 8) float64 as xyz world, uv, smooth normal; material, instance and texel density of each triangle.
    """

    corners: F64
    material: I64
    instance: I64
    texels_per_m: F64


def house_mesh(house: House) -> tuple[list[Material], HouseMesh]:
    """The different materials, and every part of the house in the world frame with long edges split."""
    owners: list[tuple[Part, F64, int]] = [(part, np.eye(4), 0) for part in house.structure]
    owners += [(part, placed.world_from_item, placed.id + 1) for placed in house.items for part in placed.item.parts]
    owners = [owner for owner in owners if len(owner[0].faces)]
    if not owners:
        raise ConfigError("the house has neither structure nor items: there is nothing to render")
    numbers: dict[Material, int] = {}
    corners, texels, material, instance = [], [], [], []
    for part, pose, number in owners:
        corners_in_item = part.vertices[part.faces]
        uv, texels_per_m = box_uv_mapping(corners_in_item, part.material)
        world = corners_in_item @ pose[:3, :3].T + pose[:3, 3]
        corners.append(np.concatenate((world, uv, _smooth_normals(part) @ pose[:3, :3].T), axis=-1))
        texels.append(texels_per_m)
        material.append(np.full(len(corners_in_item), numbers.setdefault(part.material, len(numbers))))
        instance.append(np.full(len(corners_in_item), number))
    cut, source = _split_long_edges(np.concatenate(corners))
    return list(numbers), HouseMesh(
        cut, np.concatenate(material)[source], np.concatenate(instance)[source], np.concatenate(texels)[source]
    )


def box_uv_mapping(corners: F64, material: Material) -> tuple[F64, F64]:
    """Texture coordinates (F, 3, 2) in repeats of a part's corners (F, 3, 3), and its texels per metre (F,).

    Each face is projected along the axis nearest to its normal, upright and unmirrored from outside; the grain of wood
    runs along the longer side of the part.
    """
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    axis = np.argmax(np.abs(normal) + np.array([2e-9, 1e-9, 0]), axis=1)
    sign = np.where(np.take_along_axis(normal, axis[:, None], axis=1)[:, 0] < 0, -1.0, 1.0)
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    axes = np.array([[1, 2], [0, 2], [0, 1]])[axis]
    signs = np.stack((np.choose(axis, [sign, -sign, 1.0]), np.choose(axis, [-1.0, -1.0, -sign])), axis=1)
    if material.texture == "wood":
        turned = (high - low)[axes[:, 1]] > (high - low)[axes[:, 0]] * 1.01
        axes[turned], signs[turned] = axes[turned, ::-1], signs[turned, ::-1]
    if material.texture == "plain":
        return np.zeros((*corners.shape[:2], 2)), np.zeros(len(corners))
    position = np.take_along_axis(corners, np.repeat(axes[:, None], 3, axis=1), axis=2)
    if material.scale_m > 0:
        return position * signs[:, None] / material.scale_m, np.full(len(corners), TILE_PX / material.scale_m)
    extent = np.maximum((high - low)[axes], 1e-6)
    share = (position - low[axes][:, None]) / extent[:, None]
    share = np.where(signs[:, None] > 0, share, 1 - share)
    return np.clip(share, 1e-3, 1 - 1e-3), TILE_PX / extent.min(axis=1)


def _smooth_normals(part: Part) -> F64:
    """(F, 3, 3) unit corner normals: the mean over adjacent faces; edges sharper than _SMOOTH stay sharp."""
    corners = part.vertices[part.faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    flat = part.faces.ravel()
    order = np.argsort(flat, kind="stable")
    start, count = np.searchsorted(flat[order], flat), np.bincount(flat, minlength=flat.max() + 1)[flat]
    corner = np.repeat(np.arange(len(flat)), count)
    within = np.arange(len(corner)) - np.repeat(np.cumsum(count) - count, count)
    neighbor = order[start[corner] + within]
    own_normal, neighbor_normal = normal[corner // 3], normal[neighbor // 3]
    neighbor_normal = neighbor_normal * (np.einsum("ij,ij->i", own_normal, neighbor_normal) > _SMOOTH)[:, None]
    total: F64 = np.stack([np.bincount(corner, neighbor_normal[:, k], len(flat)) for k in range(3)], axis=1).astype(
        np.float64
    )
    total /= np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-12)
    return total.reshape(-1, 3, 3)


def _split_long_edges(corners: F64) -> tuple[F64, I64]:
    """Triangles (T, 3, K) split at their longest edge until none exceeds _EDGE_M, and their source indices.

    An edge is split at its middle in both adjacent triangles, so that no cracks appear.
    """
    source = np.arange(len(corners))
    done, origin = [], []
    while len(corners):
        edge = np.linalg.norm(corners[:, [1, 2, 0], :3] - corners[..., :3], axis=-1)
        long = edge.max(axis=1) > _EDGE_M
        done.append(corners[~long])
        origin.append(source[~long])
        corners, source, longest = corners[long], source[long], edge[long].argmax(axis=1)
        each = np.arange(len(corners))
        a, b, c = (corners[each, (longest + k) % 3] for k in range(3))
        middle = (a + b) / 2
        corners = np.concatenate((np.stack((a, middle, c), axis=1), np.stack((middle, b, c), axis=1)))
        source = np.concatenate((source, source))
    return np.concatenate(done), np.concatenate(origin)
