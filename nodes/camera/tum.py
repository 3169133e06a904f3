"""TUM RGB-D folders: colour and depth with a time each, and the motion capture's track of the camera.

Source: Sturm et al., "A Benchmark for the Evaluation of RGB-D SLAM Systems", IROS 2012, and the data set's page on file
formats (lists of `time file`, track of `time tx ty tz qx qy qz qw`, depth factor 5000, association by nearest time).
The track's world has z up (the motion capture was levelled), so a given pose also gives which way is up.
The lenses of freiburg1 and freiburg2 distort by some pixels at the border; images are given as they are.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from decimal import Decimal, InvalidOperation
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from pydantic import Field
from scipy.spatial.transform import Rotation, Slerp

from placegraph.nodes.camera import FrameSource
from placegraph.nodes.camera import _dataset_reader as reader
from placegraph.runtime.arrays import F64, I64
from placegraph.runtime.errors import ConfigError, SourceError
from placegraph.runtime.messages import Frame
from placegraph.runtime.vision.geometry import pose_from_quaternion

# fx fy cx cy in px of the three cameras, as the data set's page calibrates them (colour)
CAMERAS = {
    "1": (517.3, 516.5, 318.6, 255.3),
    "2": (520.9, 521.0, 325.1, 249.7),
    "3": (535.4, 539.2, 320.1, 247.6),
}
CAMERA_IN_NAME = re.compile(r"(?:freiburg|fr)([123])(?!\d)", re.IGNORECASE)


class Settings(reader.SourceSettings):
    """Settings of a TUM folder."""

    max_difference_s: float = Field(0.02, gt=0)  # colour to depth and to the track; the data set's tools
    depth_factor: float = Field(5000.0, gt=0)  # depth steps per metre; the data set's page
    intrinsics: list[float] | None = Field(None, min_length=4, max_length=4)  # fx fy cx cy in px


class Tum(FrameSource):
    """Frames of one sequence."""

    summary: ClassVar[str] = (
        "a TUM RGB-D folder: rgb.txt and depth.txt (lines of `time file`); optional groundtruth.txt, calibration.txt"
    )

    def __init__(self, path: Path, settings: dict[str, Any]) -> None:
        self._settings = reader.read_settings(Settings, settings)
        reader.check_folder(path)
        self._folder = path
        window_ns = round(self._settings.max_difference_s * 1e9)
        colors, color_files = _read_list(path / "rgb.txt")
        depths, depth_files = _read_list(path / "depth.txt")
        self._pairs = [
            (int(colors[i]), path / color_files[i], path / depth_files[j])
            for i, j in associate(colors, depths, window_ns)
        ]
        if not self._pairs:
            raise SourceError(
                f"{path}: no colour image has a depth image within {self._settings.max_difference_s:g} s of it"
            )
        self._intrinsics, self._intrinsics_from = self._read_intrinsics()
        track = path / "groundtruth.txt"
        self._poses: dict[int, F64] | None = None
        if track.exists():
            stamps = np.array([stamp for stamp, _, _ in self._pairs], np.int64)
            self._poses = _poses_at(stamps, *_read_track(track), window_ns)

    @staticmethod
    def matches(path: Path) -> bool:
        """Whether the folder holds rgb.txt and depth.txt."""
        return (path / "rgb.txt").is_file() and (path / "depth.txt").is_file()

    def frames(self) -> Iterator[Frame]:
        """Frames by colour time. Raises SourceError naming the file that is missing or damaged."""
        for frame_id, (stamp_ns, color_path, depth_path) in enumerate(self._pairs):
            color, depth = reader.read_color_and_depth(color_path, depth_path)
            reader.check_center(self._intrinsics, depth.shape, self._intrinsics_from)
            pose = (self._poses or {}).get(stamp_ns, reader.NO_POSE)
            yield Frame(
                frame_id=frame_id,
                stamp_ns=stamp_ns,
                color=color,
                depth=depth,
                depth_unit_m=1.0 / self._settings.depth_factor,
                intrinsics=self._intrinsics,
                given_world_from_camera=pose,
                up_camera=pose[2, :3].copy(),  # transpose of the rotation, times z
            )

    def given_poses(self) -> dict[int, F64] | None:
        """stamp_ns to (4, 4) world_from_camera in metres where the track covers a frame; None without a track."""
        return None if self._poses is None else dict(self._poses)

    def _read_intrinsics(self) -> tuple[F64, str]:
        if self._settings.intrinsics is not None:
            where = "[nodes.camera.settings] intrinsics"
            return reader.check_intrinsics(np.array(self._settings.intrinsics), where), where
        file = self._folder / "calibration.txt"
        if file.exists():
            return reader.check_intrinsics(reader.read_numbers(file, (4,), "fx fy cx cy"), str(file)), str(file)
        camera = CAMERA_IN_NAME.search(self._folder.resolve().name)
        if camera is None:
            raise ConfigError(
                f"{self._folder}: the camera is not known: no freiburg1, 2 or 3 in the folder's name and no "
                "calibration.txt (fx fy cx cy); set intrinsics = [fx, fy, cx, cy] in [nodes.camera.settings]"
            )
        return np.array(CAMERAS[camera[1]]), f"freiburg{camera[1]}'s calibration"


def associate(colors_ns: I64, depths_ns: I64, window_ns: int) -> list[tuple[int, int]]:
    """Pair two sorted lists of times (N,), (M,): nearest first, none apart by more than the window, each used once.

    Returns (colour index, depth index) by colour index.
    """
    first = np.searchsorted(depths_ns, colors_ns - window_ns, side="left")
    last = np.searchsorted(depths_ns, colors_ns + window_ns, side="right")
    candidates = [
        (abs(int(colors_ns[i] - depths_ns[j])), i, j)
        for i in range(len(colors_ns))
        for j in range(int(first[i]), int(last[i]))
    ]
    used_colors: set[int] = set()
    used_depths: set[int] = set()
    pairs: list[tuple[int, int]] = []
    for _, i, j in sorted(candidates):
        if i not in used_colors and j not in used_depths:
            used_colors.add(i)
            used_depths.add(j)
            pairs.append((i, j))
    return sorted(pairs)


def _rows(file: Path, columns: int, what: str) -> list[list[str]]:
    rows = []
    for number, line in enumerate(reader.read_text(file).splitlines(), 1):
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        if len(words) != columns:
            raise SourceError(f"{file}:{number}: expected {what}, found {line.strip()!r}")
        rows.append(words)
    return rows


def _stamp_ns(file: Path, word: str) -> int:
    # decimal: a double keeps only some 100 ns of a time since 1970
    try:
        return int(Decimal(word) * 1_000_000_000)
    except (InvalidOperation, OverflowError, ValueError):
        raise SourceError(f"{file}: not a time in seconds: {word!r}") from None


def _sorted_stamps(file: Path, rows: list[list[str]]) -> tuple[I64, list[list[str]]]:
    stamped = sorted((_stamp_ns(file, row[0]), row) for row in rows)
    stamps = np.array([stamp for stamp, _ in stamped], np.int64)
    repeated = np.flatnonzero(np.diff(stamps) == 0)
    if repeated.size:
        raise SourceError(f"{file}: time {stamped[int(repeated[0])][1][0]} appears twice")
    return stamps, [row for _, row in stamped]


def _read_list(file: Path) -> tuple[I64, list[str]]:
    """Times (N,) in ns, sorted, and the files."""
    stamps, rows = _sorted_stamps(file, _rows(file, 2, "`time file`"))
    if not rows:
        raise SourceError(f"{file}: lists no image")
    return stamps, [row[1] for row in rows]


def _read_track(file: Path) -> tuple[I64, F64]:
    """Times (N,) in ns, sorted, and rows (N, 7) of tx ty tz in metres and the quaternion qx qy qz qw."""
    stamps, rows = _sorted_stamps(file, _rows(file, 8, "`time tx ty tz qx qy qz qw`"))
    try:
        values = np.array([[float(word) for word in row[1:]] for row in rows]).reshape(-1, 7)
    except ValueError as error:
        raise SourceError(f"{file}: {error}") from None
    length = np.linalg.norm(values[:, 3:], axis=1)
    bad = np.flatnonzero(~np.isfinite(values).all(axis=1) | ~(np.abs(length - 1) < 0.01))  # files have 4 decimals
    if bad.size:
        raise SourceError(f"{file}: time {rows[int(bad[0])][0]}: not a position and a unit quaternion")
    return stamps, values


def _poses_at(stamps: I64, track_ns: I64, track: F64, window_ns: int) -> dict[int, F64]:
    """The track interpolated at each time between its two neighbours; where only one is within the window, that one.

    Returns stamp_ns to (4, 4) world_from_camera; times that the track does not cover are left out.
    """
    poses: dict[int, F64] = {}
    after = np.searchsorted(track_ns, stamps)
    for stamp, right in zip(stamps.tolist(), after.tolist(), strict=True):
        near = [k for k in (right - 1, right) if 0 <= k < len(track_ns) and abs(track_ns[k] - stamp) <= window_ns]
        if len(near) == 2:
            share = float(stamp - track_ns[near[0]]) / float(track_ns[near[1]] - track_ns[near[0]])
            turn = Slerp([0.0, 1.0], Rotation.from_quat(track[near, 3:]))(share)
            pose = np.eye(4)
            pose[:3, :3] = turn.as_matrix()
            pose[:3, 3] = (1 - share) * track[near[0], :3] + share * track[near[1], :3]
            poses[stamp] = pose
        elif near:
            poses[stamp] = pose_from_quaternion(track[near[0], :3], track[near[0], 3:])
    return poses


SOURCE = Tum
