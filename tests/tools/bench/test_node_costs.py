import json
import threading

import numpy as np
import pytest

from placegraph.runtime.errors import PlacegraphError
from placegraph.tools import bench as command
from placegraph.tools.bench import node_costs as tool
from placegraph.tools.bench.node_costs import Cost


@pytest.fixture(scope="module")
def keyframe():
    (found,) = tool.drawn_keyframes(1, 64, 48)
    return found


@pytest.fixture
def quick(monkeypatch):
    monkeypatch.setattr(tool, "IMAGE", {"width": 64, "height": 48})
    monkeypatch.setattr(tool, "POSE_FRAMES", 3)
    monkeypatch.setattr(tool, "FUSION_KEYFRAMES", 8)


def check(cost: Cost) -> None:
    assert cost.part and cost.baseline
    assert np.isfinite([cost.ms, cost.baseline_ms]).all() and cost.ms > 0 and cost.baseline_ms > 0


def test_a_ratio_is_time_over_the_baselines_time():
    assert Cost("a", 3.0, "b", 2.0).ratio == 1.5


def test_the_median_leaves_out_the_first_call_and_one_bad_one():
    now, steps = [0.0], iter([9.0, 0.001, 0.002, 5.0])

    def action():
        now[0] += next(steps)

    assert tool.median_ms(action, lambda: now[0], repeats=3) == pytest.approx(2.0)


def test_drawn_keyframes_walk_with_true_poses():
    keyframes = tool.drawn_keyframes(3, 32, 24)
    assert [keyframe.frame_id for keyframe in keyframes] == [0, 1, 2]
    assert len({tuple(keyframe.world_from_camera[:3, 3]) for keyframe in keyframes}) == 3
    for keyframe in keyframes:
        keyframe.check()
        assert keyframe.color.shape == (24, 32, 3)
    assert tool.drawn_keyframes(0, 32, 24) == []


def test_codec_and_recorder_are_compared_with_baselines_of_this_run(keyframe, quick):
    costs = [*tool.codec_costs(keyframe), tool.recorder_cost(keyframe)]
    for cost in costs:
        check(cost)
    assert {cost.baseline for cost in costs} == {"memcpy of its 0.02 MB", "codec encode"}


def test_pose_is_compared_with_the_frame_period(quick):
    cost = tool.pose_cost()
    check(cost)
    assert cost.baseline_ms == pytest.approx(33.3, abs=0.1)


def test_fusion_is_compared_with_itself_on_the_same_views(quick):
    costs = tool.fusion_costs()
    assert [cost.part for cost in costs] == [
        "fusion: add a keyframe, whole walk",
        "fusion: add and give the map, whole walk",
    ]
    for cost in costs:
        check(cost)


def test_the_queue_that_the_bus_is_compared_with_leaves_no_thread_behind(quick):
    before = threading.active_count()
    assert tool._between_threads_ms(b"x" * 1000) > 0
    assert threading.active_count() == before


def test_the_table_is_aligned():
    text = tool.cost_table([Cost("short", 1.0, "one", 2.0), Cost("a longer part", 100.0, "another", 50.0)])
    header, first, second = text.splitlines()
    assert header.split() == ["part", "ms", "baseline", "ms", "ratio"]
    assert first.endswith("0.50") and second.endswith("2.00")
    assert len({len(header), len(first), len(second)}) == 1


def test_it_prints_a_table_or_json(capsys, monkeypatch):
    monkeypatch.setattr(command, "measure", lambda: [Cost("a", 3.0, "b", 2.0)])
    command.bench_nodes()
    assert capsys.readouterr().out.splitlines()[1].split() == ["a", "3.000", "b", "2.000", "1.50"]
    command.bench_nodes(as_json=True)
    expected = {"part": "a", "ms": 3.0, "baseline": "b", "baseline_ms": 2.0, "ratio": 1.5}
    assert json.loads(capsys.readouterr().out) == [expected]


@pytest.mark.bus
def test_the_bus_is_compared_with_a_queue(keyframe, quick):
    check(tool.bus_cost(keyframe))


@pytest.mark.bus
def test_a_bus_that_delivers_nothing_is_an_error(keyframe, quick, monkeypatch):
    monkeypatch.setattr(tool, "ARRIVAL_TIMEOUT_S", 0.5)
    monkeypatch.setattr(tool.Bus, "publisher", lambda self, *key: lambda payload, attachment: None)
    with pytest.raises(PlacegraphError, match=r"the bus did not deliver within 0\.5 s"):
        tool.bus_cost(keyframe)
