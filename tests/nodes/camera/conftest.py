"""Small data set folders written from arrays."""

from __future__ import annotations

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
