"""Small data set folders written from arrays."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

HEIGHT, WIDTH = 12, 16


def color_image(number: int) -> np.ndarray:
    image = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
    image[..., 0], image[..., 1], image[..., 2] = 200, 100, 10 + number
    return image


def depth_image(number: int) -> np.ndarray:
    image = np.full((HEIGHT, WIDTH), 1500 + number, np.uint16)
    image[0, 0], image[0, 1] = 0, 65535
    return image


def pose_matrix(number: int) -> np.ndarray:
    """Camera at (number, 0, 1.5) that looks along +x of a world with z up."""
    pose = np.eye(4)
    pose[:3, :3] = np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0]], float)
    pose[:3, 3] = (number, 0, 1.5)
    return pose


def write_image(path: Path, image: np.ndarray) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    assert cv2.imwrite(str(path), image[..., ::-1] if image.ndim == 3 else image)


@pytest.fixture
def seven(tmp_path: Path) -> Path:
    """Three frames, numbers 0, 1 and 4."""
    folder = tmp_path / "kitchen"
    for number in (0, 1, 4):
        write_image(folder / f"frame-{number:06d}.color.png", color_image(number))
        write_image(folder / f"frame-{number:06d}.depth.png", depth_image(number))
        np.savetxt(folder / f"frame-{number:06d}.pose.txt", pose_matrix(number))
    np.savetxt(folder / "camera-intrinsics.txt", np.array([[14.0, 0, 8.5], [0, 13.0, 6.5], [0, 0, 1]]))
    return folder


@pytest.fixture
def tum(tmp_path: Path) -> Path:
    """Three frames at 10 Hz; depth 4 ms late; the track at 100 Hz, moving 1 m a frame along x."""
    folder = tmp_path / "rgbd_dataset_freiburg3_small"
    start = 1341841278.8
    colors, depths = ["# colour"], []
    for number in range(3):
        # the fr3 camera's principal point must lie inside the image
        write_image(folder / f"rgb/{number}.png", np.full((480, 640, 3), (200, 100, 10 + number), np.uint8))
        write_image(folder / f"depth/{number}.png", np.full((480, 640), 5000 * (number + 1), np.uint16))
        colors.append(f"{start + 0.1 * number:.4f} rgb/{number}.png")
        depths.append(f"{start + 0.1 * number + 0.004:.4f} depth/{number}.png")
    (folder / "rgb.txt").write_text("\n".join(colors))
    (folder / "depth.txt").write_text("\n".join(depths))
    # x y z w of pose_matrix's rotation
    track = [f"{start + 0.005 + 0.01 * k:.4f} {0.1 * k + 0.05:.4f} 0 1.5 -0.5 0.5 -0.5 0.5" for k in range(-2, 25)]
    (folder / "groundtruth.txt").write_text("# track\n" + "\n".join(track))
    return folder


@pytest.fixture
def scannet(tmp_path: Path) -> Path:
    """Frames 0, 5 and 10 (SensReader's frame_skip); colour twice as large as depth; frame 5 lost its pose."""
    folder = tmp_path / "scene0000_00"
    wide = np.repeat(np.repeat(color_image(0), 2, axis=0), 2, axis=1)
    for number in (0, 5, 10):
        write_image(folder / f"color/{number}.jpg", wide)
        write_image(folder / f"depth/{number}.png", depth_image(number))
        pose = np.full((4, 4), -np.inf) if number == 5 else pose_matrix(number)
        (folder / "pose").mkdir(exist_ok=True)
        np.savetxt(folder / f"pose/{number}.txt", pose, fmt="%f")
    (folder / "intrinsic").mkdir()
    for name, (f, cx, cy) in {"color": (28.0, 16.5, 12.5), "depth": (14.0, 8.0, 6.0)}.items():
        matrix = np.array([[f, 0, cx, 0], [0, f, cy, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
        np.savetxt(folder / f"intrinsic/intrinsic_{name}.txt", matrix, fmt="%f")
        np.savetxt(folder / f"intrinsic/extrinsic_{name}.txt", np.eye(4), fmt="%f")
    return folder


@pytest.fixture
def replica(tmp_path: Path) -> Path:
    """Three frames of a scene, the camera's file beside the scene."""
    folder = tmp_path / "Replica" / "room0"
    for number in range(3):
        write_image(folder / f"results/frame{number:06d}.jpg", color_image(number))
        write_image(folder / f"results/depth{number:06d}.png", depth_image(number))
    np.savetxt(folder / "traj.txt", [pose_matrix(number).ravel() for number in range(3)])
    camera = {"w": WIDTH, "h": HEIGHT, "fx": 14.0, "fy": 14.0, "cx": 7.5, "cy": 5.5, "scale": 6553.5}
    (folder.parent / "cam_params.json").write_text(json.dumps({"camera": camera}))
    return folder


@pytest.fixture
def hm3dsem(tmp_path: Path) -> Path:
    """Three frames of a walk: 1.5 m above the origin of a world with y up, looking along -z, a step back each frame."""
    folder = tmp_path / "00824-Dd4bFSTQ8gi"
    for number in range(3):
        name = f"Dd4bFSTQ8gi_{number:06d}"
        write_image(folder / f"rgb/{name}.png", color_image(number))
        write_image(folder / f"depth/{name}.png", depth_image(number))
        pose = np.eye(4)
        pose[:3, 3] = (0, 1.5, 0.2 * number)
        (folder / "pose").mkdir(exist_ok=True)
        (folder / f"pose/{name}.txt").write_text("\t".join(str(value) for value in pose.ravel()) + "\n")
    (folder / "semantic").mkdir()
    return folder
