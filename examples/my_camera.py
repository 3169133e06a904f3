"""A camera of your own, complete: copy it to nodes/camera/ and put your device in place of `open_device`.

    [nodes.camera]
    source = "my_camera"
    settings = { width = 320 }

Add "my_camera" to DEVICES in nodes/camera/__init__.py if it imports a library that not everybody has: devices are never
tried when a path is given without a source. A reader of files does not belong there: it gets its path in `__init__`,
recognises it in `matches`, and has `live = False`.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from placegraph.nodes.camera import FrameSource
from placegraph.nodes.camera import _dataset_reader as reader
from placegraph.runtime.arrays import U8, U16
from placegraph.runtime.messages import Frame


class Settings(reader.SourceSettings):
    """`[nodes.camera.settings]`; unknown keys are refused."""

    width: int = 640
    height: int = 480


class MyCamera(FrameSource):
    """Frames of the camera until the run ends."""

    summary: ClassVar[str] = "no path: my camera (source = 'my_camera')"
    live: ClassVar[bool] = True  # old frames may be dropped when the computer is slow

    def __init__(self, path: Path, settings: dict[str, Any]) -> None:
        self._settings = reader.read_settings(Settings, settings)  # raises ConfigError naming the key

    def frames(self) -> Iterator[Frame]:
        """Frames as they come; raise SourceError when the device is absent or lost."""
        width, height = self._settings.width, self._settings.height
        focal_px = 0.9 * width
        for frame_id, (color, depth) in enumerate(open_device(width, height)):
            yield Frame(
                frame_id=frame_id,  # counted from 0
                stamp_ns=time.monotonic_ns(),  # of the exposure, on any clock that never goes back
                color=color,
                depth=depth,
                depth_unit_m=0.001,  # metres per step of depth
                intrinsics=np.array([focal_px, focal_px, width / 2, height / 2]),  # fx fy cx cy in px, float64
                given_world_from_camera=np.full((4, 4), np.nan),  # NaN: the source has no pose
                up_camera=np.full(3, np.nan),  # up in the camera frame (x right, y down, z forward); NaN: unknown
            )


def open_device(width: int, height: int) -> Iterator[tuple[U8, U16]]:
    """Stands for your driver: color (H, W, 3) uint8 sRGB and depth (H, W) uint16, 0 = no reading, aligned to color.

    Here a wall of random spots, two metres away.
    """
    spots = np.random.default_rng(0).integers(0, 255, (height // 8 + 1, width // 8 + 1, 3), np.uint8)
    color = spots.repeat(8, axis=0).repeat(8, axis=1)[:height, :width].copy()
    while True:
        yield color, np.full((height, width), 2000, np.uint16)
        time.sleep(0.1)


SOURCE = MyCamera
