from __future__ import annotations

import re
from pathlib import Path

import cv2
import numpy as np
import pytest

from placegraph.nodes.camera import _dataset_reader as reader
from placegraph.runtime.errors import ConfigError, SourceError


class Settings(reader.SourceSettings):
    rate_hz: float = 30.0


def encode(image: np.ndarray, ending: str) -> bytes:
    return cv2.imencode(ending, image)[1].tobytes()


NOISE = np.random.default_rng(0).integers(0, 255, (40, 50, 3), np.uint8)


@pytest.mark.parametrize(
    ("settings", "text"),
    [({"rate": 1.0}, r"\[nodes.camera.settings\] rate: Extra"), ({"rate_hz": "fast"}, "rate_hz: .*number")],
)
def test_settings_errors_name_the_key(settings: dict[str, object], text: str):
    with pytest.raises(ConfigError, match=text):
        reader.read_settings(Settings, settings)


@pytest.mark.parametrize("ending", [".png", ".jpg"])
@pytest.mark.parametrize("share", [0.0, 0.01, 0.5, 0.97])
def test_truncated_images_are_refused_by_name(tmp_path: Path, ending: str, share: float):
    data = encode(NOISE, ending)
    file = tmp_path / f"cut{ending}"
    file.write_bytes(data[: int(len(data) * share)])
    with pytest.raises(SourceError, match=rf"cut\{ending}: not a whole image"):
        reader.read_color(file)


def test_absent_image_is_named(tmp_path: Path):
    with pytest.raises(SourceError, match=r"none\.png: cannot be read: No such file"):
        reader.read_color(tmp_path / "none.png")


def test_color_comes_as_rgb(tmp_path: Path):
    file = tmp_path / "a.png"
    file.write_bytes(encode(NOISE, ".png"))
    assert np.array_equal(reader.read_color(file), NOISE[..., ::-1])


@pytest.mark.parametrize("image", [np.zeros((4, 5), np.uint8), np.zeros((4, 5, 3), np.uint16)])
def test_depth_of_another_kind_is_refused(tmp_path: Path, image: np.ndarray):
    file = tmp_path / "d.png"
    file.write_bytes(encode(image, ".png"))
    with pytest.raises(SourceError, match=r"d\.png: depth must be 16 bit of one channel"):
        reader.read_depth(file)


def test_a_pair_of_two_sizes_is_refused(tmp_path: Path):
    (tmp_path / "c.png").write_bytes(encode(NOISE, ".png"))
    (tmp_path / "d.png").write_bytes(encode(np.zeros((20, 25), np.uint16), ".png"))
    with pytest.raises(SourceError, match=r"d\.png: depth is 25x20, its colour image is 50x40"):
        reader.read_color_and_depth(tmp_path / "c.png", tmp_path / "d.png")


@pytest.mark.parametrize("text", ["", "1 2 3", "1 2 3 4 5", "1 2 three 4"])
def test_numbers_that_do_not_fit_are_refused(tmp_path: Path, text: str):
    file = tmp_path / "k.txt"
    file.write_text(text)
    with pytest.raises(SourceError, match=r"k\.txt: expected fx fy cx cy \(4 numbers\)"):
        reader.read_numbers(file, (4,), "fx fy cx cy")


def test_text_that_is_not_utf8_is_refused(tmp_path: Path):
    file = tmp_path / "k.txt"
    file.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(SourceError, match=r"k\.txt: cannot be read"):
        reader.read_text(file)


@pytest.mark.parametrize(
    "values", [(0.0, 5.0, 5.0, 5.0), (-5.0, 5.0, 5.0, 5.0), (5.0, np.nan, 5.0, 5.0), (5.0, 5.0, np.inf, 5.0)]
)
def test_intrinsics_must_be_positive_and_finite(values: tuple[float, ...]):
    with pytest.raises(SourceError, match="here: fx fy cx cy must be four positive numbers"):
        reader.check_intrinsics(np.array(values), "here")


@pytest.mark.parametrize("center", [(50.0, 20.0), (25.0, 40.0), (640.0, 480.0)])
def test_principal_point_outside_the_image_is_refused(center: tuple[float, float]):
    with pytest.raises(SourceError, match=r"here: the principal point .* is outside the 50x40 image"):
        reader.check_center(np.array([40.0, 40.0, *center]), (40, 50), "here")


def test_principal_point_inside_is_accepted():
    reader.check_center(np.array([40.0, 40.0, 24.5, 19.5]), (40, 50), "here")


def test_no_pose_is_infinite_nan_or_zero(tmp_path: Path):
    file = tmp_path / "p.txt"
    for text in ("-inf " * 16, "nan " * 16, "0 " * 16, "-inf " * 12 + "0 0 0 1"):
        file.write_text(text)
        assert np.isnan(reader.read_pose(file)).all()


def test_numbered_files_come_by_number_and_only_whole_names_count(tmp_path: Path):
    for name in ("10.jpg", "9.jpg", "007.jpg", "8.jpg.part", "a8.jpg"):
        (tmp_path / name).touch()
    assert list(reader.numbered_files(tmp_path, re.compile(r"(\d+)\.jpg"))) == [7, 9, 10]
    (tmp_path / "7.jpg").touch()
    with pytest.raises(SourceError, match=r"7\.jpg: frame 7 has a second file, 007\.jpg"):
        reader.numbered_files(tmp_path, re.compile(r"(\d+)\.jpg"))
    with pytest.raises(SourceError, match="nowhere: cannot be read: No such file"):
        reader.numbered_files(tmp_path / "nowhere", re.compile(r"(\d+)\.jpg"))
