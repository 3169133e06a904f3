"""A live OAK camera: colour, stereo depth aligned to it and the direction of gravity (the only depthai import).

Source: Luxonis' depthai 3 examples of depth alignment, names and signatures checked against depthai 3.12. Frames are
cropped and undistorted on the device, so each carries its own pinhole camera.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import timedelta
from pathlib import Path
from typing import Any, ClassVar

import cv2
import depthai as dai
import numpy as np
from pydantic import Field

from placegraph.nodes.camera import FrameSource
from placegraph.nodes.camera import _dataset_reader as reader
from placegraph.runtime.arrays import F64, U8, U16
from placegraph.runtime.errors import SourceError
from placegraph.runtime.messages import Frame

COLOR_SOCKET = dai.CameraBoardSocket.CAM_A
SILENCE_S = 5.0  # no frame for so long: the camera is lost
SYNC_S = 0.033  # colour and depth belong together within half a frame at 15 Hz
ACCELEROMETER_HZ = 100


class Settings(reader.SourceSettings):
    """Settings of an OAK camera."""

    device: str = ""  # id, name or address; "": the only one connected
    width: int = Field(640, ge=64)
    height: int = Field(480, ge=64)
    rate_hz: float = Field(15.0, gt=0)  # enough for walking pace, little enough for a small computer
    imu: bool = True  # the accelerometer gives which way is up; false for a camera without one
    gravity_time_s: float = Field(1.0, gt=0)  # time constant of the low pass on the accelerometer


class Oak(FrameSource):
    """Frames of one camera until it is lost or the run ends."""

    summary: ClassVar[str] = "no path: an OAK camera with stereo depth (source = 'oak')"
    live: ClassVar[bool] = True

    def __init__(self, path: Path, settings: dict[str, Any]) -> None:
        self._settings = reader.read_settings(Settings, settings)

    def frames(self) -> Iterator[Frame]:
        """Frames as they come. Raises SourceError when no camera is found, it cannot be opened, or it is lost."""
        info = find_device(self._settings.device)
        with _device_errors(info):
            yield from self._stream(info, dai.Device(info))

    def _stream(self, info: dai.DeviceInfo, device: dai.Device) -> Iterator[Frame]:
        with device, dai.Pipeline(device) as pipeline:
            device.setMaxReconnectionAttempts(0)
            pipeline.setStopOnDeviceLoss(True)
            camera_from_imu = _camera_from_imu(device, info) if self._settings.imu else None
            pairs, motion = build_pipeline(pipeline, self._settings, camera_from_imu is not None)
            gravity = Gravity(self._settings.gravity_time_s)
            pipeline.start()
            frame_id = 0
            while pipeline.isRunning():
                group: Any = pairs.get(timedelta(seconds=SILENCE_S))
                if group is None:
                    raise SourceError(f"OAK camera {info.deviceId}: no frame for {SILENCE_S:g} s")
                if motion is not None:
                    _read_motion(motion, gravity)
                up = reader.NO_UP if camera_from_imu is None else camera_from_imu @ gravity.up()
                yield read_group(group["rgb"], group["depth"], frame_id, up)
                frame_id += 1
            raise SourceError(f"OAK camera {info.deviceId}: lost (unplugged, or its pipeline stopped)")


@dataclass
class Gravity:
    """Low pass over accelerometer samples: at rest they point up, against gravity."""

    time_constant_s: float
    _mean: F64 | None = None
    _first_ns: int = 0
    _last_ns: int = 0

    def add(self, stamp_ns: int, acceleration: F64) -> None:
        """Take a sample (3,) in m/s2; one that is not finite or older than the last is left out."""
        if not np.isfinite(acceleration).all() or (self._mean is not None and stamp_ns <= self._last_ns):
            return
        if self._mean is None:
            self._mean, self._first_ns = acceleration.astype(float), stamp_ns
        else:
            elapsed_s = (stamp_ns - self._last_ns) * 1e-9
            self._mean += (1 - np.exp(-elapsed_s / self.time_constant_s)) * (acceleration - self._mean)
        self._last_ns = stamp_ns

    def up(self) -> F64:
        """Unit vector (3,) in the sensor's frame; NaN until half a time constant of samples is in."""
        if self._mean is None or (self._last_ns - self._first_ns) * 1e-9 < self.time_constant_s / 2:
            return reader.NO_UP
        length = float(np.linalg.norm(self._mean))
        return self._mean / length if length > 1.0 else reader.NO_UP  # free fall: no direction


def find_device(identifier: str) -> dai.DeviceInfo:
    """The connected camera of that id, name or address, or the only one; raises SourceError.

    Asking first takes half a second; opening without asking waits ten before it says that there is none.
    """
    devices = sorted(dai.Device.getAllAvailableDevices(), key=lambda info: str(info.deviceId))
    listing = ", ".join(f"{info.deviceId} ({info.name})" for info in devices)
    if not devices:
        raise SourceError("no OAK camera found: check the cable, the power and (USB on Linux) the udev rules")
    if not identifier and len(devices) > 1:
        raise SourceError(f"several OAK cameras: set device in [nodes.camera.settings] to one of: {listing}")
    for info in devices:
        if not identifier or identifier in (info.deviceId, info.name):
            return info
    raise SourceError(f"no OAK camera {identifier!r}; there are: {listing}")


def build_pipeline(
    pipeline: dai.Pipeline, settings: Settings, imu: bool
) -> tuple[dai.MessageQueue, dai.MessageQueue | None]:
    """Wire the device: queues of colour and depth pairs, and of accelerometer samples where there is an IMU."""
    camera = pipeline.create(dai.node.Camera).build(COLOR_SOCKET)
    color = camera.requestOutput(
        (settings.width, settings.height),
        dai.ImgFrame.Type.RGB888i,
        resizeMode=dai.ImgResizeMode.CROP,
        fps=settings.rate_hz,
        enableUndistortion=True,
    )
    depth = pipeline.create(dai.node.Depth).build(dai.node.Depth.Algorithm.STEREO, fps=settings.rate_hz)
    depth.setAlignTo(color)  # before the output is asked for
    sync = pipeline.create(dai.node.Sync)
    sync.setSyncThreshold(timedelta(seconds=SYNC_S))
    color.link(sync.inputs["rgb"])
    depth.depth.link(sync.inputs["depth"])
    pairs = sync.out.createOutputQueue(maxSize=2, blocking=False)
    if not imu:
        return pairs, None
    sensor = pipeline.create(dai.node.IMU)
    sensor.enableIMUSensor(dai.IMUSensor.ACCELEROMETER_RAW, ACCELEROMETER_HZ)
    sensor.setBatchReportThreshold(1)
    sensor.setMaxBatchReports(10)
    return pairs, sensor.out.createOutputQueue(maxSize=50, blocking=False)


def read_group(rgb: dai.ImgFrame, depth: dai.ImgFrame, frame_id: int, up_camera: F64) -> Frame:
    """A synchronised pair of device frames as a Frame; raises SourceError when they do not fit each other."""
    color = np.asarray(cv2.cvtColor(rgb.getCvFrame(), cv2.COLOR_BGR2RGB), np.uint8)
    transformation: Any = rgb.getTransformation()  # its stub has no types
    matrix = np.array(transformation.getIntrinsicMatrix(), np.float64)
    return to_frame(color, depth.getFrame(), matrix, nanoseconds(rgb.getTimestamp()), frame_id, up_camera)


def to_frame(color: U8, depth: U16, matrix: F64, stamp_ns: int, frame_id: int, up_camera: F64) -> Frame:
    """Arrays to a Frame. color (H, W, 3) sRGB, depth (H, W) in mm, matrix (3, 3) in px, up_camera (3,).

    Raises SourceError when depth is not 16 bit or not of the colour image's size, or the matrix is no camera.
    """
    if depth.dtype != np.uint16 or depth.shape != color.shape[:2]:
        raise SourceError(
            f"OAK camera, frame {frame_id}: depth is {depth.dtype} {depth.shape}, expected uint16 {color.shape[:2]}"
        )
    where = f"OAK camera, frame {frame_id}: intrinsics"
    intrinsics = reader.check_intrinsics(np.array([matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2]]), where)
    reader.check_center(intrinsics, depth.shape, where)
    return Frame(
        frame_id=frame_id,
        stamp_ns=stamp_ns,
        color=color,
        depth=depth,
        depth_unit_m=0.001,
        intrinsics=intrinsics,
        given_world_from_camera=reader.NO_POSE,
        up_camera=np.asarray(up_camera, float),
    )


def nanoseconds(stamp: timedelta) -> int:
    """A device time in whole ns (float seconds would lose them after some months)."""
    return ((stamp.days * 86_400 + stamp.seconds) * 1_000_000 + stamp.microseconds) * 1000


def _read_motion(motion: dai.MessageQueue, gravity: Gravity) -> None:
    batches: list[Any] = motion.tryGetAll()
    for batch in batches:
        for packet in batch.packets:
            report = packet.acceleroMeter
            gravity.add(nanoseconds(report.getTimestamp()), np.array([report.x, report.y, report.z]))


def _camera_from_imu(device: dai.Device, info: dai.DeviceInfo) -> F64:
    """Rotation (3, 3) from the IMU's to the colour camera's frame; raises SourceError for a camera without IMU."""
    if device.getConnectedIMU() in ("", "NONE"):
        raise SourceError(f"OAK camera {info.deviceId}: has no IMU; set imu = false in [nodes.camera.settings]")
    matrix = np.array(device.readCalibration().getImuToCameraExtrinsics(COLOR_SOCKET), float)
    return np.asarray(matrix[:3, :3])


@contextmanager
def _device_errors(info: dai.DeviceInfo) -> Iterator[None]:
    """What depthai raises when a device cannot be opened, is lost, or its queues close, as SourceError."""
    try:
        yield
    except (RuntimeError, dai.MessageQueue.QueueException) as error:
        raise SourceError(f"OAK camera {info.deviceId} ({info.name}): {error}") from error


SOURCE = Oak
