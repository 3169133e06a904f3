"""Smooth sway of a walking camera, and camera poses from position and angles."""

from __future__ import annotations

import numpy as np

from placegraph.runtime.arrays import F64


def smooth_sway(random: np.random.Generator, stamps_s: F64, period_s: float, amplitude: float) -> F64:
    """(N,) a sum of three slow sines, at most `amplitude`."""
    total = np.zeros(len(stamps_s))
    for _ in range(3):
        total += np.sin(2 * np.pi * stamps_s / (period_s * random.uniform(0.7, 1.6)) + random.uniform(0, 2 * np.pi))
    return total * amplitude / 3


def camera_poses(xyz_world: F64, heading: F64, pitch: F64, roll: F64) -> F64:
    """(N, 4, 4) world_from_camera of cameras at (N, 3) metres that look along a heading, `pitch` radians downward."""
    zero = np.zeros_like(heading)
    ahead = np.stack((np.cos(heading) * np.cos(pitch), np.sin(heading) * np.cos(pitch), -np.sin(pitch)), axis=1)
    right = np.stack((np.sin(heading), -np.cos(heading), zero), axis=1)
    down = np.cross(ahead, right)
    c, s = np.cos(roll)[:, None], np.sin(roll)[:, None]
    poses = np.tile(np.eye(4), (len(heading), 1, 1))
    poses[:, :3, :3] = np.stack((c * right + s * down, c * down - s * right, ahead), axis=2)
    poses[:, :3, 3] = xyz_world
    return poses
