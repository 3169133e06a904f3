from collections.abc import Callable

import numpy as np
import pytest

from placegraph.runtime.messages import Keyframe, Segments

HEIGHT, WIDTH = 120, 160
INTRINSICS = np.array([140.0, 140.0, 80.0, 60.0])


def look_at(eye, target):
    forward = np.subtract(target, eye) / np.linalg.norm(np.subtract(target, eye))
    right = np.cross(forward, (0, 0, 1.0))
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, :3] = np.stack((right, np.cross(forward, right), forward), axis=1)
    pose[:3, 3] = eye
    return pose


def trace(boxes, pose):
    """Depth along z in metres and the index of the box hit (-1: none) of every pixel, by ray and box intersection."""
    v, u = np.mgrid[:HEIGHT, :WIDTH]
    fx, fy, cx, cy = INTRINSICS
    rays = np.stack(((u - cx) / fx, (v - cy) / fy, np.ones_like(u, float)), axis=-1) @ pose[:3, :3].T
    rays[np.abs(rays) < 1e-9] = 1e-9
    depth, hit = np.full((HEIGHT, WIDTH), np.inf), np.full((HEIGHT, WIDTH), -1)
    for i, (low, high) in enumerate(boxes):
        near = np.sort(np.stack(((low - pose[:3, 3]) / rays, (high - pose[:3, 3]) / rays)), axis=0)
        enter, leave = near[0].max(axis=-1), near[1].min(axis=-1)
        first = (enter < leave) & (enter > 0.05) & (enter < depth)
        depth[first], hit[first] = enter[first], i
    return np.where(np.isinf(depth), 0, depth), hit


@pytest.fixture
def view() -> Callable[..., tuple[Keyframe, Segments]]:
    """view(frame_id, {label: (name, low, high)}, eye, target): a keyframe of boxes, true masks of the named ones."""

    def make(frame_id, scene, eye, target, swallow=None):
        boxes = [(np.asarray(low, float), np.asarray(high, float)) for _, low, high in scene.values()]
        pose = look_at(eye, target)
        depth, hit = trace(boxes, pose)
        names, rects, masks = [], [], []
        for i, (name, _, _) in enumerate(scene.values()):
            mask = hit == i
            if swallow and name == swallow[0]:  # a detector's mask of the table that holds the cup on it
                mask |= hit == list(scene).index(swallow[1])
            if name and mask.sum() > 4:
                rows, columns = np.nonzero(mask)
                x0, y0, x1, y1 = columns.min(), rows.min(), columns.max() + 1, rows.max() + 1
                names.append(name)
                rects.append((x0, y0, x1, y1))
                masks.append(mask[y0:y1, x0:x1])
        bits, offsets = Segments.pack(masks)
        color = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
        color[..., 0] = (hit + 1) * 40
        keyframe = Keyframe(
            frame_id=frame_id,
            stamp_ns=frame_id * 100,
            color=color,
            depth=np.rint(depth * 1000).astype(np.uint16),
            depth_unit_m=0.001,
            intrinsics=INTRINSICS,
            world_from_camera=pose,
        )
        segments = Segments(
            frame_id=frame_id,
            stamp_ns=frame_id * 100,
            names=tuple(names),
            scores=np.full(len(names), 0.5, np.float32),
            boxes_px=np.array(rects, np.int32).reshape(-1, 4),
            mask_bits=bits,
            mask_offsets=offsets,
        )
        keyframe.check()
        segments.check()
        return keyframe, segments

    return make
