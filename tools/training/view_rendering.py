"""Renders training views of many houses and stores them as arrays, one folder (shard) per house.

A shard holds color.npy (K, H, W, 3) uint8, depth.npy (K, H, W) uint16 mm, instance.npy (K, H, W) uint16 (item id + 1,
0: the building), item_class.npy (items,) uint8, an index into NAMES, and boxes.npy (M, 8): view, item, class, x0 y0 x1
y1 (exclusive) and visible px. Views are at robot positions, with heights and pitches varied beyond its trajectory.
"""

from __future__ import annotations

import os
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from placegraph.runtime.arrays import F32, F64, U8, U16, Bool
from placegraph.tools.simulator.camera_sensor import sensor_settings, simulate_camera
from placegraph.tools.simulator.house_frames import generate_house, make_renderer
from placegraph.tools.simulator.house_model import House
from placegraph.tools.simulator.object_classes import NAMES
from placegraph.tools.simulator.occupancy_grid import free_grid

WIDTH, HEIGHT = 640, 480
EVALUATION_SEEDS = range(9000, 10000)  # never used in training
CALIBRATION_SEEDS = range(10000, 10100)  # for INT8 ranges and thresholds
TRAINING_SEEDS = range(20000, 30000)
SALT = 77
MIN_OBJECTS = 2  # a view of a bare wall teaches little
MIN_TRIES, MAX_TRIES = 3, 10
CELL_M = 0.05


def render_house(seed: int, views: int, folder: Path) -> Path:
    """Renders `views` views of one house into `folder`/SEED, unless it exists."""
    shard = folder / str(seed)
    if shard.exists():
        return shard
    house = generate_house(seed)
    renderer = make_renderer(house, WIDTH, HEIGHT)
    settings = sensor_settings(seed)
    random = np.random.default_rng([seed, SALT])
    colors: list[U8] = []
    depths: list[U16] = []
    instances: list[U16] = []
    for pose in _poses(house, views, random):
        view = renderer.render(pose)
        if colors and len(np.unique(view.instance)) <= MIN_OBJECTS and random.random() < 0.8:
            continue
        color, depth_m = simulate_camera(view, renderer.intrinsics, random, settings)
        colors.append(color)
        depths.append(np.round(depth_m * 1000).astype(np.uint16))
        instances.append(view.instance)
    item_class = np.array([NAMES.index(item.item.name) for item in house.items], np.uint8)
    boxes = [np.insert(visible_boxes(instance, item_class), 0, k, axis=1) for k, instance in enumerate(instances)]
    arrays: dict[str, NDArray[Any]] = {
        "color": np.stack(colors),
        "depth": np.stack(depths),
        "instance": np.stack(instances),
        "item_class": item_class,
        "boxes": np.concatenate(boxes),
    }
    partial = shard.with_suffix(".part")
    partial.mkdir(parents=True, exist_ok=True)
    for name, array in arrays.items():
        np.save(partial / f"{name}.npy", array)
    partial.rename(shard)
    return shard


def visible_boxes(instance: U16, item_class: U8) -> F32:
    """Objects of an instance image (H, W): rows (M, 7) of item, class, x0 y0 x1 y1 (exclusive), visible px."""
    count = int(instance.max()) + 1
    px = np.bincount(instance.ravel(), minlength=count)
    px[0] = 0
    visible_ids = np.flatnonzero(px)
    low = np.full((count, 2), 1 << 30)
    high = np.zeros((count, 2), np.int64)
    ys, xs = np.nonzero(instance)
    ids = instance[ys, xs].astype(np.int64)
    for k, axis in enumerate((xs, ys)):
        np.minimum.at(low[:, k], ids, axis)
        np.maximum.at(high[:, k], ids, axis + 1)
    rows = np.column_stack(
        (visible_ids - 1, item_class[visible_ids - 1], low[visible_ids], high[visible_ids], px[visible_ids])
    )
    return rows.astype(np.float32)


def render_houses(seeds: list[int], views: int, folder: Path, workers: int = 0) -> None:
    """Render every house; equal seeds give equal shards, whatever the number of processes."""
    folder.mkdir(parents=True, exist_ok=True)
    with ProcessPoolExecutor(workers or os.cpu_count()) as pool:
        for count, _ in enumerate(pool.map(render_house, seeds, [views] * len(seeds), [folder] * len(seeds)), 1):
            if count % 20 == 0:
                print(f"{count} of {len(seeds)} houses", flush=True)


def _poses(house: House, views: int, random: np.random.Generator) -> list[F64]:
    """Camera poses (4, 4) at random free places of all floors; of a few tries the one that faces most objects."""
    places: list[tuple[float, float, float]] = []
    for floor in house.floors:
        origin, free = free_grid(house, floor.index, CELL_M)
        rows, columns = np.nonzero(free)
        x, y = origin[0] + (columns + 0.5) * CELL_M, origin[1] + (rows + 0.5) * CELL_M
        places += [(float(a), float(b), floor.z_m) for a, b in zip(x, y, strict=True)]
    middles = np.array([item.box.mean(axis=0) for item in house.items])
    rooms = np.array([item.room for item in house.items])
    poses = []
    for _ in range(views):
        tries: list[tuple[int, int, F64]] = []
        for index in random.integers(0, len(places), int(random.integers(MIN_TRIES, MAX_TRIES + 1))):
            x, y, z = places[int(index)]
            eye = np.array([x, y, z + random.uniform(0.9, 1.6)])
            yaw, pitch, roll = random.uniform(-np.pi, np.pi), random.uniform(0, 0.55), random.normal(0, 0.02)
            pose = camera_pose(eye, yaw, pitch, roll)
            tries.append((_facing(pose, middles, rooms == _room_of(house, eye)), len(tries), pose))
        poses.append(max(tries, key=lambda attempt: attempt[:2])[2])
    return poses


def _room_of(house: House, eye: F64) -> int:
    for room in house.rooms:
        on_floor = 0 < eye[2] - house.floors[room.floor].z_m < house.floors[room.floor].height_m
        if (
            on_floor
            and cv2.pointPolygonTest(room.polygon.astype(np.float32), (float(eye[0]), float(eye[1])), False) >= 0
        ):
            return room.id
    return -1


def _facing(pose: F64, middles: F64, near: Bool) -> int:
    """How many items of the camera's room are well inside the image, .7 to 5 m away."""
    x, y, z = ((middles - pose[:3, 3]) @ pose[:3, :3]).T
    inside = (np.abs(x) < 0.6 * z) & (np.abs(y) < 0.45 * z) & (z > 0.7) & (z < 5.0)
    return int((inside & near).sum())


def camera_pose(position: F64, yaw: float, pitch: float, roll: float = 0.0) -> F64:
    """(4, 4) world_from_camera of a camera that looks along `yaw` (0: world x), `pitch` radians down."""
    level = np.array([[0.0, 0, 1], [-1, 0, 0], [0, -1, 0]])  # camera z forward, x right, y down at yaw 0
    turn = Rotation.from_euler("ZYX", [yaw, pitch, roll]).as_matrix()
    pose = np.eye(4)
    pose[:3, :3] = turn @ level
    pose[:3, 3] = position
    return pose
