from __future__ import annotations

import time
import warnings
from datetime import timedelta
from pathlib import Path

import numpy as np
import pytest

with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # of the binding itself, at import
    dai = pytest.importorskip("depthai", reason="the extra `oak` is not installed")

from placegraph.nodes.camera import oak
from placegraph.runtime.errors import ConfigError, SourceError

MATRIX = np.array([[500.0, 0, 319.5], [0, 501.0, 239.5], [0, 0, 1]])
UP = np.array([0.0, -1.0, 0.0])


class Info:
    def __init__(self, device_id: str, name: str) -> None:
        self.deviceId, self.name = device_id, name


def connect(monkeypatch: pytest.MonkeyPatch, *found: Info) -> None:
    monkeypatch.setattr(oak.dai.Device, "getAllAvailableDevices", staticmethod(lambda: list(found)))


def test_no_camera_is_said_at_once(monkeypatch: pytest.MonkeyPatch):
    connect(monkeypatch)
    with pytest.raises(SourceError, match="no OAK camera found"):
        next(oak.SOURCE(Path(), {}).frames())


@pytest.mark.device  # asks the buses and the network for cameras
def test_no_camera_is_found_out_in_two_seconds():
    if dai.Device.getAllAvailableDevices():
        pytest.skip("an OAK camera is connected")
    start = time.monotonic()
    with pytest.raises(SourceError, match="no OAK camera found"):
        next(oak.SOURCE(Path(), {}).frames())
    assert time.monotonic() - start < 2.0


def test_one_of_several_must_be_named(monkeypatch: pytest.MonkeyPatch):
    connect(monkeypatch, Info("B2", "1.2"), Info("A1", "1.1"))
    with pytest.raises(SourceError, match=r"several OAK cameras: .* A1 \(1\.1\), B2 \(1\.2\)"):
        oak.find_device("")
    assert oak.find_device("B2").name == "1.2"
    assert oak.find_device("1.1").deviceId == "A1"
    with pytest.raises(SourceError, match=r"no OAK camera 'C3'; there are: A1"):
        oak.find_device("C3")


def test_a_camera_that_cannot_be_opened_is_a_source_error():
    info = dai.DeviceInfo("127.0.0.1")
    with pytest.raises(SourceError, match=r"OAK camera .*\(127\.0\.0\.1\): refused"), oak._device_errors(info):
        raise RuntimeError("refused")


def test_a_closed_queue_is_a_source_error():
    with dai.Pipeline(False) as pipeline:
        group = pipeline.create(dai.node.Sync)
        group.setRunOnHost(True)
        queue = group.out.createOutputQueue()
        queue.close()
        with pytest.raises(SourceError, match="OAK camera"), oak._device_errors(dai.DeviceInfo("x")):
            queue.get(timedelta(seconds=1))


def test_settings_and_matches(tmp_path: Path):
    with pytest.raises(ConfigError, match="width"):
        oak.SOURCE(Path(), {"width": 0})
    assert oak.SOURCE.live
    assert not oak.SOURCE.matches(tmp_path)
    assert oak.SOURCE(Path(), {}).given_poses() is None


def test_frame_of_arrays():
    color = np.zeros((480, 640, 3), np.uint8)
    frame = oak.to_frame(color, np.full((480, 640), 1234, np.uint16), MATRIX, 77, 5, UP)
    frame.check()
    assert (frame.frame_id, frame.stamp_ns, frame.depth_unit_m) == (5, 77, 0.001)
    assert frame.intrinsics.tolist() == [500.0, 501.0, 319.5, 239.5]
    assert frame.up_camera.tolist() == [0, -1, 0]
    assert np.isnan(frame.given_world_from_camera).all()


@pytest.mark.parametrize(
    "depth", [np.zeros((400, 640), np.uint16), np.zeros((480, 640), np.float32), np.zeros((480, 640, 1), np.uint16)]
)
def test_depth_that_does_not_fit_is_refused(depth: np.ndarray):
    with pytest.raises(SourceError, match="frame 5: depth is"):
        oak.to_frame(np.zeros((480, 640, 3), np.uint8), depth, MATRIX, 77, 5, UP)


@pytest.mark.parametrize("matrix", [np.eye(3) * 0, np.full((3, 3), np.nan), np.diag([500.0, 500.0, 1.0])])
def test_a_matrix_that_is_no_camera_is_refused(matrix: np.ndarray):
    with pytest.raises(SourceError, match="frame 5: intrinsics"):
        oak.to_frame(np.zeros((4, 6, 3), np.uint8), np.zeros((4, 6), np.uint16), matrix, 77, 5, UP)


def test_device_frames_become_rgb_millimetres_and_their_own_camera():
    pixels = np.zeros((6, 8, 3), np.uint8)
    pixels[..., 0], pixels[..., 2] = 200, 10
    rgb = dai.ImgFrame()
    rgb.setType(dai.ImgFrame.Type.RGB888i)
    rgb.setWidth(8)
    rgb.setHeight(6)
    rgb.setData(pixels.ravel())
    rgb.setTimestamp(timedelta(seconds=12, microseconds=345678))
    rgb.setTransformation(dai.ImgTransformation(8, 6, [[9.0, 0, 4], [0, 9.0, 3], [0, 0, 1]]))
    depth = dai.ImgFrame()
    depth.setType(dai.ImgFrame.Type.RAW16)
    depth.setWidth(8)
    depth.setHeight(6)
    depth.setData(np.arange(48, dtype=np.uint16).view(np.uint8))
    frame = oak.read_group(rgb, depth, 0, UP)
    frame.check()
    assert frame.color[2, 3].tolist() == [200, 0, 10]
    assert frame.depth[5, 7] == 47
    assert frame.stamp_ns == 12_345_678_000
    assert frame.intrinsics.tolist() == [9.0, 9.0, 4.0, 3.0]


def test_nanoseconds_are_exact_after_a_year():
    assert oak.nanoseconds(timedelta(days=365, microseconds=1)) == 365 * 86_400 * 10**9 + 1000


def test_gravity_needs_time_and_ignores_what_is_not_finite():
    gravity = oak.Gravity(1.0)
    assert np.isnan(gravity.up()).all()
    gravity.add(0, np.array([np.nan, 0, 0]))
    gravity.add(10, np.array([0, -9.8, 0]))
    assert np.isnan(gravity.up()).all()
    gravity.add(600_000_010, np.array([0, -9.8, 0]))
    assert gravity.up() == pytest.approx([0, -1, 0])


def test_gravity_averages_shaking_away():
    gravity = oak.Gravity(1.0)
    random = np.random.default_rng(0)
    for k in range(500):
        gravity.add(k * 10_000_000, np.array([0, -9.8, 0]) + random.normal(0, 2.0, 3))
    error_rad = np.arccos(np.clip(gravity.up() @ [0, -1, 0], -1, 1))
    assert np.rad2deg(error_rad) < 3.0


def test_gravity_follows_a_turned_camera():
    gravity = oak.Gravity(0.5)
    for k in range(200):
        gravity.add(k * 10_000_000, np.array([0, -9.8, 0]))
    for k in range(200, 700):
        gravity.add(k * 10_000_000, np.array([9.8, 0, 0]))
    assert gravity.up() == pytest.approx([1, 0, 0], abs=1e-3)


def test_free_fall_has_no_direction():
    gravity = oak.Gravity(0.1)
    gravity.add(0, np.zeros(3))
    gravity.add(10**9, np.zeros(3))
    assert np.isnan(gravity.up()).all()


@pytest.mark.device
def test_a_real_camera_gives_plausible_frames():
    if not dai.Device.getAllAvailableDevices():
        pytest.skip("no OAK camera is connected")
    stream = oak.SOURCE(Path(), {}).frames()
    frames = [next(stream) for _ in range(30)]
    stream.close()
    stamps = [frame.stamp_ns for frame in frames]
    assert stamps == sorted(set(stamps))
    assert (frames[-1].depth > 0).mean() > 0.2
    assert np.linalg.norm(frames[-1].up_camera) == pytest.approx(1.0)
