import json
import re

import cv2
import numpy as np
import pytest

from placegraph.nodes.camera.flat import Flat
from placegraph.runtime.bus.session import Bus, BusConfig, free_endpoint
from placegraph.runtime.scene_graph import SceneGraph


def test_a_map_folder_holds_all_that_the_run_found(mapped) -> None:
    names = {path.name for path in mapped.iterdir()}
    files = {"graph.json", "cloud.ply", "objects.ply", "retired.json", "trajectory.txt", "run.json", "run.rrd"}
    assert names == files
    graph = SceneGraph.load(mapped / "graph.json")
    assert graph.to_json() + "\n" == (mapped / "graph.json").read_text()
    assert len(graph.layer("floor")) == 1 and len(graph.layer("room")) >= 1
    assert {"chair", "table"} <= {node.tags[0].name for node in graph.layer("object")}


@pytest.mark.parametrize(
    ("name", "row", "last"),
    [
        ("cloud.ply", [("xyz", "<f4", 3), ("rgb", "u1", 3)], b"property uchar blue"),
        ("objects.ply", [("xyz", "<f4", 3), ("object", "<i4")], b"property int object"),
    ],
)
def test_point_files_hold_what_their_header_says(mapped, name, row, last) -> None:
    head, body = (mapped / name).read_bytes().split(b"\nend_header\n", 1)
    lines = head.split(b"\n")
    assert lines[:2] == [b"ply", b"format binary_little_endian 1.0"] and lines[-1] == last
    count = int(re.fullmatch(rb"element vertex (\d+)", lines[2])[1])
    assert len(body) == count * np.dtype(row).itemsize and count > 1000
    points = np.frombuffer(body, row)
    graph = SceneGraph.load(mapped / "graph.json")
    low, high = graph.building.box
    assert (points["xyz"] > low - 1).all() and (points["xyz"] < high + 1).all()
    if name == "objects.ply":
        assert {f"O{number}" for number in points["object"]} >= {node.id for node in graph.layer("object")}


def test_the_trajectory_is_that_of_the_walk(mapped) -> None:
    header, *lines = (mapped / "trajectory.txt").read_text().splitlines()
    assert header == "# seconds tx ty tz qx qy qz qw" and len(lines) == 20
    rows = np.array([line.split() for line in lines], float)
    given = Flat(mapped, {"width": 160, "height": 120}).given_poses()
    for (stamp_ns, pose), row in zip(list(given.items())[:20], rows, strict=True):
        assert row[0] == pytest.approx(stamp_ns / 1e9) and row[1:4] == pytest.approx(pose[:3, 3], abs=1e-6)
    assert np.linalg.norm(rows[:, 4:], axis=1) == pytest.approx(1)


def test_run_json_tells_what_ran_and_what_came_out(mapped) -> None:
    found = json.loads((mapped / "run.json").read_text())
    assert set(found) == {"config", "effective", "versions", "commit", "summary"}
    assert found["config"]["nodes"]["pose"] == {"method": "given"}
    assert list(found["effective"]) == sorted(found["config"]["nodes"]) and found["effective"]["pose"]["stride"] >= 1
    assert re.match(r"3\.\d+\.\d+", found["versions"]["python"])
    assert all(version != "not installed" for version in found["versions"].values())
    summary = found["summary"]
    assert summary["frames"] == 20 and 1 < summary["keyframes"] <= 20 and summary["untrusted_poses"] == 0
    assert summary["trajectory"]["ate_max_m"] == 0.0
    assert set(summary["nodes"]) == set(found["effective"])
    assert set(summary["nodes"]["pose"]) == {"steps", "p50_ms", "p95_ms", "drops", "memory_mb"}
    graph = SceneGraph.load(mapped / "graph.json")
    assert summary["graph"] == {layer: len(graph.layer(layer)) for layer in ("floor", "room", "location", "object")}


def test_the_same_again_is_the_same_map(cli, drawn_flow, mapped, tmp_path) -> None:
    done = cli("run", drawn_flow, "--inline", "--out", tmp_path / "again")
    assert done.code == 0
    for name in ("graph.json", "cloud.ply", "objects.ply", "trajectory.txt"):
        assert (tmp_path / "again" / name).read_bytes() == (mapped / name).read_bytes(), name
    assert f"map        {tmp_path / 'again'}\n" in done.out and f"placegraph ask {tmp_path / 'again'} " in done.out
    assert re.search(r"^20 frames \(\d+ keyframes, 0 untrusted\) in \d", done.out, re.MULTILINE)
    assert re.search(r"^graph: 1 floor, 1 room, 0 locations, \d+ objects$", done.out, re.MULTILINE)


def test_without_out_folders_are_numbered_and_limit_ends_early(cli, folder_flow, seven, tmp_path) -> None:
    for number in (1, 2):
        assert cli("run", folder_flow, "--source", seven, "--inline", "--quiet", "--limit", 2).code == 0
        folder = tmp_path / "out" / f"folder-{number:03d}"
        assert len((folder / "trajectory.txt").read_text().splitlines()) == 1 + 2


def test_a_source_given_replaces_the_one_that_the_config_names(cli, drawn_flow, seven, tmp_path) -> None:
    done = cli("run", drawn_flow, "--source", seven, "--inline", "--quiet", "--out", tmp_path / "m")
    assert done.code == 0, done.err
    config = json.loads((tmp_path / "m" / "run.json").read_text())["config"]
    assert config["nodes"]["camera"] == {"limit": 20, "path": str(seven), "settings": {}, "source": "auto"}
    assert len((tmp_path / "m" / "trajectory.txt").read_text().splitlines()) == 1 + 4


def test_a_folder_that_is_not_empty_is_left_as_it_is(cli, drawn_flow, tmp_path) -> None:
    out = tmp_path / "mine"
    out.mkdir()
    (out / "graph.json").write_text("precious")
    done = cli("run", drawn_flow, "--inline", "--quiet", "--out", out)
    assert done.code == 2 and done.out == ""
    assert done.reason == f"{out}: exists and is not an empty folder; choose another --out or remove it"
    assert [path.name for path in out.iterdir()] == ["graph.json"] and (out / "graph.json").read_text() == "precious"
    file = cli("run", drawn_flow, "--inline", "--quiet", "--out", out / "graph.json")
    assert file.code == 2 and (out / "graph.json").read_text() == "precious"


def test_inline_cannot_stay(cli, drawn_flow) -> None:
    done = cli("run", drawn_flow, "--inline", "--stay")
    assert done.code == 2 and done.reason == "--stay needs processes: an inline run has no bus to answer on"


def cut(path, keep=0.5):
    path.write_bytes(path.read_bytes()[: int(keep * path.stat().st_size)])


def intrinsics(matrix):
    return lambda folder: np.savetxt(folder / "camera-intrinsics.txt", matrix)


@pytest.mark.parametrize(
    ("name", "damage", "reason"),
    [
        ("frame-000002.depth.png", lambda f: cut(f / "frame-000002.depth.png"), r"not a whole image \(\d+ bytes\)"),
        ("frame-000002.color.jpg", lambda f: cut(f / "frame-000002.color.jpg"), r"not a whole image \(\d+ bytes\)"),
        ("frame-000002.color.jpg", lambda f: cut(f / "frame-000002.color.jpg", 0), r"not a whole image \(0 bytes\)"),
        ("frame-000002.depth.png", lambda f: (f / "frame-000002.depth.png").unlink(), "No such file"),
        ("frame-000002.pose.txt", lambda f: (f / "frame-000002.pose.txt").unlink(), "No such file"),
        ("frame-000002.pose.txt", lambda f: (f / "frame-000002.pose.txt").write_text("1 2"), r"a pose matrix \(4x4"),
        ("frame-000002.pose.txt", lambda f: np.savetxt(f / "frame-000002.pose.txt", np.ones((4, 4))), "not a rigid"),
        (
            "frame-000002.depth.png",
            lambda f: cv2.imwrite(str(f / "frame-000002.depth.png"), np.ones((4, 4), np.uint16)),
            "depth is 4x4, its colour image is 64x48",
        ),
        (
            "frame-000002.depth.png",
            lambda f: cv2.imwrite(str(f / "frame-000002.depth.png"), np.ones((48, 64), np.uint8)),
            "depth must be 16 bit of one channel, found uint8",
        ),
        ("camera-intrinsics.txt", intrinsics([[-40, 0, 32], [0, 40, 24], [0, 0, 1]]), "four positive numbers.*-40"),
        ("camera-intrinsics.txt", intrinsics([[40, 0, 32], [0, 40, 24]]), r"a camera matrix \(3x3"),
        (
            "camera-intrinsics.txt",
            intrinsics([[40, 0, 320], [0, 40, 24], [0, 0, 1]]),
            r"\(320, 24\) is outside the 64x48",
        ),
        ("camera-intrinsics.txt", intrinsics([[np.nan, 0, 32], [0, 40, 24], [0, 0, 1]]), "four positive numbers.*nan"),
        ("camera-intrinsics.txt", intrinsics([[40, 5, 32], [0, 40, 24], [0, 0, 1]]), "not a pinhole camera matrix"),
    ],
)
def test_a_damaged_data_set_ends_with_one_line_that_names_the_file(
    cli, folder_flow, seven, tmp_path, name, damage, reason
) -> None:
    damage(seven)
    done = cli("run", folder_flow, "--source", seven, "--inline", "--quiet", "--out", tmp_path / "m")
    assert done.code == 1 and done.out == ""
    assert done.reason.startswith(f"{seven / name}: ") and re.search(reason, done.reason), done.reason


def test_a_source_that_is_not_there_or_of_no_format(cli, folder_flow, tmp_path) -> None:
    absent = cli("run", folder_flow, "--source", tmp_path / "absent", "--inline")
    assert (absent.code, absent.reason) == (1, f"{tmp_path / 'absent'}: no such file or folder")
    (tmp_path / "empty").mkdir()
    empty = cli("run", folder_flow, "--source", tmp_path / "empty", "--inline")
    assert empty.code == 1 and empty.err.startswith(f"placegraph: {tmp_path / 'empty'}: no known format; looked for:\n")
    assert "  sevenscenes: a 7-Scenes folder" in empty.err and "Traceback" not in empty.err
    assert not (tmp_path / "out").exists()


def test_a_recording_of_keyframes_is_no_camera(cli, folder_flow, mapped) -> None:
    done = cli("run", folder_flow, "--source", mapped / "run.rrd", "--inline")
    assert done.code == 1 and done.reason.startswith(f"{mapped / 'run.rrd'}: holds keyframes only, not every frame")


def test_a_dataflow_without_a_camera_has_no_use_for_a_source(cli, tmp_path) -> None:
    (tmp_path / "flow.toml").write_text('[nodes.playback]\npath = "a.rrd"\n')
    done = cli("run", tmp_path / "flow.toml", "--limit", "3")
    assert done.code == 2 and done.reason == "[nodes.camera] is not part of this dataflow, so limit has no use"


@pytest.mark.bus
def test_an_endpoint_that_is_taken(cli, drawn_flow, tmp_path) -> None:
    endpoint = free_endpoint()
    with Bus(BusConfig(endpoint=endpoint, prefix="other"), hub=True):
        done = cli("run", drawn_flow, "--quiet", "--endpoint", endpoint, "--out", tmp_path / "m")
    assert done.code == 2 and done.reason.startswith(f"[bus] endpoint: {endpoint} is taken, another run may be up")


@pytest.mark.bus
def test_the_cause_reaches_the_terminal_from_the_cameras_process(cli, folder_flow, seven, tmp_path) -> None:
    cut(seven / "frame-000002.color.jpg")
    done = cli("run", folder_flow, "--source", seven, "--quiet", "--endpoint", free_endpoint(), "--out", tmp_path / "m")
    assert done.code == 1 and done.out == "" and "Traceback" not in done.err
    assert done.err.startswith("placegraph: camera ")
    assert f"SourceError: {seven / 'frame-000002.color.jpg'}: not a whole image" in done.err
    assert str(tmp_path / "m" / "log" / "camera.log") in done.err
