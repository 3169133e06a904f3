"""7-Scenes folders: colour, depth in millimetres and a camera pose for every frame.

Source: Shotton et al., "Scene Coordinate Regression Forests", CVPR 2013 (the data set's layout and camera).
The world frame is that of the data set's tracker, which is not aligned with gravity: `up_camera` stays unknown.
The data set's depth camera is not registered to its colour camera: object borders may be off by some pixels.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from pydantic import Field

from placegraph.nodes.camera._dataset_reader import (
    NO_UP,
    SourceSettings,
    check_centre,
    check_intrinsics,
    numbered_files,
    read_color_and_depth,
    read_pinhole,
    read_pose,
    read_settings,
)
from placegraph.runtime.arrays import F64
from placegraph.runtime.errors import SourceError
from placegraph.runtime.messages import Frame

FRAME = re.compile(r"frame-(\d+)\.color\.(jpg|png)")
NO_READING = 65535  # the data set's value for "no depth", beside 0


class Settings(SourceSettings):
    """Settings of a 7-Scenes folder."""

    rate_hz: float = Field(30.0, gt=0)  # frame numbers are turned into times with it; Kinect v1
    # fx fy cx cy in px for a folder without camera-intrinsics.txt: what the data set's page states for all its scenes
    intrinsics: list[float] = Field([585.0, 585.0, 320.0, 240.0], min_length=4, max_length=4)


class SevenScenes:
    """Frames of one sequence."""

    summary: ClassVar[str] = (
        "a 7-Scenes folder: frame-000000.color.jpg (or .png), .depth.png, .pose.txt; camera-intrinsics.txt is optional"
    )
    live: ClassVar[bool] = False

    def __init__(self, path: Path, settings: dict[str, Any]) -> None:
        self._settings = read_settings(Settings, settings)
        self._folder = _sequence(path)
        self._colors = numbered_files(self._folder, FRAME)
        if not self._colors:
            raise SourceError(f"{self._folder}: no frame-*.color.jpg or .png")
        file = self._folder / "camera-intrinsics.txt"
        if not file.exists() and (path / file.name).exists():  # one calibration above the sequences
            file = path / file.name
        self._intrinsics_from = str(file) if file.exists() else "[nodes.camera.settings] intrinsics"
        by_setting = np.array(self._settings.intrinsics)
        self._intrinsics = read_pinhole(file) if file.exists() else check_intrinsics(by_setting, self._intrinsics_from)

    @staticmethod
    def matches(path: Path) -> bool:
        """Whether the folder, or its only sequence, holds frame-*.color files."""
        try:
            return bool(numbered_files(_sequence(path), FRAME))
        except (SourceError, OSError):
            return False

    def frames(self) -> Iterator[Frame]:
        """Frames by number. Raises SourceError naming the file that is missing or damaged."""
        for frame_id, (number, color_path) in enumerate(self._colors.items()):
            color, depth = read_color_and_depth(color_path, self._beside(color_path, "depth.png"))
            check_centre(self._intrinsics, depth.shape, self._intrinsics_from)
            depth[depth == NO_READING] = 0
            yield Frame(
                frame_id=frame_id,
                stamp_ns=self._stamp_ns(number),
                color=color,
                depth=depth,
                depth_unit_m=0.001,  # 7-Scenes: millimetres
                intrinsics=self._intrinsics,
                given_world_from_camera=read_pose(self._beside(color_path, "pose.txt")),
                up_camera=NO_UP,
            )

    def given_poses(self) -> dict[int, F64]:
        """stamp_ns to (4, 4) world_from_camera in metres, for every frame that was tracked. Raises SourceError."""
        poses = {
            self._stamp_ns(number): read_pose(self._beside(path, "pose.txt")) for number, path in self._colors.items()
        }
        return {stamp: pose for stamp, pose in poses.items() if np.isfinite(pose).all()}

    def _stamp_ns(self, number: int) -> int:
        return round(number * 1e9 / self._settings.rate_hz)

    @staticmethod
    def _beside(color_path: Path, ending: str) -> Path:
        return color_path.with_name(f"{color_path.name.split('.')[0]}.{ending}")


def _sequence(path: Path) -> Path:
    """The folder with the frames: the path itself, or its only seq-NN."""
    if not path.is_dir():
        raise SourceError(f"{path}: no such folder")
    sequences = sorted(folder for folder in path.glob("seq-*") if folder.is_dir())
    if not sequences or numbered_files(path, FRAME):
        return path
    if len(sequences) > 1:
        names = ", ".join(folder.name for folder in sequences)
        raise SourceError(f"{path}: holds several sequences ({names}): give the path of one")
    return sequences[0]


SOURCE = SevenScenes
