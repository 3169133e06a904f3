from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from placegraph.nodes.camera import NODE, Camera, CameraConfig, detect, find
from placegraph.runtime.errors import ConfigError, SourceError
from placegraph.runtime.messages import End, Frame
from placegraph.runtime.node import Context


def camera(**settings: object) -> Camera:
    return NODE(CameraConfig.model_validate(settings), Context())


def drawn(**settings: object) -> Camera:
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
    assert detect(str(request.getfixturevalue(name))) is find({"seven": "sevenscenes"}.get(name, name))
    assert "placegraph.nodes.camera.oak" not in sys.modules


def test_auto_on_a_folder_of_two_formats_asks_which(seven: Path):
    (seven / "rgb.txt").touch()
    (seven / "depth.txt").touch()
    with pytest.raises(ConfigError, match="more than one format; set source to one of: sevenscenes, tum"):
        camera(path=str(seven))


def test_unknown_source_lists_the_choices():
    with pytest.raises(ConfigError, match=r"no camera source named 'webcam'.*flat"):
        find("webcam")


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
    node.source.poses = np.zeros((0, 4, 4))
    with pytest.raises(SourceError, match="flat: the source gave no frame"):
        list(node.messages())
