"""A trajectory in TUM's format: `seconds x y z qx qy qz qw` a line, world_from_camera."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from placegraph.runtime.arrays import F64
from placegraph.runtime.errors import SchemaError
from placegraph.runtime.messages import Pose
from placegraph.runtime.vision.geometry import pose_from_quaternion, quaternion_xyzw


def write_trajectory(path: Path, poses: list[Pose]) -> None:
    """TUM format: `seconds x y z qx qy qz qw` for each trusted pose, world_from_camera, by time."""
    lines = []
    for pose in sorted((p for p in poses if p.trusted), key=lambda pose: pose.frame_id):
        x, y, z = pose.world_from_camera[:3, 3]
        quaternion = quaternion_xyzw(pose.world_from_camera[:3, :3])
        seconds = f"{pose.stamp_ns // 10**9}.{pose.stamp_ns % 10**9:09d}"
        lines.append(" ".join([seconds, *(f"{v:.6f}" for v in (x, y, z, *quaternion))]))
    path.write_text("# seconds tx ty tz qx qy qz qw\n" + "".join(line + "\n" for line in lines))


def read_trajectory(path: Path) -> dict[int, F64]:
    """World_from_camera (4, 4) in metres by stamp_ns of a TUM file; raises SchemaError naming the line."""
    poses: dict[int, F64] = {}
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise SchemaError(f"{path}: cannot read: {getattr(error, 'strerror', None) or error}") from None
    for number, line in enumerate(text.splitlines(), 1):
        if not line.strip() or line.startswith("#"):
            continue
        try:
            stamp, *words = line.split()
            seconds, _, fraction = stamp.partition(".")
            stamp_ns = int(seconds) * 10**9 + int(fraction.ljust(9, "0")[:9] or 0)
            numbers = np.array(words, float)
            if numbers.shape != (7,) or not np.isfinite(numbers).all():
                raise ValueError("expected 8 finite numbers")
            if not numbers[3:].any():
                raise ValueError("the quaternion is 0 0 0 0")
            if stamp_ns in poses:
                raise ValueError("a time appears twice")
        except ValueError as error:
            raise SchemaError(f"{path}:{number}: {error}") from None
        poses[stamp_ns] = pose_from_quaternion(numbers[:3], numbers[3:])
    return poses
