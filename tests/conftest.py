import logging
from collections.abc import Callable, Iterator

import numpy as np
import psutil
import pytest

from placegraph.runtime.vision.geometry import transform

INTRINSICS = np.array([260.0, 260.0, 160.0, 120.0])
SHAPE = (240, 320)


@pytest.fixture(autouse=True)
def logging_as_before() -> Iterator[None]:
    """The command configures logging for its process; in-process tests must not leave that to the next one."""
    root = logging.getLogger()
    handlers, level = root.handlers[:], root.level
    yield
    root.handlers[:], root.level = handlers, level


@pytest.fixture(autouse=True)
def no_process_is_left() -> Iterator[None]:
    """Whatever a test started has ended when it has, also when it failed."""
    before = set(psutil.Process().children(recursive=True))
    yield
    left = [process for process in psutil.Process().children(recursive=True) if process not in before]
    for process in left:
        process.kill()
    psutil.wait_procs(left, timeout=5)
    assert left == []


def _texture(xyz: np.ndarray) -> np.ndarray:
    """A painted pattern fixed in the world: sines of many periods, different on each wall."""
    random = np.random.default_rng(5)
    value = np.zeros(len(xyz))
    for _ in range(40):
        value += np.sin(xyz @ random.normal(0, 12, 3) + random.uniform(0, 6))
    return np.clip(128 + 22 * value, 0, 255)


def _ray_cast(origin: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Distance along each ray to the walls of a room 4 x 5 x 2.6 m around the world's origin, its floor at z = 0."""
    low, high = np.array([-2.0, -2.5, 0.0]), np.array([2.0, 2.5, 2.6])
    with np.errstate(divide="ignore"):
        far = np.where(directions > 0, (high - origin) / directions, (low - origin) / directions)
    return np.where(directions == 0, np.inf, far).min(axis=1)


@pytest.fixture(scope="session")
def room_view() -> Callable[[np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """world_from_camera to (gray (H, W) uint8, depth (H, W) m, intrinsics) in a painted room."""

    def view(world_from_camera: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        v, u = np.mgrid[: SHAPE[0], : SHAPE[1]]
        fx, fy, cx, cy = INTRINSICS
        rays = np.stack(((u - cx) / fx, (v - cy) / fy, np.ones(SHAPE)), axis=-1).reshape(-1, 3)
        along = _ray_cast(world_from_camera[:3, 3], rays @ world_from_camera[:3, :3].T)
        xyz = transform(world_from_camera, rays * along[:, None])
        gray = _texture(xyz).reshape(SHAPE).astype(np.uint8)
        return gray, along.reshape(SHAPE).astype(np.float32), INTRINSICS

    return view


@pytest.fixture(scope="session")
def standing() -> Callable[..., np.ndarray]:
    """(x, y, heading in rad, height) to the world_from_camera of a level camera."""

    def pose(x: float, y: float, heading: float, height: float = 1.3) -> np.ndarray:
        c, s = np.cos(heading), np.sin(heading)
        made = np.eye(4)
        made[:3, :3] = np.array([[s, 0, c], [-c, 0, s], [0, -1, 0]])
        made[:3, 3] = x, y, height
        return made

    return pose
