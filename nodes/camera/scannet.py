"""ScanNet scenes as the data set's SensReader extracts them: colour, depth in millimetres, a pose for every frame.

Source: Dai et al., "ScanNet", CVPR 2017; github.com/ScanNet/ScanNet, SensReader/python/SensorData.py (names, units,
poses camera to world). A pose that was lost is all -inf. The world has z up (paper: scans and poses are aligned to "a
common coordinate frame with the z-axis as the up vector"), so a pose also gives which way is up. Files carry no times:
frame numbers are turned into times.

Colour (1296x968 in most scenes) is larger than depth (640x480), and each has its own pinhole with one centre and one
direction: the maintainers say that the two are aligned and no extrinsic is to be applied (issues 2 and 92). A frame has
depth's size and pinhole; depth stays as it is, and colour is drawn into that pinhole through both camera matrices, as
SensReader colours its points (sensorData.h, saveToPointCloud). Not as there: a depth pixel gets the mean of the colour
pixels in it, not one of them, and where depth sees a few pixels more than colour, colour's edge is repeated.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, ClassVar

import cv2
import numpy as np
from pydantic import Field

from placegraph.nodes.camera import _dataset_reader as reader
from placegraph.runtime.arrays import F64, U8, U16
from placegraph.runtime.errors import SourceError

COLOR, DEPTH, POSE = re.compile(r"(\d+)\.jpg"), re.compile(r"(\d+)\.png"), re.compile(r"(\d+)\.txt")
# Fields of view of colour and depth are within some percent of each other. SensReader's image_size shrinks images but
# not the camera matrices beside them: those are then off by the ratio of the sizes.
MAX_VIEW_RATIO = 1.25


class Settings(reader.SourceSettings):
    """Settings of a ScanNet scene."""

    rate_hz: float = Field(30.0, gt=0)  # frame numbers are turned into times with it; the sensor's rate


class ScanNet(reader.NumberedFrames):
    """Frames of one scene."""

    summary: ClassVar[str] = (
        "a ScanNet scene that SensReader extracted: color/N.jpg, depth/N.png, pose/N.txt, "
        "intrinsic/intrinsic_color.txt and intrinsic_depth.txt"
    )

    def __init__(self, path: Path, settings: dict[str, Any]) -> None:
        self._settings = reader.read_settings(Settings, settings)
        reader.check_folder(path)
        self.rate_hz = self._settings.rate_hz
        self.numbers = self._colors = reader.numbered_files(path / "color", COLOR)
        if not self._colors:
            raise SourceError(f"{path / 'color'}: no N.jpg")
        self._depths = reader.numbered_files(path / "depth", DEPTH)
        self._poses = reader.numbered_files(path / "pose", POSE)
        reader.check_same_frames({"colour": self._colors, "depth": self._depths, "pose": self._poses})
        self._color_file, self._depth_file = (
            path / "intrinsic" / f"intrinsic_{kind}.txt" for kind in ("color", "depth")
        )
        self._color_intrinsics = reader.read_pinhole(self._color_file, size=4)
        self._depth_intrinsics = reader.read_pinhole(self._depth_file, size=4)

    @staticmethod
    def matches(path: Path) -> bool:
        """Whether the folder holds color, depth and pose folders."""
        return all((path / name).is_dir() for name in ("color", "depth", "pose"))

    def read_images(self, number: int) -> tuple[U8, U16, F64]:
        """Images of a frame, of depth's size and pinhole; depth in mm (SensReader's README: depth shift 1000)."""
        color, depth = reader.read_color(self._colors[number]), reader.read_depth(self._depths[number])
        self._check_sizes(self._colors[number], color.shape[:2], depth.shape)
        color = reproject_color(color, self._color_intrinsics, self._depth_intrinsics, depth.shape)
        return color, depth, self._depth_intrinsics

    def read_pose(self, number: int) -> F64:
        """The pose in the frame's file."""
        return reader.read_pose(self._poses[number])

    def _check_sizes(self, color_path: Path, color_size: tuple[int, ...], depth_size: tuple[int, int]) -> None:
        height, width = color_size
        reader.check_center(self._depth_intrinsics, depth_size, str(self._depth_file))
        reader.check_center(self._color_intrinsics, (height, width), str(self._color_file))
        view = (self._color_intrinsics[0] / width) / (self._depth_intrinsics[0] / depth_size[1])
        if not 1 / MAX_VIEW_RATIO < view < MAX_VIEW_RATIO:
            raise SourceError(
                f"{color_path}: a {width}x{height} image does not fit {self._color_file.name}: colour would see "
                f"{1 / view:.2f} times as wide as depth ({depth_size[1]}x{depth_size[0]}); was it resized?"
            )


def reproject_color(color: U8, from_intrinsics: F64, to_intrinsics: F64, size: tuple[int, int]) -> U8:
    """The image that a camera in the same place with another pinhole sees.

    color: (H, W, 3) sRGB. Intrinsics: (4,) fx fy cx cy in px, of `color` and of the result. size: height and width of
    the result. Where the result sees more than `color`, the edge of `color` is repeated. Equal pinholes change nothing.
    """
    height, width = size
    scale = np.array([width / color.shape[1], height / color.shape[0]])
    if (scale < 1).any():  # average first, or thin things of the larger image come and go
        color = np.asarray(cv2.resize(color, (width, height), interpolation=cv2.INTER_AREA))
        center = (from_intrinsics[2:] + 0.5) * scale - 0.5  # pixel centres are whole numbers
        from_intrinsics = np.concatenate((from_intrinsics[:2] * scale, center))
    zoom = from_intrinsics[:2] / to_intrinsics[:2]
    shift = from_intrinsics[2:] - zoom * to_intrinsics[2:]
    source_from_result = np.column_stack((np.diag(zoom), shift))
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    warped = cv2.warpAffine(color, source_from_result, (width, height), flags=flags, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(warped, np.uint8)


SOURCE = ScanNet
