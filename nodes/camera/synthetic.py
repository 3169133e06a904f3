"""A whole house made by code, rendered along a walk through it, frame by frame: nothing is read from disk.

Equal settings give equal bytes. `placegraph house` writes the same frames, with their truth, as a folder.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from pydantic import Field

from placegraph.nodes.camera import FrameSource
from placegraph.nodes.camera._dataset_reader import SourceSettings, read_settings
from placegraph.runtime.arrays import F64
from placegraph.runtime.messages import Frame
from placegraph.runtime.node import plugin

DEPTH_UNIT_M = 1 / 5000  # as in the folders that `placegraph house` writes


class Settings(SourceSettings):
    """Settings of the house."""

    seed: int = Field(0, ge=0)
    floors: int | None = Field(None, ge=1, le=3)  # the seed chooses
    width: int = Field(640, ge=64, le=4096)
    height: int = Field(480, ge=48, le=4096)


class Synthetic(FrameSource):
    """Frames of the house."""

    summary: ClassVar[str] = "no path: a house made and rendered by code (source = 'synthetic')"

    def __init__(self, path: Path, settings: dict[str, Any]) -> None:
        self.settings = read_settings(Settings, settings)
        # By name, as a plug-in: the generator is a tool, which a node must not import, and it needs libraries (ray
        # casting) that no other node needs. Loaded here so that a missing one is reported before the run starts.
        plugin("placegraph.tools.simulator", "render", "Renderer", "house generator")
        self._generator = plugin("placegraph.tools.simulator", "house_frames", "HouseFrames", "house generator")

    def frames(self) -> Iterator[Frame]:
        """Frames along the walk."""
        for view in self._house.frames():
            pose = view.world_from_camera
            yield Frame(
                frame_id=view.frame_id,
                stamp_ns=view.stamp_ns,
                color=view.color,
                depth=np.round(view.depth_m / DEPTH_UNIT_M).astype(np.uint16),
                depth_unit_m=DEPTH_UNIT_M,
                intrinsics=self._house.intrinsics.copy(),
                given_world_from_camera=pose.copy(),
                up_camera=pose[2, :3].copy(),  # transpose of the rotation, times z
            )

    def given_poses(self) -> dict[int, F64]:
        """stamp_ns to (4, 4) world_from_camera in metres."""
        stamps = np.asarray(self._house.stamps_ns).tolist()
        return dict(zip(stamps, np.asarray(self._house.world_from_camera, np.float64), strict=True))

    @cached_property
    def _house(self) -> Any:
        # takes seconds, so not when the dataflow is only checked
        return self._generator(self.settings.seed, self.settings.floors, self.settings.width, self.settings.height)


SOURCE = Synthetic
