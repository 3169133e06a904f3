"""A trajectory in TUM's format: `seconds x y z qx qy qz qw` a line, world_from_camera."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from placegraph.runtime.arrays import F64
from placegraph.runtime.errors import SchemaError
from placegraph.runtime.messages import Pose
from placegraph.runtime.vision.geometry import quaternion_xyzw


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
    """TUM file to stamp_ns -> (3,) position in metres; raises SchemaError naming the line."""
    positions: dict[int, F64] = {}
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise SchemaError(f"{path}: cannot read: {error.strerror}") from None
    except UnicodeDecodeError as error:
        raise SchemaError(f"{path}: cannot read: {error}") from None
    for number, line in enumerate(text.splitlines(), 1):
        if not line.strip() or line.startswith("#"):
            continue
        try:
            stamp, *numbers = line.split()
            seconds, _, fraction = stamp.partition(".")
            position = np.array(numbers, float)
            if position.shape != (7,) or not np.isfinite(position).all():
                raise ValueError("expected 8 finite numbers")
            positions[int(seconds) * 10**9 + int(fraction.ljust(9, "0")[:9] or 0)] = position[:3]
        except ValueError as error:
            raise SchemaError(f"{path}:{number}: {error}") from None
    return positions
