import functools
import io

import pytest
from rich.console import Console

from placegraph.runtime.config import RunConfig, RunSettings, build
from placegraph.runtime.messages import Health
from placegraph.tools.run import progress_table as module
from placegraph.tools.run.progress_table import ProgressTable

NODES = {"camera": {"source": "flat"}, "pose": {"method": "given"}}


def flow(**camera):
    return build(RunConfig(run=RunSettings(), nodes=NODES | {"camera": NODES["camera"] | camera}))


def health(node="pose", **values):
    fields = {
        "steps": 7, "rate_hz": 3.25, "step_p50_ms": 1.25, "step_p95_ms": 20.0, "queue": 2, "drops": 0,
        "memory_mb": 99.6,
    }  # fmt: skip
    return Health(frame_id=-1, stamp_ns=0, node=node, **(fields | values))


def shown(progress):
    out = io.StringIO()
    Console(file=out, width=100).print(progress._table())
    return out.getvalue()


def styled(progress):
    out = io.StringIO()
    Console(file=out, width=100, force_terminal=True, color_system="standard").print(progress._table())
    return out.getvalue()


def test_the_table_has_a_row_for_each_node_in_order() -> None:
    progress = ProgressTable(flow(), quiet=False)
    progress.add(health())
    rows = [[cell.strip() for cell in line.split("│")[1:-1]] for line in shown(progress).splitlines() if "│" in line]
    assert rows == [["camera", *["-"] * 7], ["pose", "7", "3.2", "1.2", "20.0", "2", "0", "100"]]


def test_a_slow_node_is_marked_only_when_live() -> None:
    for live in (False, True):
        progress = ProgressTable(flow(realtime=live), quiet=False)
        progress.add(health(rate_hz=0.1))
        assert ("\x1b[33m" in styled(progress)) == live


def test_dropped_messages_are_marked() -> None:
    progress = ProgressTable(flow(), quiet=False)
    progress.add(health())
    assert "\x1b[31m" not in styled(progress)
    progress.add(health(drops=3))
    assert "\x1b[31m3" in styled(progress)


@pytest.mark.parametrize("quiet", [False, True])
def test_without_a_terminal_a_line_now_and_then(capsys, monkeypatch, quiet) -> None:
    monkeypatch.setattr(module, "PLAIN_PERIOD_S", 0.0)
    with ProgressTable(flow(), quiet) as progress:
        progress.refresh()  # nothing reported yet
        progress.add(health())
        progress.add(health("camera", steps=9))
        progress.refresh()
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err == ("" if quiet else "camera 9  pose 7\n")


def test_on_a_terminal_it_says_what_is_starting_then_shows_the_table_and_leaves_nothing(capsys, monkeypatch) -> None:
    monkeypatch.setattr(module, "Console", functools.partial(Console, force_terminal=True, width=100))
    with ProgressTable(flow(), quiet=False) as progress:
        assert "starting camera, pose " in capsys.readouterr().err
        progress.add(health())
        progress.refresh()
        table = capsys.readouterr().err
    assert "p95 ms" in table
    lines = table.count("\n")
    assert capsys.readouterr().err.count("\x1b[2K") >= lines  # each line of the table is erased


def test_not_more_than_a_line_each_period(capsys) -> None:
    with ProgressTable(flow(), quiet=False) as progress:
        progress.add(health())
        progress.refresh()
    assert capsys.readouterr().err == ""


def test_what_is_said_stays_one_line_as_it_is(capsys) -> None:
    text = "[bus] " + "a path/" * 30
    ProgressTable(flow(), quiet=True).say(text)
    assert capsys.readouterr().err == text + "\n"


@pytest.mark.parametrize("columns", ["60", "80"])
def test_the_summary_keeps_whole_lines(capsys, monkeypatch, columns) -> None:
    monkeypatch.setenv("COLUMNS", columns)
    numbers = {"steps": 5, "p50_ms": 1.234, "p95_ms": 10.0, "drops": 0, "memory_mb": 0}
    summary = {
        "frames": 5, "keyframes": 1, "untrusted_poses": 0, "start_s": 1.5, "mapping_s": 2.0, "frames_per_s": 2.5,
        "nodes": {"camera": numbers, "pose": numbers | {"memory_mb": 120}},
        "trajectory": {"ate_rmse_m": 0.01, "ate_max_m": 0.02, "poses": 5, "path_m": 3.0},
        "graph": {"floor": 1, "room": 2, "location": 0, "object": 1},
    }  # fmt: skip
    ProgressTable(flow(), quiet=False).print_summary(summary)
    out = capsys.readouterr().out
    cells = [[cell.strip() for cell in line.split("│")[1:-1]] for line in out.splitlines() if "│" in line]
    assert cells == [["camera", "5", "1.2", "10.0", "0", "-"], ["pose", "5", "1.2", "10.0", "0", "120"]]
    assert out.splitlines()[-3].startswith("5 frames (1 keyframe, 0 untrusted) in 2.0 s: 2.5 frames per second")
    assert out.splitlines()[-2:] == [
        "trajectory: ATE rmse 0.01 m, max 0.02 m over 3.0 m",
        "graph: 1 floor, 2 rooms, 0 locations, 1 object",
    ]


def test_a_summary_without_truth_or_graph(capsys) -> None:
    summary = {
        "frames": 0, "keyframes": 0, "untrusted_poses": 0, "start_s": 0.0, "mapping_s": 0.0, "frames_per_s": 0.0,
        "nodes": {}, "trajectory": None,
    }  # fmt: skip
    ProgressTable(flow(), quiet=False).print_summary(summary)
    out = capsys.readouterr().out
    assert out.splitlines()[-1] == "0 frames in 0.0 s: 0.0 frames per second; start 0.0 s"
    assert "keyframe" not in out and "trajectory" not in out and "graph" not in out
