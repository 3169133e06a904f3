"""Read the parts of a data set folder: settings, images, poses and calibration, with errors that name the file."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any, ClassVar, TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, ValidationError

from placegraph.nodes.camera import FrameSource
from placegraph.runtime.arrays import F64, U8, U16
from placegraph.runtime.errors import ConfigError, SourceError
from placegraph.runtime.messages import Frame
from placegraph.runtime.vision.geometry import is_rigid

NO_POSE = np.full((4, 4), np.nan)
NO_UP = np.full(3, np.nan)


class SourceSettings(BaseModel):
    """Base of every source's settings: frozen, strict, unknown keys refused."""

    model_config = ConfigDict(frozen=True, strict=True, extra="forbid")


S = TypeVar("S", bound=SourceSettings)


class NumberedFrames(FrameSource):
    """Base of sources whose frames have a number and no time: numbers are turned into times by a rate."""

    has_z_up: ClassVar[bool] = True  # the world of the poses has z up, so a pose also gives which way is up
    numbers: Collection[int]  # of the frames, ascending
    rate_hz: float
    depth_unit_m: float = 0.001

    def read_images(self, number: int) -> tuple[U8, U16, F64]:
        """Aligned colour and depth of a frame, and fx fy cx cy in px; raises SourceError."""
        raise NotImplementedError

    def read_pose(self, number: int) -> F64:
        """world_from_camera (4, 4) in metres of a frame, NaN where tracking was lost; raises SourceError."""
        raise NotImplementedError

    def frames(self) -> Iterator[Frame]:
        """Frames by number. Raises SourceError naming the file that is missing or damaged."""
        for frame_id, number in enumerate(self.numbers):
            color, depth, intrinsics = self.read_images(number)
            pose = self.read_pose(number)
            yield Frame(
                frame_id=frame_id,
                stamp_ns=self._stamp_ns(number),
                color=color,
                depth=depth,
                depth_unit_m=self.depth_unit_m,
                intrinsics=intrinsics,
                given_world_from_camera=pose,
                up_camera=pose[2, :3].copy() if self.has_z_up else NO_UP,  # transpose of the rotation, times z
            )

    def given_poses(self) -> dict[int, F64]:
        """stamp_ns to (4, 4) world_from_camera in metres, for every frame that was tracked. Raises SourceError."""
        poses = {self._stamp_ns(number): self.read_pose(number) for number in self.numbers}
        return {stamp: pose for stamp, pose in poses.items() if np.isfinite(pose).all()}

    def _stamp_ns(self, number: int) -> int:
        return round(number * 1e9 / self.rate_hz)


def check_folder(path: Path) -> None:
    """Raise SourceError unless `path` is a folder."""
    if not path.is_dir():
        raise SourceError(f"{path}: no such folder")


def read_settings(kind: type[S], settings: dict[str, Any]) -> S:
    """Check a source's settings; raises ConfigError naming the key."""
    try:
        return kind.model_validate(settings)
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(str(part) for part in first["loc"]) or "settings"
        raise ConfigError(f"[nodes.camera.settings] {key}: {first['msg']}") from None


def read_text(path: Path) -> str:
    """A small text file; raises SourceError."""
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise SourceError(f"{path}: cannot be read: {_reason(error)}") from None


def read_numbers(path: Path, shape: tuple[int, ...], what: str) -> F64:
    """Numbers of a text file as an array of `shape`, which may hold nan or inf; raises SourceError."""
    text = read_text(path)
    try:
        values = np.array([float(word) for word in text.split()])
        return values.reshape(shape)
    except ValueError:
        raise SourceError(f"{path}: expected {what} ({'x'.join(map(str, shape))} numbers)") from None


def read_pose(path: Path) -> F64:
    """world_from_camera (4, 4) in metres of a text file with 16 numbers, row by row; raises SourceError.

    All NaN where tracking was lost: trackers write -inf or nan (7-Scenes, ScanNet), ScanNet's reader also knows zeros.
    """
    matrix = read_numbers(path, (4, 4), "a pose matrix")
    if not np.isfinite(matrix[:3]).any() or not matrix[:3].any():
        return NO_POSE.copy()
    if not is_rigid(matrix):
        raise SourceError(f"{path}: not a rigid pose: rotation and translation expected")
    return matrix


def read_pinhole(path: Path, size: int = 3) -> F64:
    """Read fx fy cx cy (4,) in px out of a file with a camera matrix of (size, size); raises SourceError."""
    matrix = read_numbers(path, (size, size), "a camera matrix")
    focal_and_center = matrix[[0, 1, 0, 1], [0, 1, 2, 2]]
    pinhole = np.eye(size)
    pinhole[[0, 1, 0, 1], [0, 1, 2, 2]] = focal_and_center
    if not np.allclose(matrix, pinhole, equal_nan=True):
        raise SourceError(f"{path}: not a pinhole camera matrix without skew: {matrix.tolist()}")
    return check_intrinsics(focal_and_center, str(path))


def numbered_files(folder: Path, pattern: re.Pattern[str]) -> dict[int, Path]:
    """The files whose whole name fits `pattern` by frame number, the first group of `pattern`, in ascending order.

    Raises SourceError without such a folder and where two files have one number.
    """
    try:
        names = sorted(path.name for path in folder.iterdir())
    except OSError as error:
        raise SourceError(f"{folder}: cannot be read: {_reason(error)}") from None
    files: dict[int, Path] = {}
    for match in filter(None, map(pattern.fullmatch, names)):
        number, path = int(match[1]), folder / match[0]
        if number in files:
            raise SourceError(f"{path}: frame {number} has a second file, {files[number].name}")
        files[number] = path
    return dict(sorted(files.items()))


def check_same_frames(kinds: dict[str, dict[int, Path]]) -> None:
    """Raise SourceError where not every kind of file ("colour", "depth", ...) has the frames of the first."""
    (name, files), *others = kinds.items()
    for other_name, other in others:
        unpaired = sorted(files.keys() ^ other.keys())
        if unpaired:
            path, missing = (files[unpaired[0]], other_name) if unpaired[0] in files else (other[unpaired[0]], name)
            counts = f"{len(files)} {name} and {len(other)} {other_name} files"
            raise SourceError(f"{path}: frame {unpaired[0]} has no {missing} file ({counts})")


def read_color(path: Path) -> U8:
    """(H, W, 3) uint8 sRGB; raises SourceError when it is not a complete image."""
    return np.asarray(cv2.cvtColor(_decode(path, cv2.IMREAD_COLOR), cv2.COLOR_BGR2RGB), np.uint8)


def read_depth(path: Path) -> U16:
    """(H, W) uint16 sensor integers; raises SourceError when it is not a complete 16 bit image of one channel."""
    image = _decode(path, cv2.IMREAD_UNCHANGED)
    if image.dtype != np.uint16 or image.ndim != 2:
        channels = image.shape[2] if image.ndim == 3 else 1
        raise SourceError(f"{path}: depth must be 16 bit of one channel, found {image.dtype} of {channels}")
    return image


def read_color_and_depth(color_path: Path, depth_path: Path) -> tuple[U8, U16]:
    """An aligned colour and depth pair of one size; raises SourceError."""
    color, depth = read_color(color_path), read_depth(depth_path)
    if color.shape[:2] != depth.shape:
        sizes = f"{depth.shape[1]}x{depth.shape[0]}, its colour image is {color.shape[1]}x{color.shape[0]}"
        raise SourceError(f"{depth_path}: depth is {sizes}: they must be aligned and of one size")
    return color, depth


def check_intrinsics(intrinsics: F64, where: str) -> F64:
    """(4,) fx fy cx cy in px: finite, focal lengths and centre positive; raises SourceError naming `where`."""
    if intrinsics.shape != (4,) or not np.isfinite(intrinsics).all() or (intrinsics <= 0).any():
        raise SourceError(f"{where}: fx fy cx cy must be four positive numbers, found {intrinsics.tolist()}")
    return intrinsics


def check_center(intrinsics: F64, size: tuple[int, int], where: str) -> None:
    """Raise SourceError when the principal point lies outside an image of (height, width) px."""
    cx, cy = float(intrinsics[2]), float(intrinsics[3])
    if not (0 < cx < size[1] and 0 < cy < size[0]):
        raise SourceError(f"{where}: the principal point ({cx:g}, {cy:g}) is outside the {size[1]}x{size[0]} image")


def _decode(path: Path, flag: int) -> NDArray[Any]:
    try:
        data = np.fromfile(path, np.uint8)
    except OSError as error:
        raise SourceError(f"{path}: cannot be read: {_reason(error)}") from None
    # refused before decoding: OpenCV fills what is missing of some truncated files, and libpng prints a line itself
    image = cv2.imdecode(data, flag) if _is_complete(data.tobytes()) else None
    if image is None:
        raise SourceError(f"{path}: not a whole image ({data.size} bytes): truncated or damaged")
    return np.asarray(image)


def _is_complete(data: bytes) -> bool:
    """Whether a PNG or JPEG has its end mark; other formats only need some content, their decoder checks them."""
    if data.startswith(b"\x89PNG"):
        return data.endswith(b"IEND\xaeB`\x82")
    if data.startswith(b"\xff\xd8"):
        return b"\xff\xd9" in data[-64:]  # some cameras pad after the mark
    return len(data) > 0


def _reason(error: Exception) -> str:
    return (error.strerror or str(error)) if isinstance(error, OSError) else str(error)
