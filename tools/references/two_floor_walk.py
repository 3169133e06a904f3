"""A hand-made walk through two rooms above each other, with drifting poses and an object that is taken away.

The camera turns once in a kitchen and begins a second turn, which repeats the first views so that a loop can close,
and shows that the vase is gone; then it climbs to the bedroom above and turns once there. All surfaces have a pattern
with keypoints.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from placegraph.runtime.arrays import F64, I64, U8
from placegraph.runtime.messages import Keyframe, LastKeyframe, Message
from placegraph.tools.bench.box_building import EYE_M, HEIGHT_M, INTRINSICS, Box, camera_pose, trace, true_segments

ROOM_M = (3.6, 3.0)
UPPER_FLOOR_M = HEIGHT_M + 0.3
TURN_DEG = tuple(range(0, 360, 24))  # headings of a full turn
SECOND_TURN_DEG = (0, 24, 48, 230, 245, 255, 265, 275, 290)  # the loop, then where the vase was
DRIFT_M = 0.004  # of the given poses at each keyframe, along x
RADIUS_M = 0.2  # of the circle on which the camera turns
CELL_M = 0.1  # of the painted pattern
MM = 0.001

Furniture = dict[str, tuple[tuple[float, float, float], tuple[float, float, float]]]  # lowest and highest corner, m
KITCHEN: Furniture = {
    "refrigerator": ((0.0, 2.3, 0.0), (0.6, 3.0, 1.7)),
    "stove": ((0.0, 1.4, 0.0), (0.6, 2.0, 0.9)),
    "table": ((2.6, 1.0, 0.0), (3.4, 2.2, 0.75)),
    "book": ((2.75, 1.1, 0.75), (3.1, 1.45, 0.83)),
    "chair": ((2.7, 0.1, 0.0), (3.2, 0.6, 0.9)),
    "cabinet": ((1.3, 2.5, 0.0), (2.3, 3.0, 1.0)),
    "vase": ((1.4, 0.1, 0.0), (1.8, 0.5, 1.1)),
}
BEDROOM: Furniture = {
    "bed": ((0.0, 1.2, 0.0), (1.0, 3.0, 0.5)),
    "wardrobe": ((2.9, 0.1, 0.0), (3.6, 1.1, 2.0)),
    "chair": ((2.9, 2.3, 0.0), (3.4, 2.8, 0.9)),
    "lamp": ((1.5, 2.6, 0.0), (1.8, 2.9, 1.5)),
}
TAKEN_AWAY = "vase"  # before the second turn
CLIMB_M = (0.4, 0.8, 1.15, 1.35, 1.55, 2.0, 2.4)  # heights over the kitchen's floor while climbing; no stairs are drawn


def messages() -> Iterator[Message]:
    """Keyframe and Segments of each view, and the LastKeyframe."""
    kitchen, bedroom = _room(KITCHEN, 0.0), _room(BEDROOM, UPPER_FLOOR_M)
    emptier = [box for box in kitchen if box.name != TAKEN_AWAY]
    turns = ((kitchen, TURN_DEG, 0.0), (emptier, SECOND_TURN_DEG, 0.0), (bedroom, TURN_DEG, UPPER_FLOOR_M))
    views = [(boxes, np.radians(heading), floor_m) for boxes, turn, floor_m in turns for heading in turn]
    at_stairs = len(TURN_DEG) + len(SECOND_TURN_DEG)
    views[at_stairs:at_stairs] = [([*emptier, *bedroom], 0.0, height_m) for height_m in CLIMB_M]
    for frame_id, (boxes, heading, floor_m) in enumerate(views):
        eye = np.array([ROOM_M[0] / 2, ROOM_M[1] / 2, floor_m + EYE_M])
        eye[:2] += RADIUS_M * np.array([np.cos(heading), np.sin(heading)])
        yield from _view(frame_id, boxes, camera_pose(eye, heading))
    yield LastKeyframe(frame_id=len(views) - 1, stamp_ns=len(views) * 10**8, keyframes=len(views))


def _room(furniture: Furniture, floor_m: float) -> list[Box]:
    (w, d), h = ROOM_M, HEIGHT_M
    shell = [
        ((0, 0, -0.1), (w, d, 0)), ((0, 0, h), (w, d, h + 0.1)), ((-0.1, 0, 0), (0, d, h)),
        ((w, 0, 0), (w + 0.1, d, h)), ((0, -0.1, 0), (w, 0, h)), ((0, d, 0), (w, d + 0.1, h)),
    ]  # fmt: skip
    boxes = [("", *corners) for corners in shell] + [(name, *corners) for name, corners in furniture.items()]
    up = np.array([0, 0, floor_m])
    return [Box(name, np.array(low) + up, np.array(high) + up) for name, low, high in boxes]


def _view(frame_id: int, boxes: list[Box], world_from_camera: F64) -> Iterator[Message]:
    depth_m, hit = trace(boxes, world_from_camera)
    drifted = world_from_camera.copy()
    drifted[0, 3] += DRIFT_M * frame_id
    yield Keyframe(
        frame_id=frame_id,
        stamp_ns=frame_id * 10**8,
        color=_paint(depth_m, hit, world_from_camera),
        depth=np.rint(depth_m / MM).astype(np.uint16),
        depth_unit_m=MM,
        intrinsics=INTRINSICS,
        world_from_camera=drifted,
    )
    yield true_segments(frame_id, boxes, hit)


def _paint(depth_m: F64, hit: I64, world_from_camera: F64) -> U8:
    """(H, W, 3): every cell of a surface has a brightness of its own, and every box a hue."""
    v, u = np.mgrid[: depth_m.shape[0], : depth_m.shape[1]]
    fx, fy, cx, cy = INTRINSICS
    rays = np.stack(((u - cx) / fx, (v - cy) / fy, np.ones(u.shape)), axis=-1)
    points = (rays * depth_m[..., None]) @ world_from_camera[:3, :3].T + world_from_camera[:3, 3]
    cells = np.floor((points + 1e-4) / CELL_M).astype(np.int64)
    random = (cells @ np.array([73856093, 19349663, 83492791]) ^ hit * 2654435761) % 1009 / 1009
    hues = np.random.default_rng(0).uniform(0.5, 1.0, (hit.max() + 2, 3))
    return np.asarray(np.rint((50 + 200 * random[..., None]) * hues[hit]), np.uint8)
