"""A complete house from its seed, and the frames of a camera on a trajectory through it."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from placegraph.runtime.arrays import F32, F64, U8, U16
from placegraph.runtime.node import plugin
from placegraph.tools.simulator.camera_sensor import sensor_settings, simulate_camera
from placegraph.tools.simulator.camera_trajectory import CameraTrajectory, camera_trajectory
from placegraph.tools.simulator.floor_plan import generate_floor_plan
from placegraph.tools.simulator.furniture_rearrangement import rearrange
from placegraph.tools.simulator.house_model import House
from placegraph.tools.simulator.room_furnishing import furnish

SENSOR_SALT = 7_001  # a random stream of its own
DEPTH_STEPS_PER_M = 5000  # the depth factor of TUM RGB-D folders; 16 bit reach to 13.1 m


class HouseFrame(NamedTuple):
    """One frame with its ground truth; depth is in whole steps of 1 / DEPTH_STEPS_PER_M metres, 0 = no reading."""

    frame_id: int
    stamp_ns: int
    color: U8  # (H, W, 3) sRGB
    depth_m: F32  # (H, W)
    instance: U16  # (H, W) item id + 1, 0 = the building
    world_from_camera: F64  # (4, 4)

    @property
    def depth_steps(self) -> U16:
        """(H, W) depth in integer steps, as a sensor gives it."""
        return np.round(self.depth_m * DEPTH_STEPS_PER_M).astype(np.uint16)


def generate_house(seed: int, floors: int | None = None) -> House:
    """The furnished house of a seed with `floors` floors (None: the seed chooses)."""
    return furnish(generate_floor_plan(seed, floors), seed)


def make_renderer(house: House, width: int, height: int) -> Any:
    """A render.Renderer. Raises ConfigError naming the extra when the ray casting library is missing.

    Imported lazily: the library is an extra, and ground truth can be read and scored without it.
    """
    return plugin("placegraph.tools.simulator", "render", "Renderer", "renderer")(house, width, height)


class HouseFrames:
    """The frames of one house along its trajectory. Frames are independent: any may be rendered first, in any process.

    moved: this many pieces of furniture are moved after the first trajectory, and the house is filmed again backwards
    from the floor where the first film ended. `before` is the house of the first `frames_before` frames, `house` of the
    others.
    """

    def __init__(
        self, seed: int, floors: int | None = None, width: int = 640, height: int = 480, moved: int = 0
    ) -> None:
        self.before = generate_house(seed, floors)
        self.house = rearrange(self.before, moved, seed) if moved else self.before
        first = camera_trajectory(self.before, seed)
        self.frames_before = len(first.stamps_ns)
        self.stamps_ns, self.world_from_camera = (
            _then_reversed(first, camera_trajectory(self.house, seed)) if moved else first
        )
        self._sensor_settings = sensor_settings(seed)
        self._renderer = make_renderer(self.house, width, height)
        self._renderer_before = make_renderer(self.before, width, height) if moved else self._renderer
        self.intrinsics: F64 = np.asarray(self._renderer.intrinsics, np.float64)  # (4,) fx fy cx cy in px

    def count(self, limit: int = 0) -> int:
        """The number of frames, at most `limit` (0: all)."""
        return min(limit or len(self.stamps_ns), len(self.stamps_ns))

    def frames(self, limit: int = 0) -> Iterator[HouseFrame]:
        """Frames in order of time, at most `limit` (0: all)."""
        return (self.frame(index) for index in range(self.count(limit)))

    def frame(self, index: int) -> HouseFrame:
        """The frame of an index."""
        pose = np.asarray(self.world_from_camera[index], np.float64)
        view = (self._renderer_before if index < self.frames_before else self._renderer).render(pose)
        # one generator per frame, so that frames are independent
        random = np.random.default_rng([self.house.seed, SENSOR_SALT, index])
        color, depth_m = simulate_camera(view, self.intrinsics, random, self._sensor_settings)
        return HouseFrame(index, int(self.stamps_ns[index]), color, quantize_depth(depth_m), view.instance, pose)


def _then_reversed(first: CameraTrajectory, second: CameraTrajectory) -> CameraTrajectory:
    """The first trajectory, then the second one backwards, one frame later."""
    step_ns = int(first.stamps_ns[1] - first.stamps_ns[0])
    back_ns = first.stamps_ns[-1] + step_ns + (second.stamps_ns[-1] - second.stamps_ns[::-1])
    poses = np.concatenate((first.world_from_camera, second.world_from_camera[::-1]))
    return CameraTrajectory(np.concatenate((first.stamps_ns, back_ns)), poses)


def quantize_depth(depth_m: F32) -> F32:
    """(H, W) depth in metres rounded to 16 bit steps; values that do not fit or are not finite become 0."""
    steps = np.round(np.asarray(depth_m, np.float64) * DEPTH_STEPS_PER_M)
    fits = np.isfinite(steps) & (steps > 0) & (steps <= np.iinfo(np.uint16).max)
    return (np.where(fits, steps, 0) / DEPTH_STEPS_PER_M).astype(np.float32)


@cache  # cached: the sources as they were at the first call
def generator_version() -> str:
    """A checksum of the simulator's sources: equal seeds give equal bytes while it is unchanged."""
    folder, digest = Path(__file__).parent, hashlib.sha256()
    files = (file for file in folder.rglob("*.*") if file.suffix in (".py", ".toml"))
    for file in sorted(files, key=lambda file: file.relative_to(folder).as_posix()):
        digest.update(file.relative_to(folder).as_posix().encode() + b"\0" + file.read_bytes() + b"\0")
    return digest.hexdigest()[:12]
