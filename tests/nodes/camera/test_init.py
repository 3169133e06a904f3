from __future__ import annotations

import json
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
from pydantic import ValidationError

from placegraph.nodes.camera import NODE, CameraConfig, CameraNode, detect_source, find_source
from placegraph.runtime.errors import ConfigError, SourceError
from placegraph.runtime.messages import End, Frame
from placegraph.runtime.node import Context
from placegraph.runtime.vision.geometry import backproject, transform


def camera(**settings: object) -> CameraNode:
    return NODE(CameraConfig.model_validate(settings), Context())


def drawn(**settings: object) -> CameraNode:
    return camera(source="flat", settings={"width": 32, "height": 24, "frames": 3}, **settings)


def test_auto_without_a_path_asks_for_one():
    with pytest.raises(ConfigError, match=r"path is empty.*sevenscenes.*tum.*oak"):
        camera()


def test_auto_with_an_absent_path_names_it(tmp_path: Path):
    with pytest.raises(SourceError, match="nowhere: no such file"):
        camera(path=str(tmp_path / "nowhere"))


def test_auto_on_an_empty_folder_says_what_was_looked_for(tmp_path: Path):
    with pytest.raises(SourceError) as caught:
        camera(path=str(tmp_path))
    for text in (str(tmp_path), "sevenscenes: a 7-Scenes folder", "tum: a TUM RGB-D folder"):
        assert text in str(caught.value)


@pytest.mark.parametrize("name", ["hm3dsem", "replica", "scannet", "seven", "tum"])
def test_auto_finds_each_format_without_importing_a_device(
    name: str, request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.delitem(sys.modules, "placegraph.nodes.camera.oak", raising=False)
    assert detect_source(str(request.getfixturevalue(name))) is find_source({"seven": "sevenscenes"}.get(name, name))
    assert "placegraph.nodes.camera.oak" not in sys.modules


def test_auto_on_a_folder_of_two_formats_asks_which(seven: Path):
    (seven / "rgb.txt").touch()
    (seven / "depth.txt").touch()
    with pytest.raises(ConfigError, match="more than one format; set source to one of: sevenscenes, tum"):
        camera(path=str(seven))


def test_unknown_source_lists_the_choices():
    with pytest.raises(ConfigError, match=r"no camera source named 'webcam'.*flat"):
        find_source("webcam")


@pytest.mark.parametrize("settings", [{"limit": -1}, {"paht": "x"}, {"limit": "3"}])
def test_wrong_settings_are_refused(settings: dict[str, object]):
    with pytest.raises(ValidationError):
        CameraConfig.model_validate(settings)


def test_gives_every_frame_and_then_one_end():
    node = drawn()
    messages = list(node.messages())
    assert [type(message) for message in messages] == [Frame, Frame, Frame, End]
    assert [message.frame_id for message in messages] == [0, 1, 2, 2]
    end = messages[-1]
    assert isinstance(end, End)
    assert (end.frames, end.stamp_ns) == (3, messages[2].stamp_ns)
    assert node.is_lossless()
    for message in messages:
        message.check()


@pytest.mark.parametrize(("limit", "frames"), [(1, 1), (2, 2), (3, 3), (9, 3)])
def test_limit_stops_early(limit: int, frames: int):
    messages = list(drawn(limit=limit).messages())
    assert len(messages) == frames + 1
    assert messages[-1].frame_id == frames - 1


def test_ending_stops_after_the_frame_in_hand():
    node = drawn()
    stream = node.messages()
    assert next(stream).frame_id == 0
    node.ending = True
    end = next(stream)
    assert isinstance(end, End)
    assert end.frames == 1
    assert list(stream) == []


def test_a_source_is_let_go_when_the_stream_is_closed():
    closed = []

    class Watched:
        live = False

        def frames(self):
            try:
                yield from drawn().source.frames()
            finally:
                closed.append(True)

    node = drawn(limit=1)
    node.source = Watched()
    assert len(list(node.messages())) == 2
    assert closed == [True]


def test_a_source_without_frames_is_an_error_not_an_empty_run():
    node = drawn()
    node.source.numbers = ()
    with pytest.raises(SourceError, match="flat: the source gave no frame"):
        list(node.messages())


def write_image(path: Path, image: np.ndarray) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    assert cv2.imwrite(str(path), image[..., ::-1] if image.ndim == 3 else image)


def write_scannet(folder: Path, number: int, frame: Frame) -> dict[str, object]:
    write_image(folder / f"color/{number}.jpg", np.repeat(np.repeat(frame.color, 2, axis=0), 2, axis=1))
    write_image(folder / f"depth/{number}.png", frame.depth)
    for name in ("pose", "intrinsic"):
        (folder / name).mkdir(exist_ok=True)
    np.savetxt(folder / f"pose/{number}.txt", frame.given_world_from_camera, fmt="%f")
    fx, fy, cx, cy = frame.intrinsics
    for name, k in (("depth", (fx, fy, cx, cy)), ("color", (2 * fx, 2 * fy, 2 * cx + 0.5, 2 * cy + 0.5))):
        matrix = np.array([[k[0], 0, k[2], 0], [0, k[1], k[3], 0], [0, 0, 1, 0], [0, 0, 0, 1]])
        np.savetxt(folder / f"intrinsic/intrinsic_{name}.txt", matrix, fmt="%f")
    return {}


def write_replica(folder: Path, number: int, frame: Frame) -> dict[str, object]:
    write_image(folder / f"results/frame{number:06d}.jpg", frame.color)
    write_image(folder / f"results/depth{number:06d}.png", np.round(frame.depth * 6.5535).astype(np.uint16))
    with (folder / "traj.txt").open("a") as file:
        np.savetxt(file, frame.given_world_from_camera.reshape(1, 16))
    height, width = frame.depth.shape
    camera = dict(zip(("fx", "fy", "cx", "cy"), frame.intrinsics.tolist(), strict=True))
    text = json.dumps({"camera": camera | {"w": width, "h": height, "scale": 6553.5}})
    (folder.parent / "cam_params.json").write_text(text)
    return {}


def write_hm3dsem(folder: Path, number: int, frame: Frame) -> dict[str, object]:
    for name, image in (("rgb", frame.color), ("depth", frame.depth)):
        write_image(folder / f"{name}/scene_{number:06d}.png", image)
    (folder / "pose").mkdir(exist_ok=True)
    habitat_from_world = np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])  # (x, y, z) to (x, z, -y)
    pose = habitat_from_world @ frame.given_world_from_camera @ np.diag([1, -1, -1, 1])
    np.savetxt(folder / f"pose/scene_{number:06d}.txt", pose.reshape(1, 16), delimiter="\t")
    return {"intrinsics": frame.intrinsics.tolist()}


@pytest.mark.parametrize("write", [write_scannet, write_replica, write_hm3dsem])
def test_one_walk_in_each_format_is_the_same_world(write, tmp_path: Path):
    walk = list(drawn().source.frames())
    folder = tmp_path / "data" / "walk"
    settings: dict[str, object] = {}
    for frame in walk:
        assert frame.depth_unit_m == 0.001
        settings = write(folder, frame.frame_id, frame)
    found = list(detect_source(str(folder))(folder, settings).frames())
    assert len(found) == len(walk)
    for there, here in zip(found, walk, strict=True):
        there.check()
        clouds = [
            transform(
                one.given_world_from_camera, backproject(one.depth * np.float32(one.depth_unit_m), one.intrinsics)
            )
            for one in (there, here)
        ]
        np.testing.assert_allclose(*clouds, atol=1e-3)
        np.testing.assert_allclose(there.up_camera, here.up_camera, atol=1e-5)
        assert np.abs(there.color.astype(int) - here.color).mean() < 8  # JPEG of a noisy image; a wrong one: over 30
