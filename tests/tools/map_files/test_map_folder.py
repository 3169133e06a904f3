import dataclasses
import json

import numpy as np
import pytest

from placegraph.runtime.config import RunConfig, RunSettings, build
from placegraph.runtime.errors import ConfigError, SchemaError
from placegraph.runtime.messages import End, Graph, LastKeyframe, Map, NamedGraph, Pose
from placegraph.runtime.node import Context, build_node
from placegraph.tools.map_files.map_folder import (
    find_graph,
    make_empty_folder,
    next_folder,
    read_cloud,
    read_config,
    read_object_clouds,
    read_run,
    retired_objects,
    write_run,
)
from placegraph.tools.map_files.ply import write_points
from placegraph.tools.run.map_collector import MapCollector

START = {"camera": {"source": "flat"}, "pose": {"method": "given"}, "keyframe": {}}
MAPPING = START | {"instances": {"model": "drawn_scene"}, "fusion": {}, "hierarchy": {}}


def flow(nodes):
    return RunConfig(run=RunSettings(), nodes=nodes)


def pose(frame_id, trusted=True, stamp_ns=None):
    matrix = np.eye(4)
    matrix[:3, 3] = (frame_id, -0.5, 1e-7)
    return Pose(
        frame_id=frame_id, stamp_ns=frame_id * 10**8 if stamp_ns is None else stamp_ns, world_from_camera=matrix,
        trusted=trusted, quality=1.0, residual_m=0.0, innovation_m=0.0, reason="" if trusted else "lost",
    )  # fmt: skip


def make_map() -> Map:
    """The Map of no keyframes, by the real node."""
    (made,) = build_node("fusion", {}, Context()).step(LastKeyframe(frame_id=-1, stamp_ns=0, keyframes=0))
    assert isinstance(made, Map)
    return made


def graph(*, final):
    return Graph(frame_id=0, stamp_ns=0, revision=0, final=final, json="{}")


def named_graph(*, final):
    return NamedGraph(frame_id=0, stamp_ns=0, revision=0, final=final, place_types=(), json="{}")


def test_prepare_makes_or_takes_an_empty_folder_only(tmp_path) -> None:
    make_empty_folder(tmp_path / "a" / "b")
    make_empty_folder(tmp_path / "a" / "b")
    with pytest.raises(ConfigError, match=r"/a: exists and is not an empty folder"):
        make_empty_folder(tmp_path / "a")
    (tmp_path / "file").write_text("")
    with pytest.raises(ConfigError, match=r"/file: exists and is not an empty folder"):
        make_empty_folder(tmp_path / "file")


def test_the_next_folder_is_the_first_number_that_is_free(tmp_path) -> None:
    assert next_folder(tmp_path / "out", "demo") == tmp_path / "out" / "demo-001"
    for number in (1, 3):
        (tmp_path / f"demo-{number:03d}").mkdir()
    assert next_folder(tmp_path, "demo") == tmp_path / "demo-002"


def test_a_graph_is_found_in_a_folder_or_by_its_name(tmp_path) -> None:
    with pytest.raises(SchemaError, match=r"no graph\.json here"):
        find_graph(tmp_path)
    (tmp_path / "graph.json").write_text("{}")
    assert find_graph(tmp_path) == find_graph(tmp_path / "graph.json") == tmp_path / "graph.json"


def test_run_json_comes_back_as_the_dataflow_that_ran(tmp_path) -> None:
    config = flow(START)
    write_run(tmp_path, config, {}, {"frames": 0})
    assert read_config(tmp_path) == config
    assert read_run(tmp_path)["summary"] == {"frames": 0}
    assert json.loads((tmp_path / "run.json").read_text())["versions"]["numpy"] == np.__version__


def test_no_run_json(tmp_path) -> None:
    with pytest.raises(SchemaError, match=r"run\.json: cannot read: .*No such file"):
        read_config(tmp_path)
    (tmp_path / "run.json").write_bytes(b"\xff")
    with pytest.raises(SchemaError, match=r"run\.json: cannot read: "):
        read_run(tmp_path)


@pytest.mark.parametrize(
    ("nodes", "messages"),
    [
        (START, [End(frame_id=0, stamp_ns=0, frames=1)]),
        (MAPPING, [graph(final=True)]),
        (MAPPING | {"naming": {}}, [named_graph(final=True)]),
    ],
    ids=["no graph", "no names", "names"],
)
def test_complete_when_the_last_of_a_run_has_come(tmp_path, nodes, messages) -> None:
    collector = MapCollector(build(flow(nodes)))
    for message in (pose(0), graph(final=False), named_graph(final=False)):
        collector.add(message)
    assert not collector.complete
    if "naming" in nodes:
        collector.add(graph(final=True))
        assert not collector.complete
    for message in messages:
        collector.add(message)
    assert collector.complete


def test_frames_are_those_the_source_gave_or_of_a_recording_those_with_a_pose(tmp_path) -> None:
    collector = MapCollector(build(flow(START)))
    assert collector.frames == 0
    collector.add(pose(0))
    assert collector.frames == 1
    collector.add(End(frame_id=4, stamp_ns=0, frames=5))
    assert collector.frames == 5


def test_without_a_map_only_the_trajectory_is_written(tmp_path) -> None:
    collector = MapCollector(build(flow(START)))
    collector.add(pose(0))
    collector.write(tmp_path / "map")
    assert [path.name for path in (tmp_path / "map").iterdir()] == ["trajectory.txt"]


def test_points_without_what_a_map_needs_are_named(tmp_path) -> None:
    write_points(tmp_path / "cloud.ply", np.zeros((1, 3)), {"object": np.zeros(1, np.int32)})
    with pytest.raises(SchemaError, match=r"cloud\.ply: not a cloud that .* no colours"):
        read_cloud(tmp_path)
    (tmp_path / "cloud.ply").rename(tmp_path / "objects.ply")
    assert {name: len(points) for name, points in read_object_clouds(tmp_path).items()} == {"O0": 1}
    write_points(tmp_path / "objects.ply", np.zeros((1, 3)), {})
    with pytest.raises(SchemaError, match=r"objects\.ply: not the objects' points"):
        read_object_clouds(tmp_path)


def test_what_has_gone_is_listed_with_when_it_was_seen() -> None:
    empty = make_map()
    assert retired_objects(empty) == []
    gone = dataclasses.replace(
        empty,
        retired_ids=np.array([4]),
        retired_boxes_world=np.array([[[0, 0, 0], [1, 2, 0.1234]]], np.float32),
        retired_last_frames=np.array([70]),
        retired_gone_frames=np.array([90]),
        retired_tag_names=("chair", "stool"),
        retired_tag_votes=np.array([2, 0.5], np.float32),
        retired_tag_offsets=np.array([0, 2]),
    )
    gone.check()
    assert retired_objects(gone) == [
        {
            "id": "O4",
            "tags": [["chair", 2.0], ["stool", 0.5]],
            "box": [[0, 0, 0], [1, 2, 0.123]],
            "last_seen": 70,
            "gone": 90,
        }
    ]
