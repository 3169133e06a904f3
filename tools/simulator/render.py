"""Renders a house: one ray per pixel into an Embree scene, with baked light.

Everything slow happens once per house (house_mesh.py, light_baking.py). A frame then costs the rays, a dozen table
lookups per pixel and one bilinear lookup in the texture atlas.
"""

from __future__ import annotations

import cv2
import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from placegraph.runtime.arrays import F32, F64, I64, U8
from placegraph.runtime.errors import ConfigError
from placegraph.tools.simulator.camera_sensor import RenderedView
from placegraph.tools.simulator.house_mesh import HouseMesh, house_mesh
from placegraph.tools.simulator.house_model import House, Material
from placegraph.tools.simulator.light_baking import bake_light, nearest_lamps
from placegraph.tools.simulator.texture_atlas import LEVEL_LEFT_PX, LEVEL_SIZES_PX, LEVELS, atlas

_BAND_ROWS = 32  # rows per band: intermediate arrays stay in the processor's cache


class Renderer:
    """Renders one house from any pose; frames of the same pose are equal to the byte."""

    def __init__(self, house: House, width: int = 640, height: int = 480, horizontal_fov: float = 1.2) -> None:
        if width < 8 or height < 8 or not 0 < horizontal_fov < 3:
            raise ConfigError(f"a picture of {width} x {height} px over {horizontal_fov} rad cannot be rendered")
        self.width, self.height = width, height
        focal_px = width / 2 / np.tan(horizontal_fov / 2)
        self.intrinsics: F64 = np.array([focal_px, focal_px, (width - 1) / 2, (height - 1) / 2])
        materials, mesh = house_mesh(house)
        self._texels = atlas(materials)
        self._scene = EmbreeScene()
        world = np.ascontiguousarray(mesh.corners[..., :3], np.float32)
        self._embree_mesh = TriangleMesh(self._scene, world)
        self._build_tables(mesh, materials)
        self._bake_lighting(house, mesh, materials)
        fx, fy, cx, cy = self.intrinsics
        self._across = ((np.arange(width) - cx) / fx).astype(np.float32)[:, None]  # a pixel's ray: (across, down, 1)
        self._down = ((np.arange(height) - cy) / fy).astype(np.float32)[:, None]

    def render(self, world_from_camera: F64) -> RenderedView:
        """The house seen from a (4, 4) pose; camera frame x right, y down, z forward, metres.

        Raises:
            ConfigError: the pose is not a finite (4, 4) matrix.
        """
        if world_from_camera.shape != (4, 4) or not np.isfinite(world_from_camera).all():
            raise ConfigError("world_from_camera must be a finite (4, 4) matrix")
        turn = world_from_camera[:3, :3].astype(np.float32)
        eye = world_from_camera[:3, 3].astype(np.float32)
        shape = (self.height, self.width)
        color, shine = np.empty((*shape, 3), np.uint8), np.empty(shape, np.uint8)
        view = RenderedView(color, np.empty(shape, np.float32), np.empty(shape, np.uint16), shine)
        blur = self._blur_per_m(eye)
        for top in range(0, self.height, _BAND_ROWS):
            self._render_band(view, slice(top, min(top + _BAND_ROWS, self.height)), turn, eye, blur)
        return view

    def _build_tables(self, mesh: HouseMesh, materials: list[Material]) -> None:
        """Per-triangle tables; the last row, index -1, is for rays that hit nothing."""
        gloss = np.array([material.gloss for material in materials])[mesh.material]
        glow = np.array([material.glow for material in materials])[mesh.material]
        world, uv = mesh.corners[..., :3], mesh.corners[..., 3:5]
        normal = np.cross(world[:, 1] - world[:, 0], world[:, 2] - world[:, 0])
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
        self._instance = np.append(mesh.instance, 0).astype(np.uint16)
        self._gloss = np.append(gloss, 0).astype(np.float32)
        self._shine = np.append(np.round(255 * np.clip(np.maximum(gloss, glow), 0, 1)), 0).astype(np.uint8)
        self._normal = _columns(np.append(normal, [[0, 0, 1]], axis=0))
        self._middle = _columns(np.append(world.mean(axis=1), [[0, 0, 0]], axis=0))
        origin = self._texels.origins_px[mesh.material]
        self._uv = [_affine_table(uv[..., k] - np.floor(uv[:, :1, k])) for k in range(2)]
        self._origin = _columns(np.append(origin, [[0, 0]], axis=0))
        # the level of detail is rounded to the nearest, hence the root of two
        blur = mesh.texels_per_m * np.sqrt(2) / self.intrinsics[0]
        self._texels_per_px_m = np.append(blur, 0).astype(np.float32)

    def _bake_lighting(self, house: House, mesh: HouseMesh, materials: list[Material]) -> None:
        """Bakes the light at the corners and chooses its colour, which varies with the seed."""
        glow = np.array([material.glow for material in materials])[mesh.material][:, None]
        lamps = nearest_lamps(house, mesh.corners[..., :3].mean(axis=1))[:, 0]
        self._lamp = _columns(np.append(lamps, [[0, 0, 1e3]], axis=0))
        light = bake_light(house, self._scene, mesh.corners)
        random = np.random.default_rng([house.seed, 7002])
        light *= random.uniform(0.85, 1.1)
        # stored as sRGB-like values: products of encoded colour and encoded light need no power per pixel
        encoded = np.clip(light, 0.02, 1.35) ** (1 / 2.2)
        self._shade = _affine_table(encoded * (1 - glow) + 1.2 * glow)  # emission outshines the room
        warm = random.uniform(-0.5, 1.0)
        lit, dim = np.array([1 + 0.05 * warm, 1.0, 1 - 0.09 * warm]), np.array([0.95, 0.99, 1.04])
        gain = (lit - 0.3 * dim) / 0.7  # light 1 has the lamps' colour, light 0.3 the cooler one of the shadows
        self._tints = list(zip(gain.astype(np.float32), (lit - gain).astype(np.float32), strict=True))

    def _blur_per_m(self, eye: F32) -> F32:
        """Texels per pixel of each triangle at 1 m from the eye; more for slanted surfaces."""
        way = [middle - along for middle, along in zip(self._middle, eye, strict=True)]
        slant = np.abs(_dot(way, self._normal)) / np.sqrt(_dot(way, way) + np.float32(1e-6))
        return np.asarray(self._texels_per_px_m / np.sqrt(np.maximum(slant, np.float32(0.1))), np.float32)

    def _render_band(self, view: RenderedView, rows: slice, turn: F32, eye: F32, blur: F32) -> None:
        count, shape = (rows.stop - rows.start) * self.width, (rows.stop - rows.start, self.width)
        # sums written out, because a matrix product may round differently with another number of threads
        row_rays = self._down[rows] * turn[:, 1] + turn[:, 2]
        rays = (row_rays[:, None] + self._across * turn[:, 0]).reshape(count, 3)
        hit = self._scene.run(np.broadcast_to(eye, rays.shape).copy(), rays, output=1)
        triangle, u, v = hit["primID"].astype(np.intp), hit["u"], hit["v"]
        depth = np.where(triangle >= 0, hit["tfar"], np.float32(0))
        view.depth_m[rows] = depth.reshape(shape)
        view.instance[rows] = self._instance.take(triangle, mode="wrap").reshape(shape)
        view.shine[rows] = self._shine.take(triangle, mode="wrap").reshape(shape)
        detail = (depth * blur.take(triangle, mode="wrap")).view(np.int32) >> 23  # the exponent is the floor of log2
        level = np.clip(detail - 127, 0, LEVELS - 1)
        size_px = LEVEL_SIZES_PX.take(level)
        place = []
        for k, left in enumerate((LEVEL_LEFT_PX.take(level), np.float32(0))):
            repeats = _interpolate(self._uv[k], triangle, u, v)
            pixel = (repeats - np.floor(repeats)) * size_px + left + self._origin[k].take(triangle, mode="wrap")
            place.append(pixel.reshape(shape))
        color = cv2.remap(self._texels.image, place[0], place[1], cv2.INTER_LINEAR)
        shade = _interpolate(self._shade, triangle, u, v).reshape(shape)
        light = cv2.merge([shade * gain + base for gain, base in self._tints])
        color = cv2.multiply(color, light, dtype=cv2.CV_8U)
        highlight = self._highlight(triangle, rays, depth, eye).reshape(shape)
        view.color[rows] = cv2.add(color, cv2.merge((highlight, highlight, highlight)))

    def _highlight(self, triangle: I64, rays: F32, depth: F32, eye: F32) -> U8:
        """(N,) brightness to add where glossy surfaces mirror the nearest lamp or are seen at a grazing angle."""
        gloss = self._gloss.take(triangle, mode="wrap")
        added = np.zeros(len(gloss), np.uint8)
        glossy = np.flatnonzero(gloss > 0.04)
        which, far, gloss = triangle[glossy], depth[glossy], gloss[glossy]
        way = [rays[:, k].take(glossy) for k in range(3)]
        normal = [column.take(which, mode="wrap") for column in self._normal]
        lamp = [self._lamp[k].take(which, mode="wrap") - eye[k] - way[k] * far for k in range(3)]
        to_lamp_m, way_length = np.sqrt(_dot(lamp, lamp)) + np.float32(1e-6), np.sqrt(_dot(way, way))
        facing = _dot(normal, way) / way_length
        mirrored = (_dot(lamp, way) / way_length - 2 * facing * _dot(lamp, normal)) / to_lamp_m
        spot = np.exp((mirrored - 1) * (6 + 70 * gloss))
        added[glossy] = np.minimum(gloss * (150 * spot + 70 * (1 - np.abs(facing)) ** 3), 255)
        return added


def _columns(rows: F64) -> list[F32]:
    """The columns of a table as separate arrays, which are faster to look up and multiply than rows."""
    return [np.ascontiguousarray(rows[:, k], np.float32) for k in range(rows.shape[1])]


def _dot(a: list[F32], b: list[F32]) -> F32:
    """(N,) scalar products of vectors given as their three columns."""
    return np.asarray(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


def _affine_table(values: F64) -> tuple[F32, F32, F32]:
    """Corner values (T, 3) as value at the first corner and the steps along the two edges, with a row for no hit."""
    rows = np.stack((values[:, 0], values[:, 1] - values[:, 0], values[:, 2] - values[:, 0]))
    padded = np.pad(rows, ((0, 0), (0, 1))).astype(np.float32)
    return padded[0], padded[1], padded[2]


def _interpolate(table: tuple[F32, F32, F32], triangle: I64, u: F32, v: F32) -> F32:
    """Corner values interpolated at barycentric (u, v) of each pixel's triangle."""
    base, along_u, along_v = (values.take(triangle, mode="wrap") for values in table)
    along_u *= u
    along_v *= v
    base += along_u
    base += along_v
    return base
