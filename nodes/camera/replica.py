"""Replica scenes as rendered for iMAP and published with NICE-SLAM: exact colour, depth and poses of a walk in a room.

Source: github.com/cvg/nice-slam (scripts/download_replica.sh, src/utils/datasets.py, configs/Replica): in each scene's
folder `results/frame000000.jpg`, `results/depth000000.png` and `traj.txt`, whose line N is frame N's camera-to-world
matrix, row by row; beside the scenes `cam_params.json` with size, pinhole and depth steps a metre (1200x680, 6553.5).
The camera has x right, y down, z forward (NICE-SLAM turns y and z round for itself, its issue 10). The world is that of
Replica's meshes, z up, so a pose also gives which way is up. Frames carry no times: numbers are turned into times.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from pydantic import BaseModel, Field, ValidationError

from placegraph.nodes.camera import _dataset_reader as reader
from placegraph.runtime.arrays import F64, U8, U16
from placegraph.runtime.errors import SourceError
from placegraph.runtime.vision.geometry import is_rigid

COLOR, DEPTH = re.compile(r"frame(\d+)\.jpg"), re.compile(r"depth(\d+)\.png")
CAMERA, TRACK = "cam_params.json", "traj.txt"


class Settings(reader.SourceSettings):
    """Settings of a Replica scene."""

    rate_hz: float = Field(30.0, gt=0)  # frame numbers are turned into times with it; no rate is published


class Pinhole(BaseModel, frozen=True, allow_inf_nan=False):
    """What cam_params.json says of the camera: image size, pinhole in px, depth steps a metre."""

    w: int = Field(gt=0)
    h: int = Field(gt=0)
    fx: float = Field(gt=0)
    fy: float = Field(gt=0)
    cx: float = Field(gt=0)
    cy: float = Field(gt=0)
    scale: float = Field(gt=0)


class CameraFile(BaseModel, frozen=True):
    """cam_params.json."""

    camera: Pinhole


class Replica(reader.NumberedFrames):
    """Frames of one scene."""

    summary: ClassVar[str] = (
        "a Replica scene of NICE-SLAM: results/frame000000.jpg, results/depth000000.png, traj.txt; "
        "cam_params.json in it or beside it"
    )

    def __init__(self, path: Path, settings: dict[str, Any]) -> None:
        self._settings = reader.read_settings(Settings, settings)
        reader.check_folder(path)
        self.rate_hz = self._settings.rate_hz
        images = path / "results"
        self.numbers = self._colors = reader.numbered_files(images, COLOR)
        self._depths = reader.numbered_files(images, DEPTH)
        if not self._colors:
            raise SourceError(f"{images}: no frame*.jpg")
        reader.check_same_frames({"colour": self._colors, "depth": self._depths})
        self._camera_file = path / CAMERA if (path / CAMERA).exists() else path.absolute().parent / CAMERA
        self._camera = _read_camera(self._camera_file)
        self.depth_unit_m = 1.0 / self._camera.scale
        self._track = _read_track(path / TRACK)
        last = max(self._colors)
        if last >= len(self._track):
            raise SourceError(f"{path / TRACK}: {len(self._track)} poses, none for {self._colors[last].name}")

    @staticmethod
    def matches(path: Path) -> bool:
        """Whether the folder holds traj.txt and a folder `results`."""
        return (path / TRACK).is_file() and (path / "results").is_dir()

    def read_images(self, number: int) -> tuple[U8, U16, F64]:
        """Images of a frame; raises SourceError also where they are not of the size that cam_params.json says."""
        color, depth = reader.read_color_and_depth(self._colors[number], self._depths[number])
        camera = self._camera
        if depth.shape != (camera.h, camera.w):
            size = f"{depth.shape[1]}x{depth.shape[0]}"
            raise SourceError(f"{self._colors[number]}: is {size}; {self._camera_file} says {camera.w}x{camera.h}")
        intrinsics = np.array([camera.fx, camera.fy, camera.cx, camera.cy])
        reader.check_center(intrinsics, depth.shape, str(self._camera_file))
        return color, depth, intrinsics

    def read_pose(self, number: int) -> F64:
        """The pose in line `number` of the track."""
        return self._track[number].copy()


def _read_camera(file: Path) -> Pinhole:
    try:
        return CameraFile.model_validate_json(reader.read_text(file)).camera
    except ValidationError as error:
        first = error.errors()[0]
        raise SourceError(f"{file}: {'.'.join(map(str, first['loc'])) or 'the file'}: {first['msg']}") from None


def _read_track(file: Path) -> list[F64]:
    """A (4, 4) world_from_camera in metres for each line."""
    poses = []
    for number, line in enumerate(reader.read_text(file).splitlines(), 1):
        try:
            pose = np.array([float(word) for word in line.split()]).reshape(4, 4)
        except ValueError:
            raise SourceError(
                f"{file}:{number}: expected a pose of 16 numbers, found {len(line.split())} words"
            ) from None
        if not is_rigid(pose):
            raise SourceError(f"{file}:{number}: not a rigid pose: rotation and translation expected")
        poses.append(pose)
    return poses


SOURCE = Replica
