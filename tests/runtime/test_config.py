from pathlib import Path

import pytest

from placegraph.runtime.config import _order, build, read
from placegraph.runtime.errors import ConfigError, SourceError
from placegraph.runtime.messages import Frame, Keyframe, Pose, Segments
from placegraph.runtime.node import Context, Node

CAMERA = '[nodes.camera]\nsource = "flat"\n'


def written(folder: Path, text: str) -> Path:
    path = folder / "flow.toml"
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("", r"\[nodes\]: Field required"),
        ("[nodes", "flow.toml: "),
        ("[run]\nthreds = 2\n[nodes.camera]", r"\[run\] threds: unknown key, did you mean threads\?"),
        ('[bus]\nmulticast = "yes"\n[nodes.camera]', r"\[bus\] multicast: Input should be a valid boolean"),
        ("[extra]\n[nodes.camera]", r"\[extra\]: unknown key; there are: bus, nodes, run"),
        ('[run]\nlog_level = "LOUD"\n[nodes.camera]', r"\[run\] log_level: Input should be 'DEBUG', 'INFO'"),
        ("[run]\nthreads = 0\n[nodes.camera]", r"\[run\] threads: Input should be greater than or equal to 1"),
        ('[run]\nout_dir = ""\n[nodes.camera]', r"\[run\] out_dir: String should have at least 1 character"),
        ("[run]\nquestion_timeout_s = 0.0\n[nodes.camera]", r"\[run\] question_timeout_s: Input should be greater"),
        ("[run]\nquestion_timeout_s = nan\n[nodes.camera]", r"\[run\] question_timeout_s: Input should be a finite"),
        ("[run]\nquestion_timeout_s = 1e12\n[nodes.camera]", r"\[run\] question_timeout_s: Input should be less"),
        ('[bus]\nprefix = "a//b"\n[nodes.camera]', r"\[bus\] prefix: String should match pattern"),
        ('[bus]\nprefix = "a/*"\n[nodes.camera]', r"\[bus\] prefix: String should match pattern"),
    ],
)
def test_bad_files_name_the_key(tmp_path: Path, text: str, problem: str) -> None:
    with pytest.raises(ConfigError, match=problem):
        read(written(tmp_path, text))


def test_absent_file_lists_those_that_come_with_placegraph(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"no such dataflow file; with placegraph come: .*replay\.toml"):
        read(tmp_path / "nothing.toml")
    assert read(Path("configs/replay.toml")).nodes.keys() >= {"camera", "fusion"}
    assert read(Path("replay.toml")).nodes == read(Path("configs/replay.toml")).nodes


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("[nodes.pose]", "expected one source .*, found none"),
        (CAMERA + "[nodes.pos]", "no node named 'pos'; there are: .*pose"),
        (CAMERA + "[nodes.pose]\nstirde = 1", r"\[nodes.pose\] stirde: unknown key, did you mean stride\?"),
        (CAMERA + "[nodes.pose.rgbd]\nmin_inlier = 1", r"rgbd.min_inlier: unknown key, did you mean min_inliers\?"),
        (CAMERA + "[nodes.pose.rgbd.xyz]\nq = 1", r"\[nodes.pose\] rgbd.xyz: unknown key; there are: "),
        (CAMERA + '[nodes.pose]\nstride = "4"', r"\[nodes.pose\] stride: Input should be a valid integer"),
        (CAMERA + "[nodes.pose.kiss_icp]\nvoxel_m = 0.0", r"\[nodes.pose\] kiss_icp.voxel_m: Input should be greater"),
        (
            CAMERA + "[nodes.keyframe]",
            r"keyframe needs Pose, which no node produces: add \[nodes.playback\] or \[nodes.pose\]",
        ),
        (CAMERA + "[nodes.grounding]", r"grounding needs NamedGraph, which no node produces: add \[nodes.naming\]"),
        (CAMERA + "[nodes.grounding]\nroom_types = []", r"now called room_types of \[nodes.naming\]"),
        (
            CAMERA + '[nodes.pose]\n[nodes.keyframe]\n[nodes.tagger]\nmodel="a"\n[nodes.instances]\nmodel="b"\n'
            '[nodes.detector]\nmodel="c"',
            "Detections is produced by",
        ),
    ],
)
def test_bad_settings_and_wiring(tmp_path: Path, text: str, problem: str) -> None:
    with pytest.raises(ConfigError, match=problem):
        build(read(written(tmp_path, text)))


def test_a_missing_data_set_is_named(tmp_path: Path) -> None:
    with pytest.raises(SourceError, match="nowhere"):
        build(read(written(tmp_path, '[nodes.camera]\npath = "/nowhere"')))


def test_order_waits_and_model_folders(tmp_path: Path) -> None:
    text = '[run]\nmodel_dirs = ["weights"]\n' + CAMERA
    text += '[nodes.instances]\nmodel = "x"\n[nodes.keyframe]\n[nodes.pose]\n'
    flow = build(read(written(tmp_path, text)))
    assert list(flow.nodes) == ["camera", "pose", "keyframe", "instances"]
    assert flow.context.lossless and flow.context.model_dirs == (str(tmp_path / "weights"),)
    assert flow.producer(Pose) == "pose" and flow.consumers(Frame) == ["pose", "keyframe"]
    assert flow.consumers(Segments) == [] and flow.awaited_consumers("instances")["Segments"] == []
    assert flow.awaited_consumers("keyframe")["Keyframe"] == ["instances"] and flow.consumers(Keyframe) == ["instances"]


def test_a_data_set_in_real_time_is_live(tmp_path: Path) -> None:
    assert not build(read(written(tmp_path, CAMERA + "realtime = true"))).context.lossless


def test_a_cycle_is_refused_and_named() -> None:
    first, second = Node(None, Context()), Node(None, Context())
    first.inputs, first.outputs = (Pose,), (Keyframe,)
    second.inputs, second.outputs = (Keyframe,), (Pose,)
    with pytest.raises(ConfigError, match=r"has a cycle: (first|second) -> (first|second) -> (first|second)"):
        _order({"first": first, "second": second})
