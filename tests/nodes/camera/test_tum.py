from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from placegraph.nodes.camera.tum import SOURCE, associate
from placegraph.runtime.errors import ConfigError, SourceError
from placegraph.runtime.vision import geometry

REAL = Path(__file__).parents[4] / "shared/data/tum_fr3_cabinet"


def times(*seconds: float) -> np.ndarray:
    return (np.array(seconds) * 1e9).astype(np.int64)


def test_associate_nothing():
    assert associate(times(), times(), 10) == []
    assert associate(times(1.0), times(), 10) == []
    assert associate(times(), times(1.0), 10) == []


def test_associate_takes_the_nearest_and_each_once():
    # both colours are nearest to depth 1; the nearer one gets it, the other takes what is left
    assert associate(times(1.0, 1.01), times(0.99, 1.008), 20_000_000) == [(0, 0), (1, 1)]
    assert associate(times(1.0, 1.01), times(1.008), 20_000_000) == [(1, 0)]


def test_associate_keeps_the_window():
    assert associate(times(1.0), times(1.02), 20_000_000) == [(0, 0)]
    assert associate(times(1.0), times(1.021), 20_000_000) == []


def test_absent_folder(tmp_path: Path):
    with pytest.raises(SourceError, match="nowhere: no such folder"):
        SOURCE(tmp_path / "nowhere", {})


@pytest.mark.parametrize("name", ["rgb.txt", "depth.txt"])
def test_a_missing_or_empty_list_is_named(tum: Path, name: str):
    assert SOURCE.matches(tum)
    (tum / name).write_text("# nothing\n\n")
    with pytest.raises(SourceError, match=rf"{name}: lists no image"):
        SOURCE(tum, {})
    (tum / name).unlink()
    assert not SOURCE.matches(tum)
    with pytest.raises(SourceError, match=rf"{name}: cannot be read"):
        SOURCE(tum, {})


def test_frames_carry_what_the_files_say(tum: Path):
    source = SOURCE(tum, {})
    frames = list(source.frames())
    assert [frame.frame_id for frame in frames] == [0, 1, 2]
    # exact: a double of seconds would be off by up to 119 ns
    assert [frame.stamp_ns for frame in frames] == [1341841278_800000000 + k * 100_000_000 for k in range(3)]
    last = frames[2]
    last.check()
    assert last.color[0, 0].tolist() == [200, 100, 12]
    assert float(last.depth[0, 0] * last.depth_unit_m) == pytest.approx(3.0)
    assert last.intrinsics.tolist() == [535.4, 539.2, 320.1, 247.6]
    # the track has no sample at this time: its neighbours are 5 ms away on both sides
    assert last.given_world_from_camera[:3, 3] == pytest.approx([2.0, 0.0, 1.5])
    assert geometry.is_rigid(last.given_world_from_camera)
    assert last.up_camera == pytest.approx([0, -1, 0])  # level camera: up is against its y axis
    poses = source.given_poses()
    assert poses is not None
    assert list(poses) == [frame.stamp_ns for frame in frames]


def test_rotation_is_interpolated_along_the_arc(tum: Path):
    half = np.sqrt(0.5)
    rows = ["1341841278.79 0 0 0 0 0 0 1", f"1341841278.81 1 0 0 0 0 {half:.6f} {half:.6f}"]
    (tum / "groundtruth.txt").write_text("\n".join(rows))
    pose = next(iter(SOURCE(tum, {}).frames())).given_world_from_camera
    assert np.rad2deg(geometry.rotation_angle_rad(pose[:3, :3])) == pytest.approx(45.0, abs=1e-3)
    assert pose[0, 3] == pytest.approx(0.5)


def test_a_gap_in_the_track_is_no_pose(tum: Path):
    (tum / "groundtruth.txt").write_text("1341841278.81 7 0 0 0 0 0 1")
    source = SOURCE(tum, {})
    frames = list(source.frames())
    assert frames[0].given_world_from_camera[0, 3] == 7.0  # one neighbour, near enough
    assert np.isnan(frames[1].given_world_from_camera).all()
    assert np.isnan(frames[1].up_camera).all()
    assert list(source.given_poses() or {}) == [frames[0].stamp_ns]


@pytest.mark.parametrize("text", ["", "# nothing\n"])
def test_an_empty_track_gives_no_pose(tum: Path, text: str):
    (tum / "groundtruth.txt").write_text(text)
    assert SOURCE(tum, {}).given_poses() == {}


def test_without_a_track(tum: Path):
    (tum / "groundtruth.txt").unlink()
    source = SOURCE(tum, {})
    assert source.given_poses() is None
    assert np.isnan(next(iter(source.frames())).given_world_from_camera).all()


@pytest.mark.parametrize(
    ("name", "line", "text"),
    [
        ("rgb.txt", "1341841278.8", r"rgb\.txt:1: expected `time file`"),
        ("rgb.txt", "soon rgb/0.png", r"rgb\.txt: not a time in seconds: 'soon'"),
        ("rgb.txt", "nan rgb/0.png", r"rgb\.txt: not a time in seconds: 'nan'"),
        ("rgb.txt", "1.0 rgb/0.png\n1.0 rgb/1.png", r"rgb\.txt: time 1\.0 appears twice"),
        ("rgb.txt", "1.0 rgb/0.png", "no colour image has a depth image within 0.02 s"),
        ("groundtruth.txt", "1.0 0 0 0 0 0 1", r"groundtruth\.txt:1: expected `time tx"),
        ("groundtruth.txt", "1.0 0 0 0 0 0 0 0", r"groundtruth\.txt: time 1\.0: not a position and a unit quaternion"),
        ("groundtruth.txt", "1.0 nan 0 0 0 0 0 1", "not a position and a unit quaternion"),
        ("groundtruth.txt", "1.0 x 0 0 0 0 0 1", r"groundtruth\.txt: could not convert"),
    ],
)
def test_wrong_lines_are_named(tum: Path, name: str, line: str, text: str):
    (tum / name).write_text(line)
    with pytest.raises(SourceError, match=text):
        SOURCE(tum, {})


def test_a_listed_image_that_is_absent_is_named(tum: Path):
    (tum / "depth/1.png").unlink()
    stream = SOURCE(tum, {}).frames()
    next(stream)
    with pytest.raises(SourceError, match=r"depth/1\.png: cannot be read"):
        next(stream)


def test_intrinsics_by_name_file_and_setting(tum: Path, tmp_path: Path):
    other = tum.rename(tmp_path / "my_walk")
    with pytest.raises(ConfigError, match=r"my_walk: the camera is not known.*set intrinsics"):
        SOURCE(other, {})
    (other / "calibration.txt").write_text("500 501 320 240")
    assert next(iter(SOURCE(other, {}).frames())).intrinsics.tolist() == [500, 501, 320, 240]
    by_setting = SOURCE(other, {"intrinsics": [400.0, 401.0, 300.0, 200.0]})
    assert next(iter(by_setting.frames())).intrinsics.tolist() == [400, 401, 300, 200]
    (other / "calibration.txt").write_text("500 501 320")
    with pytest.raises(SourceError, match=r"calibration\.txt: expected fx fy cx cy"):
        SOURCE(other, {})
    with pytest.raises(SourceError, match="principal point"):
        next(iter(SOURCE(other, {"intrinsics": [400.0, 401.0, 640.0, 200.0]}).frames()))
    with pytest.raises(ConfigError, match="intrinsics: List should have at least 4"):
        SOURCE(other, {"intrinsics": [400.0]})


@pytest.mark.parametrize(("name", "fx"), [("fr1_desk", 517.3), ("rgbd_dataset_Freiburg2_xyz", 520.9)])
def test_camera_from_the_folder_name(tum: Path, tmp_path: Path, name: str, fx: float):
    assert next(iter(SOURCE(tum.rename(tmp_path / name), {}).frames())).intrinsics[0] == fx


@pytest.mark.weights
@pytest.mark.skipif(not REAL.exists(), reason="the real frames lie beside a development checkout")
def test_real_frames_agree_with_their_track(tmp_path: Path):
    folder = tmp_path / "rgbd_dataset_freiburg3_cabinet"
    folder.mkdir()
    rows = [line.split() for line in (REAL / "truth_cam_poses.txt").read_text().splitlines()]
    shutil.copytree(REAL / "raw_imgs", folder / "rgb")
    shutil.copytree(REAL / "depth_imgs", folder / "depth")
    lists = {"rgb": "rgb/{:04d}_rgb_raw.jpg", "depth": "depth/{:04d}_depth_raw.png"}
    for name, pattern in lists.items():
        lines = [f"{row[0]} {pattern.format(i)}" for i, row in enumerate(rows)]
        (folder / f"{name}.txt").write_text("\n".join(lines))
    (folder / "groundtruth.txt").write_text("\n".join(" ".join(row) for row in rows))
    frames = list(SOURCE(folder, {}).frames())
    assert len(frames) == 58
    # points of one frame, seen from the next, lie where its own depth says
    here, there = frames[10], frames[11]
    depth_m = here.depth * np.float32(here.depth_unit_m)
    world = geometry.transform(
        here.given_world_from_camera, geometry.backproject(depth_m, here.intrinsics, 4).astype(float)
    )
    points = geometry.transform(geometry.inverse(there.given_world_from_camera), world)
    pixels = np.round(points[:, :2] / points[:, 2:] * there.intrinsics[:2] + there.intrinsics[2:]).astype(int)
    inside = ((pixels >= 0) & (pixels < (640, 480))).all(axis=1) & (points[:, 2] > 0.3)
    seen = there.depth[pixels[inside, 1], pixels[inside, 0]] * there.depth_unit_m
    error = np.abs(seen - points[inside, 2])[seen > 0]
    assert np.median(error) < 0.02
    # the track's z is up: a large share of the points lies on one level, the floor at about 0
    assert (np.abs(world[:, 2]) < 0.12).mean() > 0.3
