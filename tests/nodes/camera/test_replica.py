from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from placegraph.nodes.camera.replica import SOURCE
from placegraph.runtime.errors import ConfigError, SourceError


def test_absent_and_empty_folders(tmp_path: Path):
    with pytest.raises(SourceError, match="nowhere: no such folder"):
        SOURCE(tmp_path / "nowhere", {})
    with pytest.raises(SourceError, match="results: cannot be read: No such file"):
        SOURCE(tmp_path, {})
    assert not SOURCE.matches(tmp_path)
    (tmp_path / "results").mkdir()
    with pytest.raises(SourceError, match=r"results: no frame\*\.jpg"):
        SOURCE(tmp_path, {})


def test_frames_carry_what_the_files_say(replica: Path):
    assert SOURCE.matches(replica)
    source = SOURCE(replica, {"rate_hz": 10.0})
    frames = list(source.frames())
    assert [(frame.frame_id, frame.stamp_ns) for frame in frames] == [(0, 0), (1, 100_000_000), (2, 200_000_000)]
    last = frames[2]
    last.check()
    assert float(last.depth[3, 5] * last.depth_unit_m) == pytest.approx(1502 / 6553.5)
    assert last.intrinsics.tolist() == [14, 14, 7.5, 5.5]
    np.testing.assert_allclose(last.color[3, 5], (200, 100, 12), atol=3)  # JPEG
    assert last.given_world_from_camera[:3, 3].tolist() == [2.0, 0.0, 1.5]
    assert last.up_camera == pytest.approx([0, -1, 0])  # level camera: up is against its y axis
    assert sorted(source.given_poses()) == [0, 100_000_000, 200_000_000]


def test_the_camera_file_may_lie_in_the_scene_and_the_path_may_be_relative(
    replica: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.chdir(replica)
    assert next(SOURCE(Path(), {}).frames()).intrinsics[0] == 14
    there = replica.parent / "cam_params.json"
    (replica / "cam_params.json").write_text(there.read_text().replace("14.0", "13.0"))
    there.unlink()
    assert next(SOURCE(replica, {}).frames()).intrinsics[0] == 13


def test_some_frames_of_a_scene_keep_their_poses(replica: Path):
    for name in ("frame000001.jpg", "depth000001.png"):
        (replica / "results" / name).unlink()
    assert [frame.given_world_from_camera[0, 3] for frame in SOURCE(replica, {}).frames()] == [0, 2]


def test_a_missing_camera_file_is_named(replica: Path):
    (replica.parent / "cam_params.json").unlink()
    with pytest.raises(SourceError, match=r"Replica/cam_params\.json: cannot be read"):
        SOURCE(replica, {})


@pytest.mark.parametrize(
    ("key", "value", "text"),
    [
        ("fx", None, r"camera\.fx: Input should be a valid number"),
        ("scale", 0, r"camera\.scale: Input should be greater than 0"),
        ("cx", float("nan"), r"camera\.cx: Input should be a finite number"),
        ("w", 1200, r"frame000000\.jpg: is 16x12; .*cam_params\.json says 1200x12"),
        ("cy", 12, r"cam_params\.json: the principal point \(7\.5, 12\) is outside the 16x12 image"),
    ],
)
def test_wrong_camera_files_are_named(replica: Path, key: str, value: float | None, text: str):
    file = replica.parent / "cam_params.json"
    camera = json.loads(file.read_text())
    camera["camera"][key] = value
    file.write_text(json.dumps(camera))
    with pytest.raises(SourceError, match=text):
        list(SOURCE(replica, {}).frames())


def test_a_camera_file_that_is_not_json(replica: Path):
    (replica.parent / "cam_params.json").write_text("{")
    with pytest.raises(SourceError, match=r"cam_params\.json: the file: Invalid JSON"):
        SOURCE(replica, {})


@pytest.mark.parametrize(
    ("line", "text"),
    [
        ("1 0 0 0", r"traj\.txt:2: expected a pose of 16 numbers, found 4 words"),
        ("x " * 16, r"traj\.txt:2: expected a pose of 16 numbers"),
        ("2 " * 16, r"traj\.txt:2: not a rigid pose"),
        ("", r"traj\.txt:2: expected a pose of 16 numbers, found 0 words"),
    ],
)
def test_a_wrong_line_of_the_track_is_named(replica: Path, line: str, text: str):
    lines = (replica / "traj.txt").read_text().splitlines()
    lines[1] = line
    (replica / "traj.txt").write_text("\n".join(lines))
    with pytest.raises(SourceError, match=text):
        SOURCE(replica, {})


def test_a_track_that_is_too_short_or_absent_is_named(replica: Path):
    lines = (replica / "traj.txt").read_text().splitlines()
    (replica / "traj.txt").write_text("\n".join(lines[:2]))
    with pytest.raises(SourceError, match=r"traj\.txt: 2 poses, none for frame000002\.jpg"):
        SOURCE(replica, {})
    (replica / "traj.txt").unlink()
    with pytest.raises(SourceError, match=r"traj\.txt: cannot be read"):
        SOURCE(replica, {})


def test_counts_that_differ_are_named(replica: Path):
    (replica / "results/depth000001.png").unlink()
    with pytest.raises(SourceError, match=r"frame000001\.jpg: frame 1 has no depth file \(3 colour and 2 depth"):
        SOURCE(replica, {})


def test_a_cut_image_and_one_of_another_size_are_named(replica: Path):
    file = replica / "results/depth000001.png"
    file.write_bytes(file.read_bytes()[:-20])
    stream = SOURCE(replica, {}).frames()
    next(stream)
    with pytest.raises(SourceError, match=r"depth000001\.png: not a whole image"):
        next(stream)
    cv2.imwrite(str(file), np.ones((6, 8), np.uint16))
    with pytest.raises(SourceError, match=r"depth000001\.png: depth is 8x6, its colour image is 16x12"):
        list(SOURCE(replica, {}).frames())


def test_unknown_setting(replica: Path):
    with pytest.raises(ConfigError, match="rate: Extra inputs"):
        SOURCE(replica, {"rate": 10.0})
