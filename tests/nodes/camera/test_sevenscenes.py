from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from placegraph.nodes.camera.sevenscenes import SOURCE
from placegraph.runtime.errors import ConfigError, SourceError

REAL = Path(__file__).parents[4] / "shared/data/sevenscenes"


def test_absent_folder(tmp_path: Path):
    with pytest.raises(SourceError, match="nowhere: no such folder"):
        SOURCE(tmp_path / "nowhere", {})
    assert not SOURCE.matches(tmp_path / "nowhere")


def test_empty_folder(tmp_path: Path):
    with pytest.raises(SourceError, match=r"no frame-\*\.color"):
        SOURCE(tmp_path, {})
    assert not SOURCE.matches(tmp_path)


def test_a_file_is_no_folder(seven: Path):
    assert not SOURCE.matches(seven / "camera-intrinsics.txt")


def test_frames_carry_what_the_files_say(seven: Path):
    frames = list(SOURCE(seven, {}).frames())
    assert [frame.frame_id for frame in frames] == [0, 1, 2]
    assert [frame.stamp_ns for frame in frames] == [0, 33_333_333, 133_333_333]  # number 4 at 30 Hz
    last = frames[2]
    last.check()
    assert last.color[3, 5].tolist() == [200, 100, 14]
    assert last.depth[3, 5] == 1504
    assert last.depth_unit_m == 0.001
    assert last.depth[0, :2].tolist() == [0, 0]  # 65535 is no reading either
    assert last.intrinsics.tolist() == [14.0, 13.0, 8.5, 6.5]
    assert last.given_world_from_camera[:3, 3].tolist() == [4.0, 0.0, 1.5]
    assert np.isnan(last.up_camera).all()


def test_rate_setting(seven: Path):
    assert next(iter(SOURCE(seven, {"rate_hz": 10.0}).frames())).stamp_ns == 0
    assert sorted(SOURCE(seven, {"rate_hz": 10.0}).given_poses() or {}) == [0, 100_000_000, 400_000_000]


def test_unknown_setting(seven: Path):
    with pytest.raises(ConfigError, match="rate: Extra inputs"):
        SOURCE(seven, {"rate": 10.0})


def test_without_a_calibration_file_the_default_must_fit_the_image(seven: Path):
    (seven / "camera-intrinsics.txt").unlink()
    with pytest.raises(
        SourceError, match=r"settings\] intrinsics: the principal point \(320, 240\) is outside the 16x12"
    ):
        list(SOURCE(seven, {}).frames())
    frame = next(iter(SOURCE(seven, {"intrinsics": [14, 13, 8, 6]}).frames()))
    assert frame.intrinsics.tolist() == [14, 13, 8, 6]


@pytest.mark.parametrize(
    ("matrix", "text"),
    [
        (np.eye(3)[:2], "expected a camera matrix"),
        (np.array([[14, 1, 8], [0, 13, 6], [0, 0, 1.0]]), "not a pinhole camera matrix"),
        (np.array([[14, 0, 8], [0, -13, 6], [0, 0, 1.0]]), "fx fy cx cy must be four positive numbers"),
        (np.array([[np.nan, 0, 8], [0, 13, 6], [0, 0, 1.0]]), "fx fy cx cy must be four positive numbers"),
    ],
)
def test_wrong_calibration(seven: Path, matrix: np.ndarray, text: str):
    np.savetxt(seven / "camera-intrinsics.txt", matrix)
    with pytest.raises(SourceError, match=rf"camera-intrinsics\.txt: {text}"):
        SOURCE(seven, {})


@pytest.mark.parametrize("ending", ["depth.png", "pose.txt"])
def test_a_frame_without_its_depth_or_pose_is_named(seven: Path, ending: str):
    (seven / f"frame-000001.{ending}").unlink()
    stream = SOURCE(seven, {}).frames()
    assert next(stream).frame_id == 0
    with pytest.raises(SourceError, match=rf"frame-000001\.{ending}: cannot be read"):
        next(stream)


@pytest.mark.parametrize("lost", [-np.inf, np.nan])
def test_a_lost_track_is_no_pose(seven: Path, lost: float):
    np.savetxt(seven / "frame-000001.pose.txt", np.full((4, 4), lost))
    source = SOURCE(seven, {})
    assert np.isnan(list(source.frames())[1].given_world_from_camera).all()
    assert sorted(source.given_poses() or {}) == [0, 133_333_333]


@pytest.mark.parametrize("text", ["1 0 0 0", "not numbers at all", "2 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1"])
def test_a_wrong_pose_is_named(seven: Path, text: str):
    (seven / "frame-000001.pose.txt").write_text(text)
    with pytest.raises(SourceError, match=r"frame-000001\.pose\.txt: (expected a pose matrix|not a rigid pose)"):
        list(SOURCE(seven, {}).frames())


def test_a_pose_with_one_lost_number_is_an_error(seven: Path):
    pose = np.eye(4)
    pose[0, 3] = np.nan
    np.savetxt(seven / "frame-000001.pose.txt", pose)
    with pytest.raises(SourceError, match="not a rigid pose"):
        SOURCE(seven, {}).given_poses()


def test_two_color_images_of_one_frame(seven: Path):
    cv2.imwrite(str(seven / "frame-000001.color.jpg"), np.zeros((12, 16, 3), np.uint8))
    with pytest.raises(SourceError, match="frame 1 has a second file"):
        SOURCE(seven, {})


def test_a_single_sequence_below_the_path_is_taken(seven: Path, tmp_path: Path):
    scene = tmp_path / "scene"
    scene.mkdir()
    seven.rename(scene / "seq-01")
    (scene / "seq-01/camera-intrinsics.txt").rename(scene / "camera-intrinsics.txt")
    assert SOURCE.matches(scene)
    frames = list(SOURCE(scene, {}).frames())
    assert len(frames) == 3
    assert frames[0].intrinsics[0] == 14.0
    (scene / "seq-02").mkdir()
    assert not SOURCE.matches(scene)
    with pytest.raises(SourceError, match="several sequences"):
        SOURCE(scene, {})


@pytest.mark.weights
@pytest.mark.skipif(not REAL.exists(), reason="the real frames lie beside a development checkout")
def test_real_frames():
    source = SOURCE(REAL, {})
    assert SOURCE.matches(REAL)
    stream = source.frames()
    first = next(stream)
    first.check()
    assert first.color.shape == (480, 640, 3)
    assert 1000 < np.median(first.depth[first.depth > 0]) < 4000
    assert len(source.given_poses() or {}) == 500


@pytest.mark.parametrize("kind", [".png", ".jpg"])
@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.99])
def test_an_image_cut_anywhere_is_refused_in_silence(tmp_path, capfd, kind: str, share: float) -> None:
    from placegraph.nodes.camera._dataset_reader import read_color
    from placegraph.runtime.errors import SourceError

    noise = np.random.default_rng(0).integers(0, 255, (60, 80, 3), np.uint8)
    data = cv2.imencode(kind, noise)[1].tobytes()
    path = tmp_path / f"cut{kind}"
    path.write_bytes(data[: int(len(data) * share)])
    with pytest.raises(SourceError, match="truncated or damaged"):
        read_color(path)
    assert capfd.readouterr() == ("", "")
    path.write_bytes(data)
    assert read_color(path).shape == noise.shape
