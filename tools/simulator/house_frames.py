"""A whole house from its seed, and the frames that a camera sees on a walk through it."""

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

SENSOR_SALT = 7_001  # keeps the sensor's noise apart from what else is drawn from the seed
DEPTH_STEPS_PER_M = 5000  # the depth factor of TUM RGB-D folders; 16 bit reach to 13.1 m


class HouseFrame(NamedTuple):
    """One frame with its truth; depth is a whole number of steps of 1 / DEPTH_STEPS_PER_M metres, 0 = no reading."""

    frame_id: int
    stamp_ns: int
    color: U8  # (H, W, 3) sRGB
    depth_m: F32  # (H, W)
    instance: U16  # (H, W) item id + 1, 0 = the building
    world_from_camera: F64  # (4, 4)

    @property
    def depth_steps(self) -> U16:
        """(H, W) depth as the integers that a sensor gives."""
        return np.round(self.depth_m * DEPTH_STEPS_PER_M).astype(np.uint16)


def generate_house(seed: int, floors: int | None = None) -> House:
    """The furnished house of a seed, of so many floors (None: the seed chooses)."""
    return furnish(generate_floor_plan(seed, floors), seed)


def make_renderer(house: House, width: int, height: int) -> Any:
    """A render.Renderer; raises ConfigError that names the extra when the ray casting library is not installed.

    Loaded when it is asked for: the library is an extra, and truth can be read and scored without it.
    """
    return plugin("placegraph.tools.simulator", "render", "Renderer", "renderer")(house, width, height)


class HouseFrames:
    """The frames of one house along its walk; each is made by itself, so any may be made first, in any process.

    moved: so many pieces of furniture are moved after the walk, and the house is walked again, backwards: the second
    film begins on the floor where the first ended. `before` is the house of the first `frames_before` frames, `house`
    that of the others.
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
        """How many frames there are, at most `limit` (0: all)."""
        return min(limit or len(self.stamps_ns), len(self.stamps_ns))

    def frames(self, limit: int = 0) -> Iterator[HouseFrame]:
        """Frames in order of time, at most `limit` (0: all)."""
        return (self.frame(index) for index in range(self.count(limit)))

    def frame(self, index: int) -> HouseFrame:
        """The frame of that index."""
        pose = np.asarray(self.world_from_camera[index], np.float64)
        view = (self._renderer_before if index < self.frames_before else self._renderer).render(pose)
        # a generator of its own for each frame: no frame depends on those made before it
        random = np.random.default_rng([self.house.seed, SENSOR_SALT, index])
        color, depth_m = simulate_camera(view, self.intrinsics, random, self._sensor_settings)
        return HouseFrame(index, int(self.stamps_ns[index]), color, quantize_depth(depth_m), view.instance, pose)


def _then_reversed(first: CameraTrajectory, second: CameraTrajectory) -> CameraTrajectory:
    """The first walk, then the second one backwards, a frame's time later."""
    step_ns = int(first.stamps_ns[1] - first.stamps_ns[0])
    back_ns = first.stamps_ns[-1] + step_ns + (second.stamps_ns[-1] - second.stamps_ns[::-1])
    poses = np.concatenate((first.world_from_camera, second.world_from_camera[::-1]))
    return CameraTrajectory(np.concatenate((first.stamps_ns, back_ns)), poses)


def quantize_depth(depth_m: F32) -> F32:
    """(H, W) depth in metres, rounded to the steps of 16 bit; what does not fit or is not finite is no reading."""
    steps = np.round(np.asarray(depth_m, np.float64) * DEPTH_STEPS_PER_M)
    fits = np.isfinite(steps) & (steps > 0) & (steps <= np.iinfo(np.uint16).max)
    return (np.where(fits, steps, 0) / DEPTH_STEPS_PER_M).astype(np.float32)


@cache  # of the sources as they were when this process began
def generator_version() -> str:
    """A checksum of the generator's own sources: equal seeds give equal bytes while it stays the same."""
    folder, digest = Path(__file__).parent, hashlib.sha256()
    for file in sorted(folder.rglob("*.py"), key=lambda file: file.relative_to(folder).as_posix()):
        digest.update(file.relative_to(folder).as_posix().encode() + b"\0" + file.read_bytes() + b"\0")
    return digest.hexdigest()[:12]
