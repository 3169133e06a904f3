import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import rerun as rr

from placegraph.runtime import messages as m
from placegraph.runtime.errors import ConfigError, SchemaError, SourceError
from placegraph.runtime.recording import RecordingWriter, images_of, kinds_in, properties, read

SCALARS = {int: 2**62 + 1, float: 0.1 + 0.2, bool: True, str: "ü \0 'q'\n"}


def filled(kind: type[m.Message], size: int, frame_id: int = 3, seed: int = 0) -> m.Message:
    """A message of a kind with arbitrary bits in every array, NaN payloads included; letters but H and W are `size`."""
    rng = np.random.default_rng(seed)
    fields: dict[str, object] = {}
    for name, spec in kind.array_specs().items():
        shape = []
        for want in spec.shape:
            if isinstance(want, int):
                shape.append(want)
            else:
                shape.append({"H": 5, "W": 7}.get(want, size + want.endswith("+1")))
        count = int(np.prod(shape)) * np.dtype(spec.dtype).itemsize
        fields[name] = rng.integers(0, 256, count, dtype=np.uint8).view(spec.dtype).reshape(shape)
    for name, hint in kind.scalar_types().items():
        fields[name] = ("", "é", "a b")[:size] if hint == tuple[str, ...] else SCALARS[hint]
    return kind(**{**fields, "frame_id": frame_id, "stamp_ns": 1_700_000_000_123_456_789})


def end(frame_id: int) -> m.End:
    return m.End(frame_id=frame_id, stamp_ns=frame_id, frames=frame_id)


def same(a: m.Message, b: m.Message) -> bool:
    arrays = all(
        (x.dtype, x.shape, x.tobytes()) == (y.dtype, y.shape, y.tobytes())
        for x, y in ((getattr(a, name), getattr(b, name)) for name in a.array_specs())
    )
    return type(a) is type(b) and arrays and all(getattr(a, n) == getattr(b, n) for n in a.scalar_types())


def record(path: Path, messages: list[m.Message], **said: str) -> Path:
    writer = RecordingWriter(path, "test", said)
    for message in messages:
        writer.write(message)
    writer.close()
    return path


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "run.rrd"


@pytest.mark.parametrize("kind", m.all_kinds(), ids=lambda kind: kind.__name__)
@pytest.mark.parametrize("size", [0, 1, 3])
def test_every_kind_comes_back_bit_for_bit(path: Path, kind: type[m.Message], size: int) -> None:
    written = [filled(kind, size, frame_id=i, seed=i) for i in range(3)]
    found = list(read(record(path, written), [kind]))
    assert len(found) == 3
    assert all(same(a, b) for a, b in zip(written, found, strict=True))
    assert not any(getattr(message, name).flags.writeable for message in found for name in kind.array_specs())


def test_non_contiguous_arrays_and_extreme_images_come_back(path: Path) -> None:
    color = np.zeros((4, 6, 3), np.uint8)
    color[1, 2] = (255, 0, 7)
    depth = np.array([[0, 1, 65535], [256, 255, 3]], np.uint16).repeat(2, 0).repeat(2, 1)
    keyframe = m.Keyframe(
        frame_id=0,
        stamp_ns=0,
        color=np.flip(color, axis=1),
        depth=depth[:, ::-1],
        depth_unit_m=0.001,
        intrinsics=np.ones(8)[::2],
        world_from_camera=np.arange(16.0).reshape(4, 4).T,
    )
    (found,) = read(record(path, [keyframe]), [m.Keyframe])
    assert same(keyframe, found)


def test_messages_come_back_in_the_order_they_were_written(path: Path) -> None:
    kinds = (m.Tags, m.End, m.Pose, m.Keyframe)
    rng = np.random.default_rng(1)
    written = [filled(kinds[k], 1, frame_id=int(rng.integers(0, 50))) for k in rng.integers(0, 4, 200)]
    found = list(read(record(path, written), [m.Pose, m.Keyframe, m.Tags, m.End, m.Pose]))
    assert [(type(x), x.frame_id) for x in found] == [(type(x), x.frame_id) for x in written]
    some = list(read(path, [m.Pose]))
    assert [x.frame_id for x in some] == [x.frame_id for x in written if type(x) is m.Pose]
    assert kinds_in(path) == {k.__name__: sum(type(x) is k for x in written) for k in sorted(kinds, key=str)}


def test_a_kind_that_was_not_recorded_gives_nothing(path: Path) -> None:
    record(path, [end(1)])
    assert list(read(path, [m.Map])) == []
    assert list(read(path, [])) == []


def test_an_empty_recording_is_readable(path: Path) -> None:
    record(path, [], version="1", note="ü")
    assert kinds_in(path) == {}
    assert properties(path) == {"note": "ü", "version": "1"}


def test_without_properties_there_are_none(path: Path) -> None:
    assert properties(record(path, [end(0)])) == {}


def test_messages_without_a_frame_are_drawn_at_the_newest_one(path: Path) -> None:
    from rerun.chunk import RrdReader

    record(path, [end(7), filled(m.Health, 1, frame_id=-1), end(2), filled(m.Health, 1, frame_id=-1)])
    frames = {
        chunk.entity_path: chunk.to_record_batch().column("frame").to_pylist()
        for chunk in RrdReader(str(path)).stream().filter(content="/messages/**")
    }
    assert frames == {"/messages/End": [7, 2], "/messages/Health": [7, 7]}
    assert [x.frame_id for x in read(path, [m.Health])] == [-1, -1]


def test_writing_a_wrong_message_is_refused(path: Path) -> None:
    writer = RecordingWriter(path, "test", {})
    try:
        with pytest.raises(SchemaError, match=r"Tags\.scores: expected dtype float32"):
            writer.write(m.Tags(frame_id=0, stamp_ns=0, names=(), scores=np.zeros(0)))
        empty = filled(m.Keyframe, 1)
        bad = m.Keyframe(
            **{**vars(empty), "color": np.zeros((0, 0, 3), np.uint8), "depth": np.zeros((0, 0), np.uint16)}
        )
        with pytest.raises(SchemaError, match=r"Keyframe\.color: an empty image"):
            writer.write(bad)
    finally:
        writer.close()


def test_images_of_gives_png_of_image_fields_only() -> None:
    assert set(images_of(filled(m.Frame, 1))) == {"color", "depth"}
    assert all(png.startswith(b"\x89PNG") for png in images_of(filled(m.Keyframe, 1)).values())
    assert images_of(filled(m.Map, 1)) == {}


def test_another_declaration_is_refused_naming_both(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    record(path, [end(0)])
    written = m.End.checksum()
    monkeypatch.setattr(m.End, "checksum", classmethod(lambda cls: "0badc0de"))
    with pytest.raises(SchemaError, match=rf"declaration {written}.*knows 0badc0de"):
        list(read(path, [m.End]))


def test_missing_file_folder_and_foreign_files(tmp_path: Path) -> None:
    with pytest.raises(SourceError, match="no such recording"):
        read(tmp_path / "absent.rrd", [m.End])
    with pytest.raises(SourceError, match="no such recording"):
        kinds_in(tmp_path)
    for content in (b"", b"hello" * 100, b"RRF2"):
        (tmp_path / "foreign.rrd").write_bytes(content)
        with pytest.raises(SchemaError, match=r"foreign\.rrd: not a readable recording.*rerun rrd filter"):
            properties(tmp_path / "foreign.rrd")


def test_a_recording_of_another_program_is_refused(path: Path) -> None:
    stream = rr.RecordingStream("someone_else")
    stream.set_sinks(rr.FileSink(str(path)))
    stream.log("x", rr.TextLog("hi"))
    stream.flush()
    stream.disconnect()
    with pytest.raises(SchemaError, match="written by 'someone_else'"):
        kinds_in(path)


def test_an_unknown_kind_is_named(path: Path) -> None:
    writer = RecordingWriter(path, "test", {})
    writer.stream.set_time("sequence", sequence=0)
    writer.stream.log("messages/Newer", rr.AnyValues(x=1))
    writer.close()
    with pytest.raises(SchemaError, match="kind Newer"):
        kinds_in(path)


def test_a_missing_field_is_named(path: Path) -> None:
    writer = RecordingWriter(path, "test", {})
    writer.stream.set_time("sequence", sequence=0)
    checksum = m.End.checksum()
    writer.stream.log("messages/End", rr.DynamicArchetype("End", components={"declaration_checksum": [checksum]}))
    writer.close()
    with pytest.raises(SchemaError, match="End number 0: the field frame_id is missing"):
        list(read(path, [m.End]))


def test_a_damaged_image_is_named(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from placegraph.runtime import recording

    monkeypatch.setattr(recording, "images_of", lambda message: {"color": b"no png", "depth": b"no png"})
    record(path, [filled(m.Keyframe, 1)])
    with pytest.raises(SchemaError, match="Keyframe number 0: color: damaged image"):
        list(read(path, [m.Keyframe]))


def _rerun() -> str:
    return str(Path(sys.executable).with_name("rerun"))


def test_a_cut_file_says_how_to_save_it_and_that_works(path: Path, tmp_path: Path) -> None:
    record(path, [filled(m.Map, 30_000, frame_id=i, seed=i) for i in range(8)])
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) * 2 // 3])
    with pytest.raises(SchemaError, match=r"`rerun rrd filter run.rrd -o recovered.rrd`"):
        read(path, [m.Map])
    saved = tmp_path / "recovered.rrd"
    subprocess.run([_rerun(), "rrd", "filter", str(path), "-o", str(saved)], check=True, capture_output=True)
    found = list(read(saved, [m.Map]))
    assert 2 <= len(found) < 8
    assert all(same(message, filled(m.Map, 30_000, frame_id=i, seed=i)) for i, message in enumerate(found))


def test_a_killed_writer_leaves_a_readable_recording(path: Path) -> None:
    code = (
        "import sys, time; from pathlib import Path; from placegraph.runtime import messages as m\n"
        "from placegraph.runtime.recording import RecordingWriter\n"
        "writer = RecordingWriter(Path(sys.argv[1]), 'killed', {'who': 'test'})\n"
        "for i in range(100): writer.write(m.End(frame_id=i, stamp_ns=i, frames=i))\n"
        "writer.stream.flush(); print('written', flush=True); time.sleep(60)"
    )
    with subprocess.Popen([sys.executable, "-c", code, str(path)], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "written\n"
        os.kill(process.pid, signal.SIGKILL)
    assert [x.frame_id for x in read(path, [m.End])] == list(range(100))
    assert properties(path) == {"who": "test"}


def test_two_recordings_in_one_file_are_refused(path: Path, tmp_path: Path) -> None:
    for name in ("a", "b"):
        writer = RecordingWriter(tmp_path / f"{name}.rrd", name, {})
        writer.write(end(0))
        writer.close()
    command = [_rerun(), "rrd", "merge", str(tmp_path / "a.rrd"), str(tmp_path / "b.rrd"), "-o", str(path)]
    subprocess.run(command, check=True, capture_output=True)
    with pytest.raises(SchemaError, match="expected one recording in the file, found 2"):
        kinds_in(path)


def test_rewritten_twice_into_one_recording_is_refused(path: Path, tmp_path: Path) -> None:
    for name in ("a", "b"):  # the same run id: Rerun takes both for one recording
        record(tmp_path / f"{name}.rrd", [end(0), end(1)])
    command = [_rerun(), "rrd", "merge", str(tmp_path / "a.rrd"), str(tmp_path / "b.rrd"), "-o", str(path)]
    subprocess.run(command, check=True, capture_output=True)
    with pytest.raises(SchemaError, match=r"End number . comes after number ."):
        list(read(path, [m.End]))


def test_what_cannot_be_written_is_a_config_error(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"absent/run\.rrd: No such file"):
        RecordingWriter(tmp_path / "absent" / "run.rrd", "test", {})
    with pytest.raises(ConfigError, match="a file, a viewer port, or both"):
        RecordingWriter(None, "test", {})


def test_a_full_disk_is_a_config_error_said_once(path: Path) -> None:
    # A limit on the file's size stands for the disk; it is for ever, so another process takes it.
    code = (
        "import resource, signal, sys; from pathlib import Path; from placegraph.runtime import messages as m\n"
        "from placegraph.runtime.errors import ConfigError\n"
        "from placegraph.runtime.recording import RecordingWriter\n"
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))\n"
        "writer = RecordingWriter(Path(sys.argv[1]), 'full', {})\n"
        "answer = m.Answer(frame_id=-1, stamp_ns=0, question_id='q', json='x' * 300_000)\n"
        "try:\n"
        "    for _ in range(100): writer.write(answer)\n"
        "except ConfigError as error: print(error)\n"
        "writer.close()"
    )
    done = subprocess.run([sys.executable, "-c", code, str(path)], capture_output=True, text=True, check=True)
    assert f"{path}: cannot write the recording any further (is the disk full?)" in done.stdout


def test_reading_is_lazy(path: Path) -> None:
    found = read(record(path, [end(i) for i in range(10)]), [m.End])
    assert isinstance(found, Iterator)
    assert next(found).frame_id == 0


@pytest.mark.bus
def test_a_taken_viewer_port_is_a_config_error() -> None:
    import socket

    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(ConfigError, match=f"viewer port {port} on 127.0.0.1: Address already in use"):
            RecordingWriter(None, "test", {}, viewer_port=port)


@pytest.mark.bus
def test_the_viewer_port_is_on_loopback_only() -> None:
    import socket

    import psutil

    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    writer = RecordingWriter(None, "test", {}, viewer_port=port)
    try:
        listening = [c.laddr for c in psutil.Process().net_connections() if c.status == psutil.CONN_LISTEN]
        assert [address.ip for address in listening if address.port == port] == ["127.0.0.1"]
    finally:
        writer.close()
