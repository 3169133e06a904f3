import importlib.util
import json
import subprocess
import sys

import pytest

START = '[nodes.camera]\nsource = "flat"\n[nodes.pose]\n[nodes.keyframe]\n'


@pytest.fixture
def config(tmp_path):
    path = tmp_path / "flow.toml"

    def write(text):
        path.write_text(text)
        return path

    return write


def test_effective_settings_with_their_defaults(cli, drawn_flow) -> None:
    done = cli("check", drawn_flow)
    assert done.code == 0 and done.err == ""
    lines = done.out.splitlines()
    assert lines[0] == f"{drawn_flow}: 9 nodes, replay"
    assert lines[1:3] == ["[nodes.camera]", '  source = "flat"']
    assert '  method = "given"' in lines and "  realtime = false" in lines


def test_effective_settings_as_json(cli, drawn_flow) -> None:
    found = json.loads(cli("check", drawn_flow, "--json").out)
    assert set(found) == {"run", "bus", "nodes"}
    assert next(iter(found["nodes"])) == "camera" and len(found["nodes"]) == 9
    assert found["nodes"]["pose"]["method"] == "given" and found["nodes"]["camera"]["limit"] == 20
    assert found["run"]["threads"] == 1 and found["bus"]["prefix"] == "placegraph"


@pytest.mark.skipif(importlib.util.find_spec("depthai") is None, reason="the extra `oak` is not installed")
def test_json_is_alone_on_standard_output_also_with_a_camera_whose_library_prints(config) -> None:
    # as a program: what a library prints from C goes past a stream that Python has replaced
    path = config('[nodes.camera]\nsource = "oak"\n[nodes.pose]\n')
    command = [sys.executable, "-m", "placegraph.tools.cli", "check", str(path), "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert json.loads(done.stdout)["nodes"]["camera"]["source"] == "oak" and done.stderr == ""


def test_realtime_is_said_to_be_live(cli, config) -> None:
    done = cli("check", config(START.replace("[nodes.pose]", "realtime = true\n[nodes.pose]", 1)))
    assert done.out.splitlines()[0].endswith("3 nodes, live")


def test_a_source_is_checked_with_it(cli, folder_flow, seven, tmp_path) -> None:
    assert cli("check", folder_flow, "--source", seven).code == 0
    absent = cli("check", folder_flow, "--source", tmp_path / "absent")
    assert (absent.code, absent.reason) == (1, f"{tmp_path / 'absent'}: no such file or folder")


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "flow.toml: [nodes]: Field required"),
        ("[nodes", "flow.toml: Expected ']' at the end of a table declaration"),
        ("[nodes]\n[run]\nthreads = 0\n", "flow.toml: [run] threads: Input should be greater than or equal to 1"),
        (START + "gian = 1\n", "[nodes.keyframe] gian: unknown key; there are: "),
        (START + 'stride = "2"\n[nodes.poze]\n', "[nodes.keyframe] stride: unknown key; there are: "),
        (START + "[nodes.poze]\n", "no node named 'poze'; there are: camera, "),
        (START + "[nodes.instances]\n[nodes.instances.model]\na = 1\n", "[nodes.instances] model: "),
        ('[nodes.camera]\nsource = "synthetik"\n', "no camera source named 'synthetik'; there are: flat, "),
        ("[nodes.camera]\n", "[nodes.camera] path is empty: give a path, or a source: "),
        (
            START.replace("[nodes.pose]", "[nodes.camera.settings]\nwdth = 9\n[nodes.pose]"),
            "[nodes.camera.settings] wdth: ",
        ),
        ('[nodes.camera]\nsource = "flat"\n[nodes.fusion]\n', "fusion needs Keyframe, which no node produces"),
        ("[nodes.pose]\n", "expected one source (camera or playback), found none"),
    ],
)
def test_a_wrong_dataflow_file_is_2_and_names_the_key(cli, config, text, reason) -> None:
    done = cli("check", config(text))
    assert done.code == 2 and done.out == ""
    assert reason in done.reason


def test_a_file_that_is_no_text(cli, tmp_path) -> None:
    (tmp_path / "flow.toml").write_bytes(b"\xff\xfe\x00")
    done = cli("check", tmp_path / "flow.toml")
    assert done.code == 2 and f"{tmp_path / 'flow.toml'}: 'utf-8' codec" in done.reason


def test_missing_weights_are_1_and_every_folder_searched_is_named(cli, config, tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("PLACEGRAPH_MODELS", str(tmp_path / "mine"))
    text = '[run]\nmodel_dirs = ["a", "/nowhere/b"]\n' + START + '[nodes.instances]\nmodel = "yolov8n_seg_320"\n'
    done = cli("check", config(text))
    assert done.code == 1 and done.out == ""
    assert done.reason.startswith("weights 'yolov8n_seg_320': yolov8n-seg_320_w8.onnx (model) is in none of: ")
    for folder in ("models_onnx/embedded", "models_onnx/weights", tmp_path / "a", "/nowhere/b", tmp_path / "mine"):
        assert str(folder) in done.reason


def test_unknown_weights_name_the_choices(cli, config) -> None:
    done = cli("check", config(START + '[nodes.instances]\nmodel = "nope"\n'))
    assert done.code == 1 and done.reason.startswith("no weights named 'nope'; there are: drawn_scene, ")
