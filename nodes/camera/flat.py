"""The drawn flat of configs/flat.toml: two furnished rooms ray cast in numpy along a walk, with poses and truth.

Nothing is read from disk. Equal settings give equal bytes: all noise comes from the seed and the frame's number.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from placegraph.nodes.camera import _flat_scene as scene
from placegraph.nodes.camera._dataset_reader import NumberedFrames, SourceSettings, read_settings
from placegraph.runtime.arrays import F32, F64, I64, U8, U16

FOCAL_PER_WIDTH = 0.7  # 71 degrees across, near the 69 of an OAK-D's colour camera
MIN_RANGE_M, MAX_RANGE_M = 0.3, 6.0  # readings outside are dropped, as small stereo cameras do
DEPTH_NOISE_PER_M = 0.001  # sigma = this times z squared: stereo's error grows so
COLOR_NOISE = 3.0  # sigma in steps of 8 bit
TINT = 5.0  # sigma of an object's own colour around its class's, in steps of 8 bit: differs with the seed
# light on the faces that look to -x +x, -y +y, -z +z
FACE_LIGHT = np.array([[0.72, 0.82], [0.88, 0.66], [0.55, 1.0]], np.float32)
DIMMING_PER_M = 0.02  # far surfaces are a little darker
NEAR_M = 0.02
EDGES = np.array([(a, a | bit) for bit in (1, 2, 4) for a in range(8) if not a & bit])  # of a box, by corner number


class Settings(SourceSettings):
    """Settings of the drawn flat."""

    width: int = Field(320, ge=16, le=4096)
    height: int = Field(240, ge=16, le=4096)
    frames: int = Field(0, ge=0)  # evenly along the walk; 0: as many as keep each step under 5 cm and 3 degrees
    rate_hz: float = Field(10.0, gt=0)
    seed: int = Field(0, ge=0)


@dataclass(frozen=True)
class SceneBoxes:
    """Every box of the scene: corners (B, 3) in metres, sRGB colour (B, 3), class and object (-1: the building)."""

    low: F32
    high: F32
    color: F32
    label: U8
    object: I64


class Flat(NumberedFrames):
    """Frames of the drawn flat."""

    summary: ClassVar[str] = "no path: two rooms drawn by code (source = 'flat')"

    def __init__(self, path: Path, settings: dict[str, Any]) -> None:
        self.settings = read_settings(Settings, settings)
        self.poses = scene.camera_poses(self.settings.frames or scene.sample_walk()[1])
        self.numbers, self.rate_hz = range(len(self.poses)), self.settings.rate_hz
        width, height = self.settings.width, self.settings.height
        focal = FOCAL_PER_WIDTH * width
        self.intrinsics = np.array([focal, focal, (width - 1) / 2, (height - 1) / 2])
        u, v = np.meshgrid(np.arange(width), np.arange(height))
        x, y = (u - self.intrinsics[2]) / focal, (v - self.intrinsics[3]) / focal
        self._rays = np.stack((x, y, np.ones_like(x)), axis=-1).astype(np.float32)  # camera frame, z = 1
        self._boxes = _boxes(self.settings.seed)

    def read_images(self, number: int) -> tuple[U8, U16, F64]:
        """The rendered images of a frame."""
        color, depth, _ = self.render(number)
        return color, depth, self.intrinsics.copy()

    def read_pose(self, number: int) -> F64:
        """The camera's pose on the walk."""
        return np.array(self.poses[number])

    def render(self, frame_id: int) -> tuple[U8, U16, U8]:
        """Colour (H, W, 3) sRGB, depth (H, W) in mm (0 = no reading) and class (H, W), an index into CLASSES."""
        pose = self.poses[frame_id]
        z, box, face = cast_rays(self._rays, self.intrinsics, pose, self._boxes)
        random = np.random.default_rng([self.settings.seed, frame_id])
        noise = random.standard_normal((*z.shape, 4), np.float32)
        light = FACE_LIGHT.ravel()[face] * (1 - DIMMING_PER_M * z)
        color = self._boxes.color[box] * light[..., None] + COLOR_NOISE * noise[..., :3]
        measured = z + DEPTH_NOISE_PER_M * z * z * noise[..., 3]
        measured[(measured < MIN_RANGE_M) | (measured > MAX_RANGE_M)] = 0
        depth = np.round(measured * 1000).astype(np.uint16)
        return np.clip(np.round(color), 0, 255).astype(np.uint8), depth, self._boxes.label[box]


def _boxes(seed: int) -> SceneBoxes:
    spans: list[scene.Span] = []
    colors: list[F64] = []
    labels: list[int] = []
    objects: list[int] = []
    for color, span in scene.STRUCTURE:
        spans.append(span)
        colors.append(np.array(color, float))
        labels.append(0)
        objects.append(-1)
    tints = np.random.default_rng([seed, 1 << 40]).normal(0.0, TINT, (len(scene.OBJECTS), 3))
    for number, drawn in enumerate(scene.OBJECTS):
        for part in drawn.parts:
            spans.append(part)
            colors.append(np.clip(np.array(scene.COLORS[drawn.name]) + tints[number], 8, 255))
            labels.append(scene.CLASSES.index(drawn.name))
            objects.append(number)
    corners = np.array(spans, np.float32)
    return SceneBoxes(
        low=corners[:, :3],
        high=corners[:, 3:],
        color=np.array(colors, np.float32),
        label=np.array(labels, np.uint8),
        object=np.array(objects, np.int64),
    )


def cast_rays(
    rays: F32, intrinsics: F64, world_from_camera: F64, boxes: SceneBoxes
) -> tuple[F32, NDArray[np.intp], U8]:
    """First box along each ray, by the slab test.

    rays: (H, W, 3), camera frame, z = 1. Returns depth (H, W) in metres (inf: nothing hit), the box (H, W) and the face
    hit (H, W): 0..5 for -x +x -y +y -z +z. Source: Kay and Kajiya, "Ray Tracing Complex Scenes", SIGGRAPH 1986.
    """
    direction = (rays @ world_from_camera[:3, :3].T.astype(np.float32)).transpose(2, 0, 1)
    # a ray along a face would give 0 * inf; the smallest tilt avoids it and moves nothing
    inverse = 1 / np.where(np.abs(direction) < 1e-9, np.float32(1e-9), direction)
    backwards = inverse < 0
    origin = world_from_camera[:3, 3].astype(np.float32)
    depth = np.full(rays.shape[:2], np.inf, np.float32)
    hit_box = np.zeros(rays.shape[:2], np.intp)
    hit_axis = np.zeros(rays.shape[:2], np.uint8)
    for index, (x0, y0, x1, y1) in enumerate(_pixel_windows(intrinsics, world_from_camera, boxes, depth.shape)):
        if x0 >= x1 or y0 >= y1:
            continue
        window = (slice(y0, y1), slice(x0, x1))
        step = inverse[:, y0:y1, x0:x1]
        to_low = (boxes.low[index] - origin)[:, None, None] * step
        to_high = (boxes.high[index] - origin)[:, None, None] * step
        enter, leave = np.minimum(to_low, to_high), np.maximum(to_low, to_high)
        near = enter.max(axis=0)
        hit = (near <= leave.min(axis=0)) & (near > NEAR_M) & (near < depth[window])
        if hit.any():
            depth[window][hit] = near[hit]
            hit_box[window][hit] = index
            hit_axis[window][hit] = enter[:, hit].argmax(axis=0)
    # a ray that runs towards +x enters through the face that looks to -x
    far_face = np.take_along_axis(backwards, hit_axis[None].astype(np.intp), axis=0)[0]
    return depth, hit_box, (2 * hit_axis + far_face).astype(np.uint8)


def _pixel_windows(
    intrinsics: F64, world_from_camera: F64, boxes: SceneBoxes, size: tuple[int, ...]
) -> list[list[int]]:
    """Pixel window x0 y0 x1 y1 (max exclusive) that each box is inside of; empty for boxes behind the camera."""
    from_high = (np.arange(8)[:, None] >> np.arange(3)) & 1  # (8, 3): which coordinates come from `high`
    corners = np.where(from_high[None] == 1, boxes.high[:, None], boxes.low[:, None])
    camera = (corners - world_from_camera[:3, 3]) @ world_from_camera[:3, :3]  # (B, 8, 3)
    a, b = camera[:, EDGES[:, 0]], camera[:, EDGES[:, 1]]
    crosses = (a[..., 2] > NEAR_M) != (b[..., 2] > NEAR_M)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = (NEAR_M - a[..., 2:]) / (b[..., 2:] - a[..., 2:])
        cut = np.where(crosses[..., None], a + share * (b - a), np.nan)  # where edges pass the near plane
    ahead = np.where(camera[..., 2:] > NEAR_M, camera, np.nan)
    points = np.concatenate((ahead, cut), axis=1)
    is_known = np.isfinite(points[..., 0])
    pixels = points[..., :2] / points[..., 2:] * intrinsics[:2] + intrinsics[2:]
    low = np.where(is_known[..., None], pixels, np.inf).min(axis=1)
    high = np.where(is_known[..., None], pixels, -np.inf).max(axis=1)
    limit = np.array([size[1], size[0]])
    first = np.clip(np.floor(low), 0, limit)
    last = np.clip(np.ceil(high) + 1, 0, limit)
    windows: list[list[int]] = np.concatenate((first, last), axis=1).astype(int).tolist()
    return windows


SOURCE = Flat
