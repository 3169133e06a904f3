"""What a keyframe costs as the map grows: a generated building of many floors, mapped room by room by true poses.

Each room is a box with a doorway and furniture of boxes, seen from its middle all around; masks are the true ones. So
fusion and hierarchy are measured without any network, and pose not at all.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from placegraph.runtime.arrays import F64, I64
from placegraph.runtime.messages import Keyframe, LastKeyframe, Map, Message, Segments
from placegraph.runtime.node import Context, Node, build_node

WIDTH, HEIGHT = 160, 120
INTRINSICS = np.array([120.0, 120.0, 80.0, 60.0])  # 67 degrees across, as an OAK-D
STRIDE = 1  # as many points a keyframe as every fourth pixel each way of 640 x 480
ROOM_M, HEIGHT_M, COLUMNS = np.array([4.0, 3.5]), 2.6, 5
VIEWS = 6  # of each room, a sixth of a turn apart
EYE_M, TILT = 1.4, np.radians(15)
NAMES = ("bed", "table", "chair", "wardrobe", "lamp", "sofa")
SEED = 11  # of where the furniture stands


class Box(NamedTuple):
    """A named box; "" for the building."""

    name: str
    low: F64
    high: F64


@dataclass(frozen=True)
class Sample:
    """One keyframe: on which floor, how large the newest Map is, what each node took in ms; gave: a Map with it."""

    floor: int
    voxels: int
    fusion_ms: float
    hierarchy_ms: float
    gave: bool

    @property
    def ms(self) -> float:
        """Both nodes together."""
        return self.fusion_ms + self.hierarchy_ms


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
    for k, name in enumerate(NAMES):  # one along each part of the walls, the middle stays free
        size = random.uniform((0.4, 0.4, 0.4), (0.9, 0.7, 1.6))
        x = (0.1, 1.55, w - 0.1 - size[0])[k % 3] + random.uniform(0, 0.05)
        y = 0.95 if k < 3 and k % 3 == 1 else 0.1 if k < 3 else d - 0.1 - size[1]
        if k == 1:  # before the doorway
            x, y = 0.1, 1.5
        low = corner + np.array([x, y, 0])
        boxes.append(Box(name, low, low + size))
    return corner + np.array([w / 2, d / 2, 0]), boxes


def views(floors: int, rooms: int) -> Iterator[tuple[int, Keyframe, Segments]]:
    """Keyframes and Segments through the building, with the floor that each is on."""
    random = np.random.default_rng(SEED)
    frame_id = 0
    for floor in range(floors):
        for number in range(rooms):
            middle, boxes = room(floor, number, random)
            for k in range(VIEWS):
                pose = _pose(middle + np.array([0, 0, EYE_M]), 2 * np.pi * k / VIEWS)
                yield floor, *_view(frame_id, boxes, pose)
                frame_id += 1


def _pose(eye: F64, heading: float) -> F64:
    ahead = np.array([np.cos(heading) * np.cos(TILT), np.sin(heading) * np.cos(TILT), -np.sin(TILT)])
    right = np.array([np.sin(heading), -np.cos(heading), 0])
    pose = np.eye(4)
    pose[:3, :3] = np.stack((right, np.cross(ahead, right), ahead), axis=1)
    pose[:3, 3] = eye
    return pose


def _view(frame_id: int, boxes: list[Box], pose: F64) -> tuple[Keyframe, Segments]:
    depth_m, hit = _trace(boxes, pose)
    named = [(box.name, hit == i) for i, box in enumerate(boxes) if box.name and (hit == i).sum() > 20]
    bits, offsets = Segments.pack([mask for _, mask in named])
    color = np.repeat((40 + 10 * (hit + 1))[..., None], 3, axis=2).astype(np.uint8)
    keyframe = Keyframe(
        frame_id=frame_id, stamp_ns=frame_id * 10**8, color=color, depth=np.rint(depth_m * 1000).astype(np.uint16),
        depth_unit_m=0.001, intrinsics=INTRINSICS, world_from_camera=pose,
    )  # fmt: skip
    segments = Segments(
        frame_id=frame_id, stamp_ns=frame_id * 10**8, names=tuple(name for name, _ in named),
        scores=np.full(len(named), 0.8, np.float32),
        boxes_px=np.array([(0, 0, WIDTH, HEIGHT)] * len(named), np.int32).reshape(-1, 4),
        mask_bits=bits, mask_offsets=offsets,
    )  # fmt: skip
    return keyframe, segments


def _trace(boxes: list[Box], pose: F64) -> tuple[F64, I64]:
    """Depth (H, W) in metres along the optical axis, 0 where nothing is hit, and the box hit, -1 for none."""
    v, u = np.mgrid[:HEIGHT, :WIDTH]
    fx, fy, cx, cy = INTRINSICS
    rays = np.stack(((u - cx) / fx, (v - cy) / fy, np.ones(u.shape)), axis=-1) @ pose[:3, :3].T
    rays[np.abs(rays) < 1e-9] = 1e-9
    depth, hit = np.full(u.shape, np.inf), np.full(u.shape, -1)
    for i, box in enumerate(boxes):
        sides = np.sort(np.stack(((box.low - pose[:3, 3]) / rays, (box.high - pose[:3, 3]) / rays)), axis=0)
        enter = sides[0].max(axis=-1)
        first = (enter < sides[1].min(axis=-1)) & (enter > 0.05) & (enter < depth)
        depth[first], hit[first] = enter[first], i
    return np.where(np.isinf(depth), 0, depth), hit


def grow(floors: int, rooms: int) -> list[Sample]:
    """Map the building and time each keyframe (CPU time)."""
    fusion = build_node("fusion", {"stride": STRIDE}, Context())
    hierarchy = build_node("hierarchy", {}, Context())
    samples: list[Sample] = []
    voxels = 0
    for floor, keyframe, segments in views(floors, rooms):
        fusion.step(keyframe)
        fusion_ms, given = _timed(fusion, segments)
        hierarchy_ms = 0.0
        for message in given:
            assert isinstance(message, Map)
            voxels = len(message.points_world)
            hierarchy_ms += _timed(hierarchy, message)[0]
        samples.append(Sample(floor, voxels, fusion_ms, hierarchy_ms, bool(given)))
    (last,) = fusion.step(LastKeyframe(frame_id=len(samples) - 1, stamp_ns=0, keyframes=len(samples)))
    assert isinstance(last, Map)
    return samples


def _timed(node: Node, message: Message) -> tuple[float, list[Message]]:
    began = time.process_time()
    given = list(node.step(message))
    return (time.process_time() - began) * 1e3, given


def p95_by_floor(samples: list[Sample]) -> list[float]:
    """95th percentile of what a keyframe took, in ms, floor by floor."""
    floors = sorted({one.floor for one in samples})
    return [float(np.percentile([one.ms for one in samples if one.floor == floor], 95)) for floor in floors]


def drawing(samples: list[Sample], rooms: int) -> str:
    """SVG: each keyframe's time, those that gave a Map in another colour, and the 95th percentile of each floor."""
    width, height, left, top = 900, 420, 60, 40
    most = max(one.ms for one in samples)
    low, high = np.log10(1.0), np.log10(max(most, 10.0)) * 1.02
    p95 = p95_by_floor(samples)

    def x(index: float) -> float:
        return left + index / len(samples) * width

    def y(ms: float) -> float:
        return float(top + (high - np.log10(max(ms, 1.0))) / (high - low) * height)

    size = f'viewBox="0 0 {left + width + 20} {top + height + 50}" width="{left + width + 20}"'
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" {size} font-family="sans-serif" font-size="12">',
        f'<text x="{left}" y="18">ms of CPU a keyframe, fusion and hierarchy: {len(p95)} floors of {rooms} rooms, '
        f"{samples[-1].voxels:,} voxels at the end</text>",
        f'<text x="{left}" y="34" fill="#999">dots: keyframes; orange: those that gave a Map and a graph of it; '
        "line: 95th percentile of each floor</text>",
    ]
    for ms in (1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0, 10000.0):
        if np.log10(ms) <= high:
            parts.append(f'<path d="M{left} {y(ms):.1f}h{width}" stroke="#ddd"/>')
            parts.append(f'<text x="{left - 6}" y="{y(ms) + 4:.1f}" text-anchor="end">{ms:.0f}</text>')
    for k, one in enumerate(samples):
        look = 'r="2.4" fill="#e07b28"' if one.gave else 'r="1.2" fill="#7a8fb0"'
        parts.append(f'<circle cx="{x(k):.1f}" cy="{y(one.ms):.1f}" {look}/>')
    share = len(samples) / len(p95)
    line = " ".join(f"{x((k + 0.5) * share):.1f},{y(ms):.1f}" for k, ms in enumerate(p95))
    parts.append(f'<polyline points="{line}" fill="none" stroke="#b02a48" stroke-width="2"/>')
    for k, value in enumerate(p95):
        parts.append(
            f'<text x="{x((k + 0.5) * share):.1f}" y="{top + height + 18}" text-anchor="middle">{value:.0f}</text>'
        )
    parts.append(f'<text x="{left}" y="{top + height + 38}">p95 in ms by floor</text></svg>')
    return "\n".join(parts) + "\n"
