from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from placegraph.nodes.camera.hm3dsem import SOURCE
from placegraph.runtime.errors import ConfigError, SourceError
from placegraph.runtime.vision import geometry

NAME = "Dd4bFSTQ8gi"


def test_absent_and_empty_folders(tmp_path: Path):
    with pytest.raises(SourceError, match="nowhere: no such folder"):
        SOURCE(tmp_path / "nowhere", {})
    with pytest.raises(SourceError, match="rgb: cannot be read: No such file"):
        SOURCE(tmp_path, {})
    for name in ("rgb", "depth", "pose"):
        (tmp_path / name).mkdir()
    assert not SOURCE.matches(tmp_path)
    with pytest.raises(SourceError, match=r"rgb: no SCENE_000000\.png"):
        SOURCE(tmp_path, {})


def test_frames_carry_what_the_files_say(hm3dsem: Path):
    assert SOURCE.matches(hm3dsem)
    source = SOURCE(hm3dsem, {})
    frames = list(source.frames())
    assert [(frame.frame_id, frame.stamp_ns) for frame in frames] == [(0, 0), (1, 200_000_000), (2, 400_000_000)]
    last = frames[2]
    last.check()
    assert last.color[3, 5].tolist() == [200, 100, 12]
    assert last.depth[3, 5] == 1502 and last.depth_unit_m == 0.001
    assert last.intrinsics.tolist() == [8, 8, 7.5, 5.5]  # 90 degrees over 16 px
    assert sorted(source.given_poses()) == [0, 200_000_000, 400_000_000]


def test_the_world_is_turned_to_z_up_and_the_camera_to_z_forward(hm3dsem: Path):
    frame = list(SOURCE(hm3dsem, {}).frames())[2]
    pose = frame.given_world_from_camera
    assert geometry.is_rigid(pose)
    assert frame.up_camera.tolist() == [0, -1, 0]  # level: up is against the camera's y axis
    # in habitat at (0, 1.5, .4), right of it +x; what lies 1 m ahead is at z = .4 - 1, and habitat's -z is our +y
    assert pose[:3, 3] == pytest.approx([0, -0.4, 1.5])
    assert geometry.transform(pose, np.array([[0, 0, 1.0], [1, 0, 0]])) == pytest.approx(
        np.array([[0, 0.6, 1.5], [1, -0.4, 1.5]])
    )


def test_a_camera_that_looks_down_looks_down(hm3dsem: Path):
    """Pitched by -30 degrees about its x axis, as habitat's look_down does."""
    c, s = np.cos(np.deg2rad(-30)), np.sin(np.deg2rad(-30))
    pose = np.array([[1, 0, 0, 0], [0, c, -s, 1.5], [0, s, c, 0], [0, 0, 0, 1]])
    (hm3dsem / f"pose/{NAME}_000000.txt").write_text("\t".join(map(str, pose.ravel())))
    frame = next(SOURCE(hm3dsem, {}).frames())
    ahead = geometry.transform(frame.given_world_from_camera, np.array([[0, 0, 1.0]]))[0]
    assert ahead == pytest.approx([0, np.cos(np.pi / 6), 1.0])
    assert frame.up_camera == pytest.approx([0, -np.cos(np.pi / 6), -0.5])


def test_names_as_the_readme_writes_them(hm3dsem: Path):
    for path in [*hm3dsem.rglob("*.png"), *hm3dsem.rglob("*.txt")]:
        path.rename(path.with_name(path.name.replace("_", "-")))
    assert SOURCE.matches(hm3dsem)
    assert len(list(SOURCE(hm3dsem, {}).frames())) == 3


@pytest.mark.parametrize("text", ["", "1 0 0 0", "0 0 0 0 0 0 1", "2 " * 16, "-inf " * 16])
def test_a_wrong_pose_is_named(hm3dsem: Path, text: str):
    (hm3dsem / f"pose/{NAME}_000001.txt").write_text(text)
    stream = SOURCE(hm3dsem, {}).frames()
    next(stream)
    with pytest.raises(SourceError, match=r"_000001\.txt: (expected a pose matrix \(4x4 numbers\)|not a rigid pose)"):
        next(stream)


@pytest.mark.parametrize(
    ("gone", "lacks"),
    [("depth/{}_000001.png", "depth"), ("pose/{}_000002.txt", "pose"), ("rgb/{}_000000.png", "colour")],
)
def test_counts_that_differ_are_named(hm3dsem: Path, gone: str, lacks: str):
    (hm3dsem / gone.format(NAME)).unlink()
    with pytest.raises(SourceError, match=rf"frame \d has no {lacks} file"):
        SOURCE(hm3dsem, {})


def test_a_cut_image_and_one_of_another_size_are_named(hm3dsem: Path):
    file = hm3dsem / f"depth/{NAME}_000000.png"
    file.write_bytes(file.read_bytes()[:-20])
    with pytest.raises(SourceError, match=r"_000000\.png: not a whole image"):
        next(SOURCE(hm3dsem, {}).frames())
    cv2.imwrite(str(file), np.ones((6, 8), np.uint16))
    with pytest.raises(SourceError, match=r"_000000\.png: depth is 8x6, its colour image is 16x12"):
        next(SOURCE(hm3dsem, {}).frames())


def test_settings(hm3dsem: Path):
    frame = next(SOURCE(hm3dsem, {"intrinsics": [9.0, 9.0, 8.0, 6.0], "rate_hz": 1.0}).frames())
    assert frame.intrinsics.tolist() == [9, 9, 8, 6]
    with pytest.raises(SourceError, match=r"settings\] intrinsics: the principal point \(80, 6\) is outside the 16x12"):
        next(SOURCE(hm3dsem, {"intrinsics": [9.0, 9.0, 80.0, 6.0]}).frames())
    with pytest.raises(ConfigError, match="hfov: Extra inputs"):
        SOURCE(hm3dsem, {"hfov": 90.0})
