"""Which way is up by the level surfaces of a view: floors, tables, seats.

Source: ours. Odometry's tilt drifts, and a floor that leans by a degree is 17 cm off after ten metres.
"""

from __future__ import annotations

import numpy as np
from pydantic import BaseModel, Field

from placegraph.runtime.arrays import F64
from placegraph.runtime.vision.point_to_plane import Surface


class LevelConfig(BaseModel, frozen=True, strict=True, extra="forbid"):
    """When a view shows which way is up."""

    near_rad: float = 0.12  # a normal so near the expected up is that of a level surface
    min_share: float = Field(default=0.1, gt=0)  # of the known cells must have one
    sigma_rad: float = Field(default=0.01, gt=0)  # of the mean of those normals
    rounds: int = 3


def find_level(surface: Surface, world_from_camera: F64, config: LevelConfig) -> F64 | None:
    """Up (3,), unit, in the camera's frame, near what the pose (4, 4) says; None where too little is level."""
    normals = surface.normals.reshape(-1, 3)
    normals = normals[np.isfinite(normals[:, 0])]
    up = world_from_camera[2, :3]
    for _ in range(config.rounds):
        level = normals[normals @ up > np.cos(config.near_rad)]
        if len(level) < config.min_share * max(len(normals), 1) or len(level) < 100:
            return None
        mean = np.median(level, axis=0)
        up = mean / np.linalg.norm(mean)
    return np.asarray(up)
