"""Frames out of a recording (.rrd) that was made with every frame kept."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from placegraph.nodes.camera import FrameSource
from placegraph.runtime.arrays import F64
from placegraph.runtime.errors import ConfigError, SourceError
from placegraph.runtime.messages import Frame
from placegraph.runtime.recording import kinds_in, read


class RecordedFrames(FrameSource):
    """The recorded Frames, exact, with their ids and capture times."""

    summary: ClassVar[str] = "a recording FILE.rrd made with [nodes.recorder] frames = true"

    @staticmethod
    def matches(path: Path) -> bool:
        """Whether the path is a file that ends in .rrd; it is not opened."""
        return path.suffix == ".rrd" and path.is_file()

    def __init__(self, path: Path, settings: dict[str, Any]) -> None:
        """Raises ConfigError for any setting, SourceError without the file or Frames in it, SchemaError if damaged."""
        if settings:
            raise ConfigError(f"[nodes.camera] settings: a recording takes none, found {', '.join(sorted(settings))}")
        self._path = path
        counts = kinds_in(path)
        if not counts.get("Frame", 0):
            if counts.get("Keyframe", 0):
                raise SourceError(
                    f"{path}: holds keyframes only, not every frame: run it with `placegraph replay {path.name}`, "
                    "or record again with [nodes.recorder] frames = true"
                )
            raise SourceError(f"{path}: holds no Frame, only: {', '.join(counts) or 'nothing'}")

    def frames(self) -> Iterator[Frame]:
        """The frames in recorded order; raises SchemaError where the recording is damaged."""
        for message in read(self._path, (Frame,)):
            assert isinstance(message, Frame)
            yield message

    def given_poses(self) -> dict[int, F64] | None:
        """(4, 4) world_from_camera by capture time in ns, of the frames that carry one; None when no frame does."""
        poses = {
            frame.stamp_ns: frame.given_world_from_camera
            for frame in self.frames()
            if np.isfinite(frame.given_world_from_camera).all()
        }
        return poses or None


SOURCE = RecordedFrames
