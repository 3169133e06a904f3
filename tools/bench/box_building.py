"""A generated building of boxes and exact views of it: keyframes at true poses with the true masks of the furniture.

No network and no odometry is needed to map it, so fusion and hierarchy can be measured alone.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from placegraph.runtime.arrays import F64, I64
from placegraph.runtime.messages import Keyframe, Segments

WIDTH, HEIGHT = 160, 120
INTRINSICS = np.array([120.0, 120.0, 80.0, 60.0])  # 67 degrees across, as an OAK-D
ROOM_M, HEIGHT_M, COLUMNS = np.array([4.0, 3.5]), 2.6, 5
VIEWS = 6  # of each room, a sixth of a turn apart
EYE_M, TILT_RAD = 1.4, np.radians(15)
NAMES = ("bed", "table", "chair", "wardrobe", "lamp", "sofa")
MIN_MASK_PX = 20
SEED = 11  # of the furniture's positions


class Box(NamedTuple):
    """A named box with its lowest and highest corner (3,) in metres; "" for the building itself."""

    name: str
    low: F64
    high: F64


def room(floor: int, number: int, random: np.random.Generator) -> tuple[F64, list[Box]]:
    """The middle of a room's floor (3,) and its boxes, in metres, world frame."""
    corner = np.array([*(np.array([number % COLUMNS, number // COLUMNS]) * (ROOM_M + 0.2)), floor * (HEIGHT_M + 0.3)])
    (w, d), h = ROOM_M.tolist(), HEIGHT_M
    shell = [
        ((0, 0, -0.1), (w, d, 0)), ((0, 0, h), (w, d, h + 0.1)), ((-0.1, 0, 0), (0, d, h)),
        ((w, 0, 0), (w + 0.1, d, h)), ((0, d, 0), (w, d + 0.1, h)), ((0, -0.1, 0), (1.5, 0, h)),
        ((2.4, -0.1, 0), (w, 0, h)), ((1.5, -0.1, 2.0), (2.4, 0, h)),
    ]  # fmt: skip
    boxes = [Box("", corner + low, corner + high) for low, high in shell]
    for k, name in enumerate(NAMES):  # three along each long wall, the middle stays free
        size = random.uniform((0.4, 0.4, 0.4), (0.9, 0.7, 1.6))
        x = (0.1, 1.55, w - 0.1 - size[0])[k % 3] + random.uniform(0, 0.05)
        y = 0.95 if k < 3 and k % 3 == 1 else 0.1 if k < 3 else d - 0.1 - size[1]
        if k == 1:  # this one would block the doorway
            x, y = 0.1, 1.5
        low = corner + np.array([x, y, 0])
        boxes.append(Box(name, low, low + size))
    return corner + np.array([w / 2, d / 2, 0]), boxes


def views(floors: int, rooms: int) -> Iterator[tuple[int, Keyframe, Segments]]:
    """Keyframes and Segments through the building, with the number of their floor."""
    random = np.random.default_rng(SEED)
    frame_id = 0
    for floor in range(floors):
        for number in range(rooms):
            middle, boxes = room(floor, number, random)
            for k in range(VIEWS):
                world_from_camera = camera_pose(middle + np.array([0, 0, EYE_M]), 2 * np.pi * k / VIEWS)
                yield floor, *view(frame_id, boxes, world_from_camera)
                frame_id += 1


def camera_pose(eye: F64, heading_rad: float) -> F64:
    """World_from_camera (4, 4) at a point (3,), looking TILT_RAD below the horizon."""
    c, s = np.cos(heading_rad), np.sin(heading_rad)
    ahead = np.array([c * np.cos(TILT_RAD), s * np.cos(TILT_RAD), -np.sin(TILT_RAD)])
    right = np.array([s, -c, 0])
    pose = np.eye(4)
    pose[:3, :3] = np.stack((right, np.cross(ahead, right), ahead), axis=1)
    pose[:3, 3] = eye
    return pose


def view(frame_id: int, boxes: list[Box], world_from_camera: F64) -> tuple[Keyframe, Segments]:
    """What a camera sees of the boxes, and the masks of the named ones; ten frames a second."""
    depth_m, hit = trace(boxes, world_from_camera)
    color = np.repeat((40 + 10 * (hit + 1))[..., None], 3, axis=2).astype(np.uint8)
    keyframe = Keyframe(
        frame_id=frame_id, stamp_ns=frame_id * 10**8, color=color, depth=np.rint(depth_m * 1000).astype(np.uint16),
        depth_unit_m=0.001, intrinsics=INTRINSICS, world_from_camera=world_from_camera,
    )  # fmt: skip
    return keyframe, true_segments(frame_id, boxes, hit)


def true_segments(frame_id: int, boxes: list[Box], hit: I64) -> Segments:
    """The masks of the named boxes in an image of box indices (H, W)."""
    masks = [(box.name, hit == i) for i, box in enumerate(boxes) if box.name and (hit == i).sum() > MIN_MASK_PX]
    bits, offsets = Segments.pack([mask for _, mask in masks])
    return Segments(
        frame_id=frame_id, stamp_ns=frame_id * 10**8, names=tuple(name for name, _ in masks),
        scores=np.full(len(masks), 0.8, np.float32),
        boxes_px=np.array([(0, 0, WIDTH, HEIGHT)] * len(masks), np.int32).reshape(-1, 4),
        mask_bits=bits, mask_offsets=offsets,
    )  # fmt: skip


def trace(boxes: list[Box], world_from_camera: F64) -> tuple[F64, I64]:
    """Depth (H, W) in metres along the optical axis, 0 where no box is hit, and the index of the box, -1 for none."""
    v, u = np.mgrid[:HEIGHT, :WIDTH]
    fx, fy, cx, cy = INTRINSICS
    rays = np.stack(((u - cx) / fx, (v - cy) / fy, np.ones(u.shape)), axis=-1) @ world_from_camera[:3, :3].T
    rays[np.abs(rays) < 1e-9] = 1e-9
    eye = world_from_camera[:3, 3]
    depth, hit = np.full(u.shape, np.inf), np.full(u.shape, -1)
    for i, box in enumerate(boxes):
        distances = np.sort(np.stack(((box.low - eye) / rays, (box.high - eye) / rays)), axis=0)
        enter = distances[0].max(axis=-1)
        first = (enter < distances[1].min(axis=-1)) & (enter > 0.05) & (enter < depth)
        depth[first], hit[first] = enter[first], i
    return np.where(np.isinf(depth), 0, depth), hit
