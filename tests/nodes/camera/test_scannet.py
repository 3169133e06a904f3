from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from placegraph.nodes.camera.scannet import SOURCE, reproject_color
from placegraph.runtime.errors import ConfigError, SourceError


def write_matrix(path: Path, f: float, cx: float, cy: float) -> None:
    np.savetxt(path, np.array([[f, 0, cx, 0], [0, f, cy, 0], [0, 0, 1, 0], [0, 0, 0, 1]]), fmt="%f")


def test_absent_and_empty_folders(tmp_path: Path):
    with pytest.raises(SourceError, match="nowhere: no such folder"):
        SOURCE(tmp_path / "nowhere", {})
    with pytest.raises(SourceError, match="color: cannot be read: No such file"):
        SOURCE(tmp_path, {})
    assert not SOURCE.matches(tmp_path)
    for name in ("color", "depth", "pose"):
        (tmp_path / name).mkdir()
    assert SOURCE.matches(tmp_path)
    with pytest.raises(SourceError, match=r"color: no N\.jpg"):
        SOURCE(tmp_path, {})


def test_frames_carry_what_the_files_say(scannet: Path):
    source = SOURCE(scannet, {})
    frames = list(source.frames())
    assert [frame.frame_id for frame in frames] == [0, 1, 2]
    assert [frame.stamp_ns for frame in frames] == [0, 166_666_667, 333_333_333]  # numbers, not places in the list
    last = frames[2]
    last.check()
    assert last.color.shape == (12, 16, 3) and last.depth[3, 5] == 1510 and last.depth_unit_m == 0.001
    assert last.intrinsics.tolist() == [14, 14, 8, 6]
    np.testing.assert_allclose(last.color[3, 5], (200, 100, 10), atol=3)  # JPEG
    assert last.given_world_from_camera[:3, 3].tolist() == [10.0, 0.0, 1.5]
    assert last.up_camera == pytest.approx([0, -1, 0])  # level camera: up is against its y axis


def test_a_lost_pose_is_no_pose(scannet: Path):
    source = SOURCE(scannet, {"rate_hz": 10.0})
    lost = list(source.frames())[1]
    assert np.isnan(lost.given_world_from_camera).all() and np.isnan(lost.up_camera).all()
    lost.check()
    assert sorted(source.given_poses()) == [0, 1_000_000_000]


def test_color_is_drawn_into_the_pinhole_of_depth():
    """A colour image that shows its own viewing angles shows them at depth's pixels."""

    def angles(pinhole: np.ndarray, height: int, width: int) -> np.ndarray:
        v, u = np.mgrid[0:height, 0:width]
        x, y = (u - pinhole[2]) / pinhole[0], (v - pinhole[3]) / pinhole[1]
        return np.stack((x, y, -x), axis=2) * 150 + 128  # 2.3 steps a pixel of depth

    color_k, depth_k = np.array([120.0, 118.0, 66.0, 47.0]), np.array([66.0, 65.0, 32.0, 23.5])
    drawn = reproject_color(np.round(angles(color_k, 96, 128)).astype(np.uint8), color_k, depth_k, (48, 64))
    error = drawn - angles(depth_k, 48, 64)
    assert np.abs(error).max() < 1.5  # rounded three times
    x, _, mirrored = error.mean(axis=(0, 1))  # halves are rounded up in both, a shift would part them
    assert abs(x - mirrored) / 2 < 0.1


def test_color_of_depths_size_and_pinhole_is_left_as_it_is():
    noise = np.random.default_rng(0).integers(0, 256, (48, 64, 3), np.uint8)
    pinhole = np.array([57.0, 58.0, 31.2, 24.5])
    assert np.array_equal(reproject_color(noise, pinhole, pinhole, (48, 64)), noise)


def test_colors_edge_is_repeated_where_depth_sees_more():
    plain = np.full((48, 64, 3), 90, np.uint8)
    wider = np.array([50.0, 50.0, 32.0, 24.0])
    assert (reproject_color(plain, np.array([57.0, 57.0, 32.0, 24.0]), wider, (48, 64)) == 90).all()


@pytest.mark.parametrize("kind", ["color", "depth"])
def test_missing_or_wrong_intrinsics_are_named(scannet: Path, kind: str):
    file = scannet / f"intrinsic/intrinsic_{kind}.txt"
    for text, reason in (("1 2 3", "expected a camera matrix"), ("1 " * 16, "not a pinhole camera matrix")):
        file.write_text(text)
        with pytest.raises(SourceError, match=rf"intrinsic_{kind}\.txt: {reason}"):
            SOURCE(scannet, {})
    write_matrix(file, -14.0, 8.0, 6.0)
    with pytest.raises(SourceError, match=rf"intrinsic_{kind}\.txt: fx fy cx cy must be four positive numbers"):
        SOURCE(scannet, {})
    write_matrix(file, 14.0, 800.0, 6.0)
    with pytest.raises(SourceError, match=rf"intrinsic_{kind}\.txt: the principal point \(800, 6\) is outside"):
        list(SOURCE(scannet, {}).frames())
    file.unlink()
    with pytest.raises(SourceError, match=rf"intrinsic_{kind}\.txt: cannot be read"):
        SOURCE(scannet, {})


def test_color_resized_without_its_intrinsics_is_named(scannet: Path):
    write_matrix(scannet / "intrinsic/intrinsic_color.txt", 56.0, 16.5, 12.5)
    with pytest.raises(SourceError, match=r"0\.jpg: a 32x24 image does not fit intrinsic_color\.txt: .* 0\.50 times"):
        list(SOURCE(scannet, {}).frames())


@pytest.mark.parametrize(
    ("gone", "text"),
    [
        ("depth/5.png", r"5\.jpg: frame 5 has no depth file \(3 colour and 2 depth files\)"),
        ("pose/10.txt", r"10\.jpg: frame 10 has no pose file"),
        ("color/0.jpg", r"0\.png: frame 0 has no colour file"),
    ],
)
def test_counts_that_differ_are_named(scannet: Path, gone: str, text: str):
    (scannet / gone).unlink()
    with pytest.raises(SourceError, match=text):
        SOURCE(scannet, {})


@pytest.mark.parametrize("name", ["color/0.jpg", "depth/0.png"])
def test_a_cut_image_is_named(scannet: Path, name: str):
    data = (scannet / name).read_bytes()
    (scannet / name).write_bytes(data[: len(data) // 2])
    with pytest.raises(SourceError, match=rf"{Path(name).name}: not a whole image"):
        next(SOURCE(scannet, {}).frames())


def test_depth_of_8_bits_is_named(scannet: Path):
    cv2.imwrite(str(scannet / "depth/0.png"), np.zeros((12, 16), np.uint8))
    with pytest.raises(SourceError, match=r"0\.png: depth must be 16 bit"):
        next(SOURCE(scannet, {}).frames())


@pytest.mark.parametrize("text", ["1 0 0 0", "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1 7", "2 " * 16, "1 0 0 -inf" + " 0" * 12])
def test_a_wrong_pose_is_named(scannet: Path, text: str):
    (scannet / "pose/10.txt").write_text(text)
    with pytest.raises(SourceError, match=r"10\.txt: (expected a pose matrix \(4x4 numbers\)|not a rigid pose)"):
        SOURCE(scannet, {}).given_poses()


def test_unknown_setting(scannet: Path):
    with pytest.raises(ConfigError, match="rate: Extra inputs"):
        SOURCE(scannet, {"rate": 10.0})
