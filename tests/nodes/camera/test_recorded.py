from pathlib import Path

import numpy as np
import pytest

from placegraph.nodes.camera.recorded import SOURCE
from placegraph.runtime import messages as m
from placegraph.runtime.arrays import F64
from placegraph.runtime.errors import ConfigError, SchemaError, SourceError
from placegraph.runtime.recording import RecordingWriter


def frame(frame_id: int, pose: F64) -> m.Frame:
    return m.Frame(
        frame_id=frame_id,
        stamp_ns=1_000_000_007 * (frame_id + 1),
        color=np.random.default_rng(frame_id).integers(0, 256, (4, 6, 3), dtype=np.uint8),
        depth=np.full((4, 6), 60_000 + frame_id, np.uint16),
        depth_unit_m=0.0002,
        intrinsics=np.array([5.0, 5.0, 3.0, 2.0]),
        given_world_from_camera=pose,
        up_camera=np.array([0.0, -1.0, 0.0]),
    )


NO_POSE = np.full((4, 4), np.nan)


def recorded(tmp_path: Path, *messages: m.Message) -> Path:
    path = tmp_path / "run.rrd"
    writer = RecordingWriter(path, "test", {})
    for message in messages:
        writer.write(message)
    writer.close()
    return path


def test_frames_come_back_exactly(tmp_path: Path) -> None:
    written = [frame(i, NO_POSE) for i in (4, 5, 7)]
    source = SOURCE(recorded(tmp_path, *written), {})
    found = list(source.frames())
    assert [(f.frame_id, f.stamp_ns) for f in found] == [(f.frame_id, f.stamp_ns) for f in written]
    for a, b in zip(written, found, strict=True):
        for name in m.Frame.array_specs():
            assert getattr(a, name).tobytes() == getattr(b, name).tobytes()
        assert a.depth_unit_m == b.depth_unit_m
    assert len(list(source.frames())) == 3  # it may be asked again
    assert source.given_poses() is None
    assert not source.live


def test_given_poses_are_those_of_the_frames_that_carry_one(tmp_path: Path) -> None:
    pose = np.eye(4)
    pose[0, 3] = 2.5
    written = [frame(0, NO_POSE), frame(1, pose)]
    poses = SOURCE(recorded(tmp_path, *written), {}).given_poses()
    assert poses is not None
    assert list(poses) == [written[1].stamp_ns]
    assert np.array_equal(poses[written[1].stamp_ns], pose)


def test_matches_files_by_name_only(tmp_path: Path) -> None:
    (tmp_path / "a.rrd").write_bytes(b"")
    (tmp_path / "a.mp4").write_bytes(b"")
    (tmp_path / "folder.rrd").mkdir()
    assert SOURCE.matches(tmp_path / "a.rrd")
    assert not SOURCE.matches(tmp_path / "a.mp4")
    assert not SOURCE.matches(tmp_path / "absent.rrd")
    assert not SOURCE.matches(tmp_path / "folder.rrd")
    assert ".rrd" in SOURCE.summary


def test_a_recording_of_keyframes_points_to_replay(tmp_path: Path) -> None:
    shot = frame(0, np.eye(4))
    keyframe = m.Keyframe(
        frame_id=0,
        stamp_ns=0,
        color=shot.color,
        depth=shot.depth,
        depth_unit_m=0.001,
        intrinsics=shot.intrinsics,
        world_from_camera=np.eye(4),
    )
    path = recorded(tmp_path, keyframe)
    with pytest.raises(SourceError, match=r"keyframes only.*`placegraph replay run\.rrd`.*frames = true"):
        SOURCE(path, {})


def test_no_frames_at_all(tmp_path: Path) -> None:
    with pytest.raises(SourceError, match="holds no Frame, only: nothing"):
        SOURCE(recorded(tmp_path), {})
    with pytest.raises(SourceError, match="holds no Frame, only: End"):
        SOURCE(recorded(tmp_path, m.End(frame_id=-1, stamp_ns=0, frames=0)), {})


def test_missing_and_damaged_files(tmp_path: Path) -> None:
    with pytest.raises(SourceError, match="no such recording"):
        SOURCE(tmp_path / "absent.rrd", {})
    (tmp_path / "a.rrd").write_bytes(b"nothing of the kind")
    with pytest.raises(SchemaError, match="not a readable recording"):
        SOURCE(tmp_path / "a.rrd", {})


def test_settings_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"\[nodes\.camera\] settings: .*rate_hz"):
        SOURCE(recorded(tmp_path, frame(0, NO_POSE)), {"rate_hz": 30})
