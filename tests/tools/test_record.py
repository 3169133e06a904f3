import json

import pytest

from placegraph.runtime.recording import kinds_in


@pytest.mark.bus
def test_a_recording_maps_like_its_source_under_the_same_config(cli, drawn_flow, mapped, tmp_path) -> None:
    done = cli("record", drawn_flow, "--out", tmp_path / "taken", "--quiet")
    assert done.code == 0, done.err
    recording = tmp_path / "taken" / "run.rrd"
    assert f"recording  {recording}\n" in done.out and f"placegraph run {drawn_flow} --source {recording}" in done.out
    assert "\n20 frames in " in done.out
    counts = kinds_in(recording)
    assert counts["Frame"] == 20 and set(counts) <= {"Frame", "End", "Health"}
    assert set(json.loads((tmp_path / "taken" / "run.json").read_text())["effective"]) == {"camera", "recorder"}

    run = cli("run", drawn_flow, "--source", recording, "--inline", "--quiet", "--out", tmp_path / "map")
    assert run.code == 0, run.err
    for name in ("graph.json", "cloud.ply", "trajectory.txt"):
        assert (tmp_path / "map" / name).read_bytes() == (mapped / name).read_bytes(), name


def test_without_a_camera_there_is_nothing_to_record(cli, tmp_path) -> None:
    flow = tmp_path / "flow.toml"
    flow.write_text('[nodes.playback]\npath = "a.rrd"\n')
    done = cli("record", flow, "--out", tmp_path / "taken")
    assert done.code == 2 and done.reason == f"{flow}: there is no [nodes.camera] to record"


def test_a_folder_that_is_not_empty_is_left_as_it_is(cli, drawn_flow, tmp_path) -> None:
    done = cli("record", drawn_flow, "--out", tmp_path)
    assert done.code == 2 and done.reason.startswith(f"{tmp_path}: exists and is not an empty folder")
    assert [path.name for path in tmp_path.iterdir()] == ["drawn.toml"]
