from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from placegraph.nodes.playback import NODE, PlaybackConfig
from placegraph.runtime import messages as m
from placegraph.runtime.errors import ConfigError, SourceError
from placegraph.runtime.node import Context
from placegraph.runtime.recording import RecordingWriter


def pose(frame_id: int) -> m.Pose:
    return m.Pose(
        frame_id=frame_id,
        stamp_ns=frame_id * 7,
        world_from_camera=np.eye(4),
        trusted=True,
        quality=1.0,
        residual_m=0.0,
        innovation_m=0.0,
        reason="",
    )


def keyframe(frame_id: int) -> m.Keyframe:
    return m.Keyframe(
        frame_id=frame_id,
        stamp_ns=frame_id * 7,
        color=np.full((2, 3, 3), frame_id, np.uint8),
        depth=np.full((2, 3), frame_id, np.uint16),
        depth_unit_m=0.001,
        intrinsics=np.ones(4),
        world_from_camera=np.eye(4),
    )


LAST = m.LastKeyframe(frame_id=2, stamp_ns=14, keyframes=2)


def recorded(tmp_path: Path, *messages: m.Message) -> str:
    path = tmp_path / "run.rrd"
    writer = RecordingWriter(path, "test", {})
    for message in messages:
        writer.write(message)
    writer.close()
    return str(path)


def playback(path: str, **settings: Any) -> Any:
    return NODE(PlaybackConfig.model_validate({"path": path, **settings}), Context())


def said(node: Any) -> list[tuple[str, int]]:
    return [(type(message).__name__, message.frame_id) for message in node.messages()]


def test_gives_its_kinds_in_recorded_order(tmp_path: Path) -> None:
    tags = m.Tags(frame_id=0, stamp_ns=0, names=(), scores=np.zeros(0, np.float32))
    node = playback(recorded(tmp_path, pose(0), keyframe(0), tags, pose(1), pose(2), keyframe(2), LAST))
    expected = [("Pose", 0), ("Keyframe", 0), ("Pose", 1), ("Pose", 2), ("Keyframe", 2), ("LastKeyframe", 2)]
    assert said(node) == expected
    assert said(node) == expected  # it may be asked again
    assert node.outputs == (m.Pose, m.Keyframe, m.LastKeyframe)
    assert node.inputs == ()
    assert node.is_lossless()


def test_kinds_as_toml_gives_them(tmp_path: Path) -> None:
    path = recorded(tmp_path, pose(0), keyframe(0), pose(1), LAST)
    node = playback(path, kinds=["Pose"])
    assert node.outputs == (m.Pose,)
    assert said(node) == [("Pose", 0), ("Pose", 1)]


@pytest.mark.parametrize(
    ("kinds", "problem"),
    [
        (["Pose", "Photo"], "no message 'Photo'; there are: .*Keyframe"),
        (["Message"], "no message 'Message'"),
        (["Pose", "Pose"], "each kind once"),
        ([], "at least one"),
    ],
)
def test_wrong_kinds(kinds: list[str], problem: str) -> None:
    with pytest.raises(ConfigError, match=rf"\[nodes\.playback\] kinds: .*{problem}"):
        playback("x.rrd", kinds=kinds)


@pytest.mark.parametrize("settings", [{}, {"path": 3}, {"path": "x", "kinds": [1]}, {"path": "x", "kind": ["Pose"]}])
def test_settings_are_strict(settings: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        PlaybackConfig.model_validate(settings)


def test_a_missing_file() -> None:
    with pytest.raises(SourceError, match="no such recording"):
        next(playback("absent.rrd").messages())


def test_no_keyframe(tmp_path: Path) -> None:
    with pytest.raises(SourceError, match="has no Keyframe, only: nothing"):
        next(playback(recorded(tmp_path)).messages())
    with pytest.raises(SourceError, match="has no Keyframe, only: LastKeyframe, Pose"):
        next(playback(recorded(tmp_path, pose(0), LAST)).messages())


def test_frames_without_keyframes_point_to_the_camera(tmp_path: Path) -> None:
    shot = keyframe(0)
    frame = m.Frame(
        frame_id=0,
        stamp_ns=0,
        color=shot.color,
        depth=shot.depth,
        depth_unit_m=0.001,
        intrinsics=shot.intrinsics,
        given_world_from_camera=np.eye(4),
        up_camera=np.zeros(3),
    )
    with pytest.raises(SourceError, match="1 Frame messages: read it as a camera's source"):
        next(playback(recorded(tmp_path, frame)).messages())


def test_a_recording_cut_before_its_end_names_the_remedy(tmp_path: Path) -> None:
    path = recorded(tmp_path, pose(0), keyframe(0), keyframe(5), pose(6))
    with pytest.raises(SourceError, match=r"no LastKeyframe.*`incomplete = true` in \[nodes\.playback\]"):
        next(playback(path).messages())
    *rest, last = list(playback(path, incomplete=True).messages())
    assert len(rest) == 4
    assert isinstance(last, m.LastKeyframe)
    assert (last.frame_id, last.stamp_ns, last.keyframes) == (5, 35, 2)


def test_incomplete_adds_nothing_to_a_complete_recording(tmp_path: Path) -> None:
    node = playback(recorded(tmp_path, keyframe(0), keyframe(2), LAST), incomplete=True)
    assert said(node) == [("Keyframe", 0), ("Keyframe", 2), ("LastKeyframe", 2)]


def test_without_the_last_keyframe_kind_none_is_asked_for(tmp_path: Path) -> None:
    node = playback(recorded(tmp_path, keyframe(0)), kinds=["Keyframe"])
    assert said(node) == [("Keyframe", 0)]


def test_told_to_end_it_says_which_keyframe_was_the_last(tmp_path: Path) -> None:
    node = playback(recorded(tmp_path, pose(0), keyframe(0), pose(2), keyframe(2), LAST))
    given = []
    for message in node.messages():
        given.append((type(message).__name__, message.frame_id))
        node.ending = isinstance(message, m.Keyframe)
    assert given == [("Pose", 0), ("Keyframe", 0), ("LastKeyframe", 0)]
