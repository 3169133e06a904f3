"""Simulated scans of rooms, as fusion would map them, without rendering.

Surface points of the furniture are kept where one of a few cameras in the room sees them (facing it, unoccluded).
Objects are then dropped, merged, split, moved and invented at random to imitate the errors of mapping.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from placegraph.runtime.arrays import F32, F64, Bool
from placegraph.runtime.errors import SourceError
from placegraph.tools.simulator.house_model import House, PlacedItem, Room

SALT = 6_011  # a random stream of its own
STEP_M = 0.002  # points are stored as whole steps
VOXEL_M = 0.025  # of the map's objects
DENSITY_PER_M2 = 2500.0  # of the points drawn on surfaces: a voxel holds more than one
DIRECTIONS = (160, 80)  # cells of a camera's sphere, in which the nearest surface hides what lies behind it
THICK_M = 0.06  # points this little behind the nearest surface are still seen
FAR_M = 5.0  # a depth camera's reach
NOISE_M = 0.008
CLEAR_M = 0.25  # from a camera to furniture in plan
CARPET_M = 0.1  # lower items are walked over
CAMERA_TRIALS = 200
MIN_POINTS = 25  # fewer points make no object
PHANTOM = -2  # RoomScan.location of an invented object


@dataclass(frozen=True, eq=False)
class RoomScan:
    """One room as it was seen: points (N, 3) of each object, metres, world frame, and the location of each.

    `location` indexes `outlines`, the true outlines (K, 2) of the room's locations; -1: of none.
    """

    floor: int
    low_m: float  # the floor's height, world frame
    high_m: float  # that of the ceiling
    rectangle: F64  # (4,) x0 y0 x1 y1 around the room
    objects: tuple[F32, ...]
    location: tuple[int, ...]
    outlines: tuple[F64, ...]


def scan_rooms(house: House, variant: int = 0) -> list[RoomScan]:
    """Every room of a house as seen by one walk; another `variant` is another walk."""
    random = np.random.default_rng([house.seed, SALT, variant])
    return [_scan_room(house, room, random) for room in house.rooms]


def add_mapping_errors(scan: RoomScan, random: np.random.Generator, missing: float = 0.2) -> RoomScan:
    """The room with errors of perception and mapping; a share `missing` of the objects is not found."""
    pairs = [
        (xyz, location) for xyz, location in zip(scan.objects, scan.location, strict=True) if random.random() >= missing
    ]
    pairs = _merge_neighbors(pairs, random)
    mapped: list[tuple[F32, int]] = []
    for xyz, location in pairs:
        if random.random() < 0.06:
            xyz = xyz + np.append(random.normal(0, 0.1, 2), 0).astype(np.float32)
        if random.random() < 0.1:  # only a part of it was mapped
            xyz = _cut_in_two(xyz, random.uniform(0.2, 0.5), random)[0]
        parts = _cut_in_two(xyz, random.uniform(0.3, 0.5), random) if random.random() < 0.1 else (xyz,)
        mapped += [(part, location) for part in parts if len(part) >= MIN_POINTS]
    mapped += [(_phantom_object(scan, random), PHANTOM) for _ in range(random.poisson(0.3))]
    objects = tuple((xyz + random.normal(0, 0.004, xyz.shape)).astype(np.float32) for xyz, _ in mapped)
    return replace(scan, objects=objects, location=tuple(location for _, location in mapped))


def join(a: RoomScan, b: RoomScan) -> RoomScan:
    """Two rooms of one floor as one, as when the room layer finds no wall between them."""
    rectangle = np.concatenate(
        (np.minimum(a.rectangle[:2], b.rectangle[:2]), np.maximum(a.rectangle[2:], b.rectangle[2:]))
    )
    moved = tuple(location + len(a.outlines) if location >= 0 else location for location in b.location)
    return replace(
        a,
        rectangle=rectangle,
        objects=a.objects + b.objects,
        location=a.location + moved,
        outlines=a.outlines + b.outlines,
    )


def _scan_room(house: House, room: Room, random: np.random.Generator) -> RoomScan:
    floor = house.floors[room.floor]
    locations = [location for location in house.locations if location.room == room.id]
    number = {location.id: k for k, location in enumerate(locations)}
    items = [item for item in house.items if item.room == room.id]
    objects, object_locations = [], []
    if items:
        for item, xyz in zip(
            items, _visible_points(items, _cameras(room, items, floor.z_m, random), random), strict=True
        ):
            if len(xyz) >= MIN_POINTS:
                objects.append(xyz)
                object_locations.append(number.get(item.location, -1))
    rectangle = np.concatenate((room.polygon.min(axis=0), room.polygon.max(axis=0)))
    outlines = tuple(location.outline for location in locations)
    span = (floor.z_m, floor.z_m + floor.height_m)
    return RoomScan(room.floor, *span, rectangle, tuple(objects), tuple(object_locations), outlines)


def _cameras(
    room: Room, items: list[PlacedItem], floor_m: float, random: np.random.Generator
) -> list[tuple[F64, float, float]]:
    """Camera places (3,) beside furniture at the height of a mast or a hand, with heading and half sector in rad."""
    contour = room.polygon.astype(np.float32)
    low, high = room.polygon.min(axis=0), room.polygon.max(axis=0)
    boxes = np.array([item.box for item in items if item.box[0, 2] < floor_m + CARPET_M < item.box[1, 2]])
    edge_m = min(0.3, *((high - low) / 4))
    cameras: list[tuple[F64, float, float]] = []
    camera_count = int(random.integers(2, 6))
    for trial in range(CAMERA_TRIALS):
        xy = random.uniform(low, high)
        free = not len(boxes) or not _is_close_to(xy, boxes)
        tired = trial > CAMERA_TRIALS // 2  # a room full of furniture is looked at from above it
        if cv2.pointPolygonTest(contour, tuple(xy.tolist()), True) > edge_m and (free or tired):
            place = np.append(xy, floor_m + random.uniform(0.9, 1.7))
            cameras.append((place, random.uniform(-np.pi, np.pi), random.uniform(0.5, 1.2) * np.pi))
        if len(cameras) == camera_count:
            break
    return cameras


def _is_close_to(xy: F64, boxes: F64) -> bool:
    """Whether a point (2,) is less than CLEAR_M from a box (N, 2, 3) in plan."""
    return bool(((xy > boxes[:, 0, :2] - CLEAR_M) & (xy < boxes[:, 1, :2] + CLEAR_M)).all(axis=1).any())


def _visible_points(
    items: list[PlacedItem], cameras: list[tuple[F64, float, float]], random: np.random.Generator
) -> list[F32]:
    """Points (N, 3) of each item that some camera sees, one per voxel, with noise."""
    coarse_mask = [_surface_points(item, random) for item in items]
    xyz, normal = (np.concatenate([pair[k] for pair in coarse_mask]) for k in (0, 1))
    owner = np.repeat(np.arange(len(items)), [len(pair[0]) for pair in coarse_mask])
    seen = np.zeros(len(xyz), bool)
    for place, heading, half_sector in cameras:
        seen |= _visible(xyz, normal, place, heading, half_sector)
    xyz, owner = xyz[seen], owner[seen]
    xyz = xyz + random.normal(0, NOISE_M, xyz.shape)
    cells = np.floor(xyz / VOXEL_M).astype(np.int64)
    _, first = np.unique(np.column_stack((owner, cells)), axis=0, return_index=True)
    xyz, owner = xyz[first].astype(np.float32), owner[first]
    return [xyz[owner == k] for k in range(len(items))]


def _surface_points(placed: PlacedItem, random: np.random.Generator) -> tuple[F64, F64]:
    """Points (N, 3) drawn evenly on an item's faces, and the normals there, world frame."""
    corners = np.concatenate([part.vertices[part.faces] for part in placed.item.parts])
    pose = placed.world_from_item
    corners = corners @ pose[:3, :3].T + pose[:3, 3]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    twice = np.linalg.norm(cross, axis=1)
    counts = random.poisson(twice / 2 * DENSITY_PER_M2)
    face = np.repeat(np.arange(len(corners)), counts)
    a, b = random.random((2, len(face), 1))
    flip = a + b > 1
    a, b = np.where(flip, 1 - a, a), np.where(flip, 1 - b, b)
    of_face = corners[face]
    xyz = of_face[:, 0] + a * (of_face[:, 1] - of_face[:, 0]) + b * (of_face[:, 2] - of_face[:, 0])
    return xyz, cross[face] / np.maximum(twice[face, None], 1e-12)


def _visible(xyz: F64, normal: F64, place: F64, heading: float, half_sector: float) -> Bool:
    """(N,) which points face a camera at `place` within its sector and range, unoccluded."""
    ray = xyz - place
    away = np.linalg.norm(ray, axis=1)
    azimuth = np.arctan2(ray[:, 1], ray[:, 0])
    off = np.abs((azimuth - heading + np.pi) % (2 * np.pi) - np.pi)
    tilt = np.arcsin(np.clip(ray[:, 2] / np.maximum(away, 1e-6), -1, 1))
    columns, rows = DIRECTIONS
    column = np.clip(((azimuth + np.pi) / (2 * np.pi) * columns).astype(np.int64), 0, columns - 1)
    row = np.clip(((tilt + np.pi / 2) / np.pi * rows).astype(np.int64), 0, rows - 1)
    nearest = np.full(columns * rows, np.inf)
    np.minimum.at(nearest, row * columns + column, away)
    facing = np.einsum("ij,ij->i", ray, normal) < -0.08 * away  # grazing rays give no depth
    near = away < np.minimum(FAR_M, nearest[row * columns + column] + THICK_M)
    return np.asarray(facing & near & (off < half_sector))


def _merge_neighbors(pairs: list[tuple[F32, int]], random: np.random.Generator) -> list[tuple[F32, int]]:
    """Some objects absorb their nearest neighbour when it is close."""
    pairs = list(pairs)
    k = 0
    while k < len(pairs):
        if random.random() < 0.04 and len(pairs) > 1:
            xyz, location = pairs[k]
            low, high = xyz.min(axis=0), xyz.max(axis=0)
            gaps = [
                np.inf if j == k else float(np.maximum(np.maximum(low - o.max(axis=0), o.min(axis=0) - high), 0).max())
                for j, (o, _) in enumerate(pairs)
            ]
            j = int(np.argmin(gaps))
            if gaps[j] < 0.1:
                other_xyz, other_location = pairs[j]
                pairs[k] = (
                    np.concatenate((xyz, other_xyz)),
                    location if len(xyz) >= len(other_xyz) else other_location,
                )
                del pairs[j]
                k -= j < k
        k += 1
    return pairs


def _cut_in_two(xyz: F32, share: float, random: np.random.Generator) -> tuple[F32, F32]:
    """An object cut by a vertical plane: the larger part, and the part with `share` of the points."""
    angle = random.uniform(0, 2 * np.pi)
    along = xyz[:, :2] @ np.array([np.cos(angle), np.sin(angle)], np.float32)
    low = along < np.quantile(along, share)
    return xyz[~low], xyz[low]


def _phantom_object(scan: RoomScan, random: np.random.Generator) -> F32:
    """A box of points somewhere in the room, like a piece of wall or a removed object."""
    size = random.uniform(0.1, 0.6, 3)
    x, y = random.uniform(scan.rectangle[:2], scan.rectangle[2:])
    low = np.array([x, y, scan.low_m + random.choice([0.0, 0.8, 1.4])]) - size * (0.5, 0.5, 0)
    return (low + random.random((200, 3)) * size).astype(np.float32)


def write_scans(scans: list[RoomScan], file: Path) -> None:
    """Store the rooms of a house as one compressed .npz."""
    objects = [xyz for scan in scans for xyz in scan.objects]
    outlines = [xy for scan in scans for xy in scan.outlines]
    partial = file.with_suffix(".part.npz")
    np.savez_compressed(
        partial,
        points=np.round(np.concatenate([*objects, np.zeros((0, 3))]) / STEP_M).astype(np.int16),
        point_counts=np.array([len(xyz) for xyz in objects], np.int64),
        object_counts=np.array([len(scan.objects) for scan in scans], np.int64),
        location=np.array([location for scan in scans for location in scan.location], np.int64),
        corners=np.concatenate([*outlines, np.zeros((0, 2))]),
        corner_counts=np.array([len(xy) for xy in outlines], np.int64),
        outline_counts=np.array([len(scan.outlines) for scan in scans], np.int64),
        rooms=np.array([[scan.floor, scan.low_m, scan.high_m, *scan.rectangle] for scan in scans]),
    )
    partial.replace(file)


def read_scans(file: Path) -> list[RoomScan]:
    """What write_scans stored; raises SourceError when it cannot be read."""
    try:
        with np.load(file) as stored:
            data = {name: stored[name] for name in stored.files}
    except (OSError, ValueError) as error:
        raise SourceError(f"{file}: no stored scans: {error}") from error
    points = np.split((data["points"] * np.float32(STEP_M)).astype(np.float32), np.cumsum(data["point_counts"])[:-1])
    corners = np.split(data["corners"], np.cumsum(data["corner_counts"])[:-1])
    objects, outlines, object_locations = iter(points), iter(corners), iter(data["location"].tolist())

    def some(source: Iterator[F64] | Iterator[F32], count: int) -> tuple[NDArray[np.floating], ...]:
        return tuple(next(source) for _ in range(count))

    scans = []
    for row, n, m in zip(data["rooms"], data["object_counts"].tolist(), data["outline_counts"].tolist(), strict=True):
        room_objects = tuple(np.asarray(xyz, np.float32) for xyz in some(objects, n))
        room_locations = tuple(next(object_locations) for _ in range(n))
        room_outlines = tuple(np.asarray(xy, np.float64) for xy in some(outlines, m))
        scans.append(
            RoomScan(int(row[0]), float(row[1]), float(row[2]), row[3:], room_objects, room_locations, room_outlines)
        )
    return scans
