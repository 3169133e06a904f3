"""Which way is up, by the level surfaces of a view: floors, tables, seats.

Source: ours. The tilt of odometry drifts, and a floor that leans by one degree is 17 cm off after ten metres.
"""

from __future__ import annotations

import numpy as np
from pydantic import BaseModel, Field

from placegraph.runtime.arrays import F64
from placegraph.runtime.vision.point_to_plane import SurfaceMap

MIN_LEVEL_NORMALS = 100  # cells of the surface; chosen by hand


class LevelSurfaceConfig(BaseModel, frozen=True, strict=True, extra="forbid"):
    """When a view shows which way is up."""

    max_angle_rad: float = 0.12  # between the normal of a level surface and the expected up
    min_share: float = Field(default=0.1, gt=0)  # minimum share of the known normals that belong to level surfaces
    sigma_rad: float = Field(default=0.01, gt=0)  # of the mean of those normals
    iterations: int = 3


def up_from_level_surfaces(surface: SurfaceMap, world_from_camera: F64, config: LevelSurfaceConfig) -> F64 | None:
    """Up (3,), unit, camera frame, near that of the pose (4, 4); None where too little of the surface is level."""
    normals = surface.normals.reshape(-1, 3)
    normals = normals[np.isfinite(normals[:, 0])]
    up = world_from_camera[2, :3]
    for _ in range(config.iterations):
        level = normals[normals @ up > np.cos(config.max_angle_rad)]
        if len(level) < config.min_share * max(len(normals), 1) or len(level) < MIN_LEVEL_NORMALS:
            return None
        mean = np.median(level, axis=0)
        up = mean / np.linalg.norm(mean)
    return np.asarray(up)
