"""Scene of the drawn flat: a kitchen, a living room and a doorway, made of coloured boxes, and a walk through both.

Metres; world frame with z up, the kitchen's south-west corner at the origin. All of it is made up.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.interpolate import PchipInterpolator

from placegraph.runtime.arrays import F64

Span = tuple[float, float, float, float, float, float]  # x y z of the one corner, x y z of the other
Color = tuple[int, int, int]

CEILING_M = 2.5
ROOMS: tuple[tuple[str, Span], ...] = (
    ("kitchen", (0.0, 0.0, 0.0, 4.0, 4.0, CEILING_M)),
    ("living room", (4.15, 0.0, 0.0, 9.15, 4.0, CEILING_M)),
)
STRUCTURE: tuple[tuple[Color, Span], ...] = (
    ((168, 160, 148), (-0.1, -0.1, -0.1, 9.25, 4.1, 0.0)),  # floor
    ((238, 238, 234), (-0.1, -0.1, CEILING_M, 9.25, 4.1, 2.6)),  # ceiling
    ((226, 221, 208), (-0.1, -0.1, 0.0, 0.0, 4.1, CEILING_M)),  # west
    ((226, 221, 208), (9.15, -0.1, 0.0, 9.25, 4.1, CEILING_M)),  # east
    ((220, 216, 205), (0.0, -0.1, 0.0, 9.15, 0.0, CEILING_M)),  # south
    ((220, 216, 205), (0.0, 4.0, 0.0, 9.15, 4.1, CEILING_M)),  # north
    ((226, 221, 208), (4.0, 0.0, 0.0, 4.15, 1.4, CEILING_M)),  # between the rooms, beside the doorway
    ((226, 221, 208), (4.0, 2.4, 0.0, 4.15, 4.0, CEILING_M)),
    ((226, 221, 208), (4.0, 1.4, 2.05, 4.15, 2.4, CEILING_M)),  # above the doorway
    # posts, beams and radiators: odometry by shape needs more than bare planes
    *(((216, 210, 196), (x, 0.0, 0.0, x + 0.25, 0.18, CEILING_M)) for x in (0.0, 1.3, 2.7, 3.75, 4.15, 5.2, 8.1, 8.9)),
    *(((216, 210, 196), (x, 3.82, 0.0, x + 0.25, 4.0, CEILING_M)) for x in (0.7, 3.3, 4.15, 5.3, 7.9, 8.9)),
    *(((216, 210, 196), (0.0, y, 0.0, 0.18, y + 0.25, CEILING_M)) for y in (0.7, 1.9, 2.8)),
    *(((216, 210, 196), (3.85, y, 0.0, 4.3, y + 0.2, CEILING_M)) for y in (0.5, 1.2, 2.4, 3.3)),
    *(((216, 210, 196), (8.97, y, 0.0, 9.15, y + 0.25, CEILING_M)) for y in (0.7, 2.4)),
    *(
        ((205, 201, 190), (x, 0.0, 2.28, x + 0.2, 4.0, CEILING_M))
        for x in (0.5, 1.5, 2.5, 3.5, 4.7, 5.7, 6.7, 7.7, 8.7)
    ),
    *(((232, 232, 230), (x, 0.02, 0.15, x + 0.8, 0.16, 0.75)) for x in (1.65, 2.8, 4.35)),
    ((232, 232, 230), (8.99, 2.75, 0.15, 9.13, 3.2, 0.75)),
)
CLASSES = (
    "background", "book", "bookshelf", "cabinet", "chair", "cup", "lamp", "oven", "potted plant", "refrigerator",
    "sofa", "table", "tv",
)  # fmt: skip
COLORS: dict[str, Color] = {
    "book": (50, 190, 200),
    "bookshelf": (110, 60, 130),
    "cabinet": (125, 165, 45),
    "chair": (205, 60, 40),
    "cup": (225, 60, 160),
    "lamp": (250, 215, 70),
    "oven": (40, 70, 80),
    "potted plant": (45, 140, 55),
    "refrigerator": (160, 195, 230),
    "sofa": (50, 85, 185),
    "table": (150, 88, 42),
    "tv": (26, 24, 34),
}


@dataclass(frozen=True)
class DrawnObject:
    """One object: its class and the boxes it is made of."""

    name: str
    parts: tuple[Span, ...]

    @property
    def box(self) -> F64:
        """(2, 3) min and max in metres, world frame."""
        spans = np.array(self.parts).reshape(-1, 2, 3)
        return np.stack((spans[:, 0].min(axis=0), spans[:, 1].max(axis=0)))


def _table(x0: float, y0: float, x1: float, y1: float, top: float) -> DrawnObject:
    leg = 0.06
    legs = [(x, y, 0.0, x + leg, y + leg, top - 0.05) for x in (x0, x1 - leg) for y in (y0, y1 - leg)]
    return DrawnObject("table", ((x0, y0, top - 0.05, x1, y1, top), *legs))


def _chair(x: float, y: float, back: str) -> DrawnObject:
    """A chair of 0.42 m around (x, y) whose back is on its w, e, s or n side."""
    h, leg, thick = 0.21, 0.04, 0.05
    legs = [(a, b, 0.0, a + leg, b + leg, 0.42) for a in (x - h, x + h - leg) for b in (y - h, y + h - leg)]
    backs: dict[str, Span] = {
        "w": (x - h, y - h, 0.46, x - h + thick, y + h, 0.9),
        "e": (x + h - thick, y - h, 0.46, x + h, y + h, 0.9),
        "s": (x - h, y - h, 0.46, x + h, y - h + thick, 0.9),
        "n": (x - h, y + h - thick, 0.46, x + h, y + h, 0.9),
    }
    return DrawnObject("chair", ((x - h, y - h, 0.42, x + h, y + h, 0.46), backs[back], *legs))


def _cup(x: float, y: float, z: float) -> DrawnObject:
    return DrawnObject(
        "cup", ((x, y, z, x + 0.1, y + 0.1, z + 0.13), (x + 0.1, y + 0.03, z + 0.03, x + 0.14, y + 0.07, z + 0.1))
    )


def _bookshelf() -> DrawnObject:
    x0, y0, x1, y1, top = 8.83, 1.0, 9.15, 2.1, 1.8
    boards = [(x0, y0, z, x1, y1, z + 0.04) for z in (0.05, 0.5, 0.95, 1.4, top - 0.04)]
    sides = [(x0, y, 0.0, x1, y + 0.04, top) for y in (y0, y1 - 0.04)]
    return DrawnObject("bookshelf", (*boards, *sides, (x1 - 0.03, y0, 0.0, x1, y1, top)))


OBJECTS: tuple[DrawnObject, ...] = (
    DrawnObject("refrigerator", ((0.0, 3.3, 0.0, 0.65, 3.95, 1.75),)),
    DrawnObject("oven", ((1.0, 3.4, 0.0, 1.6, 4.0, 0.9),)),
    DrawnObject("cabinet", ((1.62, 3.4, 0.0, 3.2, 4.0, 0.9),)),
    _table(1.0, 1.1, 2.2, 1.9, 0.75),
    _chair(0.68, 1.5, "w"),
    _chair(2.52, 1.5, "e"),
    _chair(1.6, 0.78, "s"),
    _chair(1.6, 2.22, "n"),
    _cup(1.75, 1.5, 0.75),
    DrawnObject(
        "sofa",
        (
            (6.0, 0.0, 0.08, 7.8, 0.9, 0.42),
            (6.0, 0.0, 0.42, 7.8, 0.22, 0.85),
            (6.0, 0.22, 0.42, 6.2, 0.9, 0.62),
            (7.6, 0.22, 0.42, 7.8, 0.9, 0.62),
        ),
    ),
    DrawnObject("cabinet", ((6.1, 3.6, 0.0, 7.6, 4.0, 0.45),)),
    DrawnObject("tv", ((6.35, 3.74, 0.53, 7.35, 3.8, 1.12), (6.7, 3.7, 0.45, 7.0, 3.84, 0.53))),
    _table(6.4, 1.5, 7.4, 2.0, 0.42),
    DrawnObject("book", ((6.55, 1.62, 0.42, 6.83, 1.84, 0.47),)),
    _cup(7.15, 1.7, 0.42),
    _bookshelf(),
    DrawnObject(
        "potted plant",
        ((8.65, 3.4, 0.0, 8.97, 3.72, 0.35), (8.78, 3.53, 0.35, 8.84, 3.59, 0.7), (8.55, 3.3, 0.7, 9.07, 3.82, 1.2)),
    ),
    DrawnObject(
        "lamp",
        ((8.5, 0.3, 0.0, 8.8, 0.6, 0.04), (8.63, 0.43, 0.04, 8.67, 0.47, 1.3), (8.47, 0.27, 1.3, 8.83, 0.63, 1.62)),
    ),
)

EYE_M = 1.2
PITCH_RAD = -np.deg2rad(8.0)
WALK = (  # x, y in metres and the heading in degrees (0 = east, counter-clockwise)
    (3.25, 2.80, 215.0),
    (3.45, 1.80, 180.0),
    (3.40, 0.90, 140.0),
    (3.20, 0.75, 90.0),
    (3.20, 1.40, 50.0),
    (3.70, 1.85, 10.0),
    (4.80, 1.90, -10.0),
    (5.40, 2.35, -25.0),
    (6.40, 2.70, -10.0),
    (7.40, 2.70, 40.0),
    (7.80, 2.60, 100.0),
    (7.90, 2.30, 165.0),
)
STEP_M, STEP_RAD = 0.05, np.deg2rad(3.0)  # the longest step and turn between two frames of the whole walk


@cache
def sample_walk() -> tuple[F64, int]:
    """The walk sampled densely: rows (K, 4) of x, y, heading in rad and the share of the walk done, and its frames."""
    knots = np.array(WALK)
    along = np.linspace(0.0, len(knots) - 1.0, 4001)
    # monotone between knots: no overshoot, so the walk stays clear of what the knots stay clear of
    path = PchipInterpolator(np.arange(len(knots)), np.column_stack((knots[:, :2], np.deg2rad(knots[:, 2]))))(along)
    moved = np.linalg.norm(np.diff(path[:, :2], axis=0), axis=1) / STEP_M
    turned = np.abs(np.diff(path[:, 2])) / STEP_RAD
    done = np.concatenate(([0.0], np.cumsum(np.maximum(moved, turned))))
    return np.column_stack((path, done / done[-1])), int(np.ceil(done[-1])) + 1


def camera_poses(frames: int) -> F64:
    """`frames` camera poses evenly along the walk: world_from_camera (frames, 4, 4) in metres."""
    path, _ = sample_walk()
    shares = np.linspace(0.0, 1.0, frames)
    x, y, heading = (np.interp(shares, path[:, 3], path[:, k]) for k in range(3))
    cosine, sine = np.cos(heading), np.sin(heading)
    level, zero = np.cos(PITCH_RAD), np.zeros(frames)
    forward = np.column_stack((cosine * level, sine * level, zero + np.sin(PITCH_RAD)))
    right = np.column_stack((sine, -cosine, zero))
    world_from_camera = np.tile(np.eye(4), (frames, 1, 1))
    world_from_camera[:, :3, 0] = right
    world_from_camera[:, :3, 1] = np.cross(forward, right)  # down
    world_from_camera[:, :3, 2] = forward
    world_from_camera[:, :3, 3] = np.column_stack((x, y, zero + EYE_M))
    return world_from_camera
