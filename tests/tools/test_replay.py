import json
import shutil

import msgpack
import pytest

from placegraph.runtime import messages as m
from placegraph.runtime.bus.flow_control import Envelope
from placegraph.runtime.bus.session import BusConfig
from placegraph.runtime.errors import SchemaError
from placegraph.runtime.messages.codec import encode
from placegraph.runtime.node import Context, build_node
from placegraph.runtime.process import NodeProcess, ProcessSpec
from placegraph.runtime.recording import RecordingWriter, read

QUIET_NODE = {"use_model": False}


def test_the_same_recording_gives_the_same_bytes(cli, mapped, tmp_path) -> None:
    for name in ("one", "two"):
        done = cli("replay", mapped / "run.rrd", "--inline", "--quiet", "--out", tmp_path / name)
        assert done.code == 0, done.err
        assert done.out.endswith(f"map        {tmp_path / name}\n")
    for name in ("graph.json", "cloud.ply", "objects.ply", "trajectory.txt"):
        first = (tmp_path / "one" / name).read_bytes()
        assert first == (tmp_path / "two" / name).read_bytes() == (mapped / name).read_bytes(), name
    effective = json.loads((tmp_path / "one" / "run.json").read_text())["effective"]
    assert "playback" in effective and not {"camera", "pose", "keyframe"} & set(effective)


def test_another_dataflow_can_be_named(cli, mapped, folder_flow, tmp_path) -> None:
    shutil.copy(mapped / "run.rrd", tmp_path / "alone.rrd")
    missing = cli("replay", tmp_path / "alone.rrd", "--inline")
    assert missing.code == 2
    assert (
        missing.reason
        == f"{tmp_path / 'alone.rrd'}: there is no run.json beside it; name a dataflow file with --config"
    )
    done = cli(
        "replay", tmp_path / "alone.rrd", "--config", folder_flow, "--inline", "--quiet", "--out", tmp_path / "m"
    )
    assert done.code == 0, done.err
    assert (tmp_path / "m" / "graph.json").read_bytes() == (mapped / "graph.json").read_bytes()


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ("", "cannot read: "),
        ("[]", "expected an object, found list"),
        ("{}", "config: Input should be"),
        ('{"config": {"nodes": {}, "walls": 1}}', "config.walls: Extra inputs are not permitted"),
    ],
)
def test_a_run_json_of_another_kind(cli, mapped, tmp_path, content, reason) -> None:
    shutil.copy(mapped / "run.rrd", tmp_path / "run.rrd")
    (tmp_path / "run.json").write_text(content)
    done = cli("replay", tmp_path / "run.rrd", "--inline")
    assert done.code == 1 and done.reason.startswith(f"{tmp_path / 'run.json'}: {reason}")


def test_no_recording(cli, tmp_path) -> None:
    done = cli("replay", tmp_path / "run.rrd")
    assert (done.code, done.reason) == (1, f"{tmp_path / 'run.rrd'}: no such recording")


def copy_of(mapped, folder):
    for name in ("run.rrd", "run.json"):
        shutil.copy(mapped / name, folder / name)
    return folder / "run.rrd"


@pytest.mark.parametrize("share", [0.0, 0.01, 0.5, 0.9])
def test_a_recording_cut_in_the_middle(cli, mapped, tmp_path, share) -> None:
    path = copy_of(mapped, tmp_path)
    path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
    done = cli("replay", path, "--inline", "--quiet", "--out", tmp_path / "m")
    assert done.code == 1 and done.out == ""
    assert done.reason.startswith(f"{path}: ")
    assert not (tmp_path / "m" / "graph.json").exists()


def test_a_recording_of_another_version(cli, mapped, tmp_path, monkeypatch) -> None:
    path = copy_of(mapped, tmp_path)
    with monkeypatch.context() as other:
        messages = list(read(path, (m.Pose, m.Keyframe, m.LastKeyframe)))
        other.setattr(m.Keyframe, "checksum", classmethod(lambda cls: "0badc0de"))
        writer = RecordingWriter(path, "test", {})
        for message in messages:
            writer.write(message)
        writer.close()
    done = cli("replay", path, "--inline", "--quiet", "--out", tmp_path / "m")
    assert done.code == 1
    assert done.reason.startswith(f"{path}: Keyframe number ")
    assert f"recorded as declaration 0badc0de, this version of placegraph knows {m.Keyframe.checksum()}" in done.reason


@pytest.fixture
def crash(tmp_path):
    """The crash file that the shell wrote when a broken graph reached the grounding node."""
    spec = ProcessSpec(
        node="grounding", settings=QUIET_NODE, context=Context(out_dir=str(tmp_path)), question_timeout_s=1.0,
        bus=BusConfig(endpoint="tcp/127.0.0.1:1", prefix="test"), consumers={},
    )  # fmt: skip
    process = NodeProcess(spec, build_node("grounding", QUIET_NODE, spec.context))
    graph = m.NamedGraph(frame_id=7, stamp_ns=0, revision=2, final=False, place_types=(), json="{")
    process.inbox.put(Envelope(m.NamedGraph, 1, encode(graph)))
    process.stop()
    with pytest.raises(SchemaError):
        process.run()
    return tmp_path / "crash" / "grounding.rec"


def test_a_crash_happens_again(cli, crash) -> None:
    done = cli("replay", crash)
    assert done.code == 1
    assert done.out.startswith("grounding ended with:\nTraceback") and done.out.endswith("step NamedGraph of frame 7\n")
    assert done.reason.startswith("NamedGraph of revision 2: not JSON")


def test_a_step_that_goes_well_here_says_what_it_gives(cli, crash, mapped) -> None:
    spec, trace, _ = msgpack.unpackb(crash.read_bytes())
    text = (mapped / "graph.json").read_text()
    good = m.NamedGraph(frame_id=7, stamp_ns=0, revision=2, final=False, place_types=(), json=text)
    crash.write_bytes(msgpack.packb([spec, trace, [["NamedGraph", encode(good)]]]))
    done = cli("replay", crash)
    assert (done.code, done.err) == (0, "")
    assert done.out.endswith("step NamedGraph of frame 7\n")


def test_a_recorders_crash_does_not_write_over_the_recording(cli, crash, tmp_path) -> None:
    (tmp_path / "run.rrd").write_bytes(b"precious")
    spec, trace, _ = msgpack.unpackb(crash.read_bytes())
    recorder = json.loads(spec) | {"node": "recorder", "settings": {}}
    end = m.End(frame_id=3, stamp_ns=0, frames=4)
    crash.write_bytes(msgpack.packb([json.dumps(recorder), trace, [["End", encode(end)]]]))
    assert cli("replay", crash).code == 0
    assert (tmp_path / "run.rrd").read_bytes() == b"precious"


@pytest.mark.parametrize(
    "content",
    [b"", b"not msgpack", msgpack.packb(3), msgpack.packb([1, 2, 3]), msgpack.packb(["{}", "", []]),
     msgpack.packb(["{}", "", [["Wall", b""]]]), msgpack.packb(["{}", "", [["Graph", b""]]])],
)  # fmt: skip
def test_a_file_that_is_no_crash_file(cli, tmp_path, content) -> None:
    (tmp_path / "a.rec").write_bytes(content)
    done = cli("replay", tmp_path / "a.rec")
    assert done.code == 1 and done.out == "" and done.reason.startswith(f"{tmp_path / 'a.rec'}: ")


def test_a_crash_file_of_another_version(cli, crash, monkeypatch) -> None:
    monkeypatch.setattr(m.NamedGraph, "checksum", classmethod(lambda cls: "0badc0de"))
    done = cli("replay", crash)
    assert done.code == 1
    assert done.reason.startswith(f"{crash}: NamedGraph: the payload was declared as ") and "0badc0de" in done.reason


def test_no_crash_file(cli, tmp_path) -> None:
    done = cli("replay", tmp_path / "a.rec")
    assert (done.code, done.reason) == (1, f"{tmp_path / 'a.rec'}: cannot read: No such file or directory")
