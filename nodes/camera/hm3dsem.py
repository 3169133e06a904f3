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
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from pydantic import Field

from placegraph.nodes.camera import _dataset_reader as reader
from placegraph.runtime.arrays import F64, U8, U16
from placegraph.runtime.errors import SourceError

IMAGE, POSE = re.compile(r".+[_-](\d{6})\.png"), re.compile(r".+[_-](\d{6})\.txt")

WORLD_FROM_HABITAT = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
HABITAT_CAMERA_FROM_CAMERA = np.diag([1.0, -1.0, -1.0, 1.0])


class Settings(reader.SourceSettings):
    """Settings of a walk."""

    rate_hz: float = Field(5.0, gt=0)  # frame numbers are turned into times with it: HOV-SG's steps of .2 m at 1 m/s
    # fx fy cx cy in px; without it 90 degrees over the image's width, HOV-SG and habitat-sim
    intrinsics: list[float] | None = Field(None, min_length=4, max_length=4)


class Hm3dSem(reader.NumberedFrames):
    """Frames of one walk."""

    summary: ClassVar[str] = (
        "an HM3DSem walk of HOV-SG: rgb/SCENE_000000.png, depth/SCENE_000000.png, pose/SCENE_000000.txt"
    )

    def __init__(self, path: Path, settings: dict[str, Any]) -> None:
        self._settings = reader.read_settings(Settings, settings)
        reader.check_folder(path)
        self.rate_hz = self._settings.rate_hz
        self.numbers = self._colors = reader.numbered_files(path / "rgb", IMAGE)
        if not self._colors:
            raise SourceError(f"{path / 'rgb'}: no SCENE_000000.png")
        self._depths = reader.numbered_files(path / "depth", IMAGE)
        self._poses = reader.numbered_files(path / "pose", POSE)
        reader.check_same_frames({"colour": self._colors, "depth": self._depths, "pose": self._poses})

    @staticmethod
    def matches(path: Path) -> bool:
        """Whether the folder holds rgb, depth and pose folders, the first with images of a walk."""
        if not all((path / name).is_dir() for name in ("rgb", "depth", "pose")):
            return False
        return any(IMAGE.fullmatch(image.name) for image in (path / "rgb").glob("*.png"))

    def read_images(self, number: int) -> tuple[U8, U16, F64]:
        """Images and pinhole of a frame."""
        color, depth = reader.read_color_and_depth(self._colors[number], self._depths[number])
        return color, depth, self._intrinsics(depth.shape)

    def read_pose(self, number: int) -> F64:
        """world_from_camera (4, 4) in metres, z up, camera z forward."""
        pose = WORLD_FROM_HABITAT @ reader.read_pose(self._poses[number]) @ HABITAT_CAMERA_FROM_CAMERA
        if not np.isfinite(pose).all():
            raise SourceError(f"{self._poses[number]}: not a rigid pose: the simulator knows every pose")
        return pose

    def _intrinsics(self, size: tuple[int, int]) -> F64:
        height, width = size
        where = "[nodes.camera.settings] intrinsics"
        focal = width / 2  # 90 degrees; pixels are square
        intrinsics = np.array(self._settings.intrinsics or [focal, focal, (width - 1) / 2, (height - 1) / 2])
        reader.check_center(reader.check_intrinsics(intrinsics, where), size, where)
        return intrinsics


SOURCE = Hm3dSem
