"""HM3DSem walks as HOV-SG renders them with habitat-sim: colour, depth in millimetres and a pose for every frame.

Source: github.com/hovsg/HOV-SG (README "Dataset Preparation"; `save_obs` in hovsg/data/hm3dsem/habitat_utils.py;
hovsg/dataloader/hm3dsem.py): in a scene's folder `rgb/SCENE_000000.png` and `depth/SCENE_000000.png` of 1080x720 px
(README writes SCENE-000000; both are read), and `pose/SCENE_000000.txt`, one line of 16 numbers: a camera-to-world
matrix, row by row. `semantic/` is not read. The sensor is habitat-sim's pinhole of 90 degrees in width.

World and camera are habitat's: y up, and the camera looks along its -z. Both are turned here: the world about x, so
that z is up, and the camera to x right, y down, z forward; so a pose also gives which way is up. A point (x, y, z) of
HOV-SG's truth is at (x, -z, y) here. Not as in HOV-SG, the image centre is at (W-1)/2, because pixel centres are whole
numbers here; its W/2 is half a pixel off. Walks carry no times: frame numbers are turned into times.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from pydantic import Field

from placegraph.nodes.camera._dataset_reader import (
    SourceSettings,
    check_centre,
    check_intrinsics,
    check_same_frames,
    numbered_files,
    read_color_and_depth,
    read_pose,
    read_settings,
)
from placegraph.runtime.arrays import F64
from placegraph.runtime.errors import SourceError
from placegraph.runtime.messages import Frame

IMAGE, POSE = re.compile(r".+[_-](\d{6})\.png"), re.compile(r".+[_-](\d{6})\.txt")

WORLD_FROM_HABITAT = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
HABITAT_CAMERA_FROM_CAMERA = np.diag([1.0, -1.0, -1.0, 1.0])


class Settings(SourceSettings):
    """Settings of a walk."""

    rate_hz: float = Field(5.0, gt=0)  # frame numbers are turned into times with it: HOV-SG's steps of .2 m at 1 m/s
    # fx fy cx cy in px; without it 90 degrees over the image's width, HOV-SG and habitat-sim
    intrinsics: list[float] | None = Field(None, min_length=4, max_length=4)


class Hm3dSem:
    """Frames of one walk."""

    summary: ClassVar[str] = (
        "an HM3DSem walk of HOV-SG: rgb/SCENE_000000.png, depth/SCENE_000000.png, pose/SCENE_000000.txt"
    )
    live: ClassVar[bool] = False

    def __init__(self, path: Path, settings: dict[str, Any]) -> None:
        self._settings = read_settings(Settings, settings)
        if not path.is_dir():
            raise SourceError(f"{path}: no such folder")
        self._colors = numbered_files(path / "rgb", IMAGE)
        if not self._colors:
            raise SourceError(f"{path / 'rgb'}: no SCENE_000000.png")
        self._depths, self._poses = numbered_files(path / "depth", IMAGE), numbered_files(path / "pose", POSE)
        check_same_frames({"colour": self._colors, "depth": self._depths, "pose": self._poses})

    @staticmethod
    def matches(path: Path) -> bool:
        """Whether the folder holds rgb, depth and pose folders, the first with images of a walk."""
        if not all((path / name).is_dir() for name in ("rgb", "depth", "pose")):
            return False
        return any(IMAGE.fullmatch(image.name) for image in (path / "rgb").glob("*.png"))

    def frames(self) -> Iterator[Frame]:
        """Frames by number. Raises SourceError naming the file that is missing or damaged."""
        for frame_id, (number, color_path) in enumerate(self._colors.items()):
            color, depth = read_color_and_depth(color_path, self._depths[number])
            pose = _pose(self._poses[number])
            yield Frame(
                frame_id=frame_id,
                stamp_ns=self._stamp_ns(number),
                color=color,
                depth=depth,
                depth_unit_m=0.001,  # save_obs: metres times 1000
                intrinsics=self._intrinsics(depth.shape),
                given_world_from_camera=pose,
                up_camera=pose[2, :3].copy(),  # transpose of the rotation, times z
            )

    def given_poses(self) -> dict[int, F64]:
        """stamp_ns to (4, 4) world_from_camera in metres, z up. Raises SourceError."""
        return {self._stamp_ns(number): _pose(path) for number, path in self._poses.items()}

    def _stamp_ns(self, number: int) -> int:
        return round(number * 1e9 / self._settings.rate_hz)

    def _intrinsics(self, size: tuple[int, int]) -> F64:
        height, width = size
        where = "[nodes.camera.settings] intrinsics"
        focal = width / 2  # 90 degrees; pixels are square
        intrinsics = np.array(self._settings.intrinsics or [focal, focal, (width - 1) / 2, (height - 1) / 2])
        check_centre(check_intrinsics(intrinsics, where), size, where)
        return intrinsics


def _pose(file: Path) -> F64:
    """world_from_camera (4, 4) in metres, z up, camera z forward."""
    pose = WORLD_FROM_HABITAT @ read_pose(file) @ HABITAT_CAMERA_FROM_CAMERA
    if not np.isfinite(pose).all():
        raise SourceError(f"{file}: not a rigid pose: the simulator knows every pose")
    return pose


SOURCE = Hm3dSem
