"""7-Scenes folders: colour, depth in millimetres and a camera pose for every frame.

Source: Shotton et al., "Scene Coordinate Regression Forests", CVPR 2013 (the data set's layout and camera).
The world frame is that of the data set's tracker, which is not aligned with gravity: `up_camera` stays unknown.
The data set's depth camera is not registered to its colour camera: object borders may be off by some pixels.
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

FRAME = re.compile(r"frame-(\d+)\.color\.(jpg|png)")
NO_READING = 65535  # the data set's value for "no depth", beside 0


class Settings(reader.SourceSettings):
    """Settings of a 7-Scenes folder."""

    rate_hz: float = Field(30.0, gt=0)  # frame numbers are turned into times with it; Kinect v1
    # fx fy cx cy in px for a folder without camera-intrinsics.txt: what the data set's page states for all its scenes
    intrinsics: list[float] = Field([585.0, 585.0, 320.0, 240.0], min_length=4, max_length=4)


class SevenScenes(reader.NumberedFrames):
    """Frames of one sequence."""

    summary: ClassVar[str] = (
        "a 7-Scenes folder: frame-000000.color.jpg (or .png), .depth.png, .pose.txt; camera-intrinsics.txt is optional"
    )
    has_z_up: ClassVar[bool] = False

    def __init__(self, path: Path, settings: dict[str, Any]) -> None:
        self._settings = reader.read_settings(Settings, settings)
        self.rate_hz, self._folder = self._settings.rate_hz, _sequence(path)
        self.numbers = self._colors = reader.numbered_files(self._folder, FRAME)
        if not self._colors:
            raise SourceError(f"{self._folder}: no frame-*.color.jpg or .png")
        file = self._folder / "camera-intrinsics.txt"
        if not file.exists() and (path / file.name).exists():  # one calibration above the sequences
            file = path / file.name
        self._intrinsics_from = str(file) if file.exists() else "[nodes.camera.settings] intrinsics"
        intrinsics = reader.read_pinhole(file) if file.exists() else np.array(self._settings.intrinsics)
        self._intrinsics = reader.check_intrinsics(intrinsics, self._intrinsics_from)

    @staticmethod
    def matches(path: Path) -> bool:
        """Whether the folder, or its only sequence, holds frame-*.color files."""
        try:
            return bool(reader.numbered_files(_sequence(path), FRAME))
        except (SourceError, OSError):
            return False

    def read_images(self, number: int) -> tuple[U8, U16, F64]:
        """Images of a frame, depth in mm."""
        color_path = self._colors[number]
        color, depth = reader.read_color_and_depth(color_path, self._beside(color_path, "depth.png"))
        reader.check_center(self._intrinsics, depth.shape, self._intrinsics_from)
        depth[depth == NO_READING] = 0
        return color, depth, self._intrinsics

    def read_pose(self, number: int) -> F64:
        """The pose in the frame's file."""
        return reader.read_pose(self._beside(self._colors[number], "pose.txt"))

    @staticmethod
    def _beside(color_path: Path, ending: str) -> Path:
        return color_path.with_name(f"{color_path.name.split('.')[0]}.{ending}")


def _sequence(path: Path) -> Path:
    """The folder with the frames: the path itself, or its only seq-NN."""
    reader.check_folder(path)
    sequences = sorted(folder for folder in path.glob("seq-*") if folder.is_dir())
    if not sequences or reader.numbered_files(path, FRAME):
        return path
    if len(sequences) > 1:
        names = ", ".join(folder.name for folder in sequences)
        raise SourceError(f"{path}: holds several sequences ({names}): give the path of one")
    return sequences[0]


SOURCE = SevenScenes
