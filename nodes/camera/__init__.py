"""Node `camera`: frames from a device or a data set, then End.

Each module of this folder reads one format or device and exports its class as SOURCE; it is found by its file name.
"""

from __future__ import annotations

import time
from collections.abc import Generator, Iterator
from pathlib import Path
from typing import Any, ClassVar

from pydantic import Field

from placegraph.runtime.arrays import F64
from placegraph.runtime.errors import ConfigError, SourceError
from placegraph.runtime.messages import End, Frame, Message
from placegraph.runtime.node import Context, NodeConfig, Source, available, plugin

# Devices are named, never guessed from a path: their libraries are optional and slow to import.
DEVICES = ("oak",)


class FrameSource:
    """Base of what a module exports as SOURCE: a class that reads one format or device."""

    summary: ClassVar[str]  # what the folder, file or device must look like
    live: ClassVar[bool] = False  # frames come at their own pace and may be lost

    def __init__(self, path: Path, settings: dict[str, Any]) -> None:
        """Check path and settings. Raises SourceError, ConfigError."""

    @staticmethod
    def matches(path: Path) -> bool:
        """Whether the path looks like this format; cheap, never raises. A source without a path matches none."""
        return False

    def frames(self) -> Iterator[Frame]:
        """Frames in order of time, ids counted from 0. Raises SourceError naming the file and what is wrong."""
        raise NotImplementedError

    def given_poses(self) -> dict[int, F64] | None:
        """stamp_ns to (4, 4) world_from_camera in metres, for evaluation; None when the source has none."""
        return None


class CameraConfig(NodeConfig):
    """Where frames come from."""

    source: str = "auto"  # a module of nodes/camera, or auto: the one whose format the path has
    path: str = ""
    realtime: bool = False  # play a data set as if it were live: frames come at their own pace and may be lost
    limit: int = Field(0, ge=0)  # stop after so many frames; 0 = all
    settings: dict[str, Any] = Field(default_factory=dict)  # the source's own, documented in its module


class CameraNode(Source):
    """Gives every frame of one source, in order, and then End."""

    config_type = CameraConfig
    outputs = (Frame, End)

    def __init__(self, config: CameraConfig, context: Context) -> None:
        super().__init__(config, context)
        path = Path(config.path)
        kind = detect_source(config.path) if config.source == "auto" else find_source(config.source)
        self.source: FrameSource = kind(path, dict(config.settings))
        self._clock_from_stamp_ns: int | None = None

    def is_lossless(self) -> bool:
        """Whether every frame must arrive (data sets, recordings); of a device's frames, old ones may be dropped."""
        return not (self.source.live or self.config.realtime)

    def _pace(self, stamp_ns: int) -> None:
        """Wait until a frame is due: its capture time after the first frame's, on this machine's clock."""
        now_ns = time.monotonic_ns()
        if self._clock_from_stamp_ns is None:
            self._clock_from_stamp_ns = now_ns - stamp_ns
        time.sleep(max(0, stamp_ns + self._clock_from_stamp_ns - now_ns) / 1e9)

    def given_poses(self) -> dict[int, F64] | None:
        """stamp_ns to (4, 4) world_from_camera of the data set; None when it has none."""
        return self.source.given_poses()

    def messages(self) -> Iterator[Message]:
        """Frames, then one End. Raises SourceError when the source gives no frame at all."""
        last_id, last_stamp, count = -1, 0, 0
        frames = self.source.frames()
        try:
            for frame in frames:
                if self.config.realtime:
                    self._pace(frame.stamp_ns)
                yield frame
                last_id, last_stamp, count = frame.frame_id, frame.stamp_ns, count + 1
                if self.ending or count == self.config.limit:
                    break
        finally:
            if isinstance(frames, Generator):
                frames.close()  # releases a device now, not when the garbage is collected
        if count == 0:
            raise SourceError(f"{self.config.path or self.config.source}: the source gave no frame")
        yield End(frame_id=last_id, stamp_ns=last_stamp, frames=count)


def find_source(name: str) -> type[FrameSource]:
    """The SOURCE of a module of this folder; raises ConfigError naming the choices when there is none."""
    source: type[FrameSource] = plugin(__name__, name, "SOURCE", "camera source")
    return source


def detect_source(path: str) -> type[FrameSource]:
    """The one source whose format a path has.

    Raises ConfigError when the path is empty or more than one format fits, SourceError when it is absent or none fits.
    """
    names = [name for name in available(__name__) if name not in DEVICES]
    if not path:
        raise ConfigError(f"[nodes.camera] path is empty: give a path, or a source: {', '.join([*names, *DEVICES])}")
    if not Path(path).exists():
        raise SourceError(f"{path}: no such file or folder")
    sources = {name: find_source(name) for name in names}
    fits = [name for name, source in sources.items() if source.matches(Path(path))]
    if len(fits) > 1:
        raise ConfigError(f"{path}: fits more than one format; set source to one of: {', '.join(fits)}")
    if not fits:
        formats = "".join(f"\n  {name}: {source.summary}" for name, source in sources.items())
        raise SourceError(f"{path}: no known format; looked for:{formats}")
    return sources[fits[0]]


NODE = CameraNode
