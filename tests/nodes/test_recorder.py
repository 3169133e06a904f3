import dataclasses
import json
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rerun.chunk import RrdReader

from placegraph.nodes.recorder import DRAWN, NODE, RecorderConfig
from placegraph.nodes.recorder.drawing import color_of, markdown
from placegraph.runtime import messages as m
from placegraph.runtime.errors import ConfigError, SchemaError
from placegraph.runtime.messages.topics import TOPICS
from placegraph.runtime.node import Context
from placegraph.runtime.recording import kinds_in, properties, read
from placegraph.runtime.scene_graph import GraphNode, SceneGraph, Tag
from placegraph.runtime.scene_graph.place_graph import Connection, RouteSegment

Play = Callable[..., dict[str, list[dict[str, Any]]]]


@pytest.fixture
def play(tmp_path: Path) -> Play:
    """Run messages through a recorder; gives the rows of each entity, times and components by name."""

    def run(messages: Sequence[m.Message], **settings: Any) -> dict[str, list[dict[str, Any]]]:
        node = NODE(RecorderConfig(**settings), Context(out_dir=str(tmp_path)))
        node.start()
        try:
            assert all(node.step(message) == () for message in messages)
        finally:
            node.stop()
        entities: dict[str, list[dict[str, Any]]] = {}
        for chunk in RrdReader(str(tmp_path / "run.rrd")).stream():
            batch = chunk.to_record_batch()
            columns = {n: batch.column(n) for n in batch.schema.names if n not in ("capture_time", "log_time")}
            for row in range(batch.num_rows):
                found = {name: column[row].as_py() for name, column in columns.items()}
                entities.setdefault(chunk.entity_path, []).append(found)
        for rows in entities.values():  # as logged, not as chunked
            rows.sort(key=lambda row: row["rerun.controls.RowId"])
        return entities

    return run


def keyframe(frame_id: int = 0, height: int = 4, width: int = 6) -> m.Keyframe:
    return m.Keyframe(
        frame_id=frame_id,
        stamp_ns=frame_id * 10,
        color=np.full((height, width, 3), (200, 10, 10), np.uint8),
        depth=np.full((height, width), 1500, np.uint16),
        depth_unit_m=0.001,
        intrinsics=np.array([5.0, 5.0, 3.0, 2.0]),
        world_from_camera=np.eye(4),
    )


def frame(frame_id: int = 0) -> m.Frame:
    shot = keyframe(frame_id)
    return m.Frame(
        frame_id=frame_id,
        stamp_ns=shot.stamp_ns,
        color=shot.color,
        depth=shot.depth,
        depth_unit_m=shot.depth_unit_m,
        intrinsics=shot.intrinsics,
        given_world_from_camera=np.full((4, 4), np.nan),
        up_camera=np.full(3, np.nan),
    )


def pose(frame_id: int, x: float, trusted: bool = True) -> m.Pose:
    matrix = np.eye(4)
    matrix[0, 3] = x
    return m.Pose(
        frame_id=frame_id,
        stamp_ns=frame_id * 10,
        world_from_camera=matrix,
        trusted=trusted,
        quality=0.9,
        residual_m=math.nan,
        innovation_m=0.01,
        reason="" if trusted else "a white wall",
    )


def segments(names: tuple[str, ...], boxes: list[list[int]], masks: list[np.ndarray]) -> m.Segments:
    bits, offsets = m.Segments.pack(masks)
    return m.Segments(
        frame_id=0,
        stamp_ns=0,
        names=names,
        scores=np.linspace(0.9, 0.5, len(names), dtype=np.float32),
        boxes_px=np.array(boxes, np.int32).reshape(-1, 4),
        mask_bits=bits,
        mask_offsets=offsets,
    )


def map_of(names: dict[int, tuple[str, ...]], frame_id: int = 0, points: int = 5) -> m.Map:
    n = len(names)
    return m.Map(
        frame_id=frame_id,
        stamp_ns=frame_id * 10,
        revision=frame_id,
        final=False,
        keyframes=1,
        voxel_m=0.05,
        points_world=np.random.default_rng(0).normal(size=(points, 3)).astype(np.float32),
        point_colors=np.zeros((points, 3), np.uint8),
        free_cell_m=0.1,
        free_points_world=np.zeros((0, 3), np.float32),
        camera_positions_world=np.zeros((1, 3), np.float32),
        object_ids=np.array(list(names), np.int64),
        object_boxes_world=np.tile(np.array([[0, 0, 0], [1, 2, 3]], np.float32), (n, 1, 1)),
        object_oriented_boxes=np.tile(np.array([0.5, 1, 1.5, 1, 2, 3, np.pi / 2], np.float32), (n, 1)),
        object_colors=np.zeros((n, 3), np.uint8),
        object_observations=np.ones(n, np.int64),
        object_first_frames=np.zeros(n, np.int64),
        object_last_frames=np.zeros(n, np.int64),
        object_points_world=np.zeros((0, 3), np.float32),
        object_point_offsets=np.zeros(n + 1, np.int64),
        tag_names=tuple(name for tags in names.values() for name in tags),
        tag_votes=np.ones(sum(map(len, names.values())), np.float32),
        tag_offsets=np.cumsum([0, *map(len, names.values())], dtype=np.int64),
        retired_ids=np.zeros(0, np.int64),
        retired_boxes_world=np.zeros((0, 2, 3), np.float32),
        retired_last_frames=np.zeros(0, np.int64),
        retired_gone_frames=np.zeros(0, np.int64),
        retired_tag_names=(),
        retired_tag_votes=np.zeros(0, np.float32),
        retired_tag_offsets=np.zeros(1, np.int64),
    )


def place(node_id: str, parent: str, name: str = "", corners: int = 4) -> GraphNode:
    footprint = np.array([[0, 0], [2, 0], [2, 3], [0, 3]], float)[:corners]
    box = np.array([[0, 0, 0.5], [2, 3, 2.5]])
    tags = (Tag(name, 1.0),) if name else ()
    return GraphNode(id=node_id, parent=parent, tags=tags, box=box, footprint=footprint, first_frame=0, last_frame=1)


def graph(*nodes: GraphNode, frame_id: int = 0) -> m.Graph:
    text = SceneGraph.of([place("B0", ""), *nodes]).to_json()
    return m.Graph(frame_id=frame_id, stamp_ns=0, revision=1, final=False, json=text)


def question(text: str) -> m.Question:
    return m.Question(
        frame_id=-1, stamp_ns=0, question_id="q1", text=text, k=3, mode="program", viewpoint_world=np.full(3, np.nan)
    )


def answer(**fields: Any) -> m.Answer:
    return m.Answer(frame_id=-1, stamp_ns=0, question_id="q1", json=json.dumps(fields))


FOUND = {
    "status": "found",
    "object_id": "O3",
    "name": "cup",
    "box": [[0, 0, 0], [1, 1, 1]],
    "path": [{"id": "R1", "name": "kitchen", "layer": "room"}, {"id": "O3", "name": "cup", "layer": "object"}],
    "evidence": ["cup O3 is 0.40 m from sink O6"],
    "candidates": [{"id": "O3", "name": "cup", "score": 0.9}, {"id": "O4", "name": "cup", "score": 0.25}],
    "sure": False,
}


def text_of(rows: list[dict[str, Any]]) -> str:
    return str(rows[-1]["TextDocument:text"][0])


def test_takes_what_the_table_marks_and_frames_only_when_told() -> None:
    assert set(NODE.inputs) == {kind for kind, topic in TOPICS.items() if topic.recorded}
    assert NODE(RecorderConfig(frames=True), Context()).inputs == (m.Frame, *NODE.inputs)
    assert NODE.outputs == ()
    assert set(DRAWN) <= {m.Frame, *NODE.inputs}


def test_where_a_node_names_the_graph_it_is_recorded_with_its_names_alone() -> None:
    inputs = NODE(RecorderConfig(), Context(produced_kinds=("Graph", "NamedGraph"))).inputs
    assert set(NODE.inputs) - set(inputs) == {m.Graph}


def test_a_named_graph_is_drawn_as_a_graph(play: Play) -> None:
    shared = {"frame_id": 0, "stamp_ns": 0, "revision": 1, "final": False, "json": graph(place("F0", "B0")).json}
    (row,) = play([m.NamedGraph(**shared, place_types=())])["/graph"]
    assert row["GraphNodes:labels"] == play([m.Graph(**shared)])["/graph"][0]["GraphNodes:labels"]


@pytest.mark.parametrize("file", ["sub/run.rrd", "../run.rrd", "run.mcap", "/run.rrd"])
def test_a_file_outside_the_run_folder_is_refused(file: str) -> None:
    with pytest.raises(ConfigError, match=r"\[nodes\.recorder\] file: expected a name"):
        NODE(RecorderConfig(file=file), Context())


def test_settings_that_record_nothing_are_refused() -> None:
    with pytest.raises(ConfigError, match="nothing would be recorded"):
        NODE(RecorderConfig(file=""), Context())
    with pytest.raises(ConfigError, match="no folder"):
        NODE(RecorderConfig(), Context()).start()


def test_without_messages_the_file_is_a_recording(play: Play, tmp_path: Path) -> None:
    entities = play([])
    assert "ViewCoordinates:xyz" in entities["/world"][0]
    assert kinds_in(tmp_path / "run.rrd") == {}
    assert properties(tmp_path / "run.rrd")["frames"] == "false"
    assert len(RrdReader(str(tmp_path / "run.rrd")).blueprints()) == 1


def test_every_message_is_kept_in_order(play: Play, tmp_path: Path) -> None:
    sent = [pose(0, 0.0), keyframe(0), map_of({1: ("cup",)}), graph(), pose(1, 1.0), question("?"), answer(**FOUND)]
    sent += [m.LastKeyframe(frame_id=0, stamp_ns=0, keyframes=1), m.End(frame_id=1, stamp_ns=10, frames=2)]
    play(sent)
    found = list(read(tmp_path / "run.rrd", m.all_kinds()))
    assert [type(x) for x in found] == [type(x) for x in sent]
    assert found[2].points_world.tobytes() == sent[2].points_world.tobytes()  # type: ignore[attr-defined]


def test_a_broken_message_is_refused(play: Play) -> None:
    with pytest.raises(SchemaError, match=r"Tags\.scores: expected shape"):
        play([m.Tags(frame_id=0, stamp_ns=0, names=("a",), scores=np.zeros((1, 1), np.float32))])


def test_step_before_start_is_a_bug() -> None:
    with pytest.raises(RuntimeError, match="before start"):
        NODE(RecorderConfig(), Context(out_dir="x")).step(pose(0, 0.0))


def test_stop_without_start_is_harmless() -> None:
    assert NODE(RecorderConfig(), Context(out_dir="x")).stop() is None


def test_a_keyframe_shows_image_depth_and_camera(play: Play) -> None:
    entities = play([keyframe(3)])
    (camera,) = entities["/world/camera/image"]
    assert camera["frame"] == 3
    assert camera["Pinhole:resolution"] == [[6.0, 4.0]]
    (depth,) = entities["/world/camera/image/depth"]
    assert depth["EncodedDepthImage:meter"] == pytest.approx([1000.0])
    assert bytes(entities["/world/camera/image/color"][0]["EncodedImage:blob"][0])[:2] == b"\xff\xd8"
    assert "Transform3D:translation" in entities["/world/camera"][0]


def test_with_frames_the_camera_follows_frames_and_poses(play: Play, tmp_path: Path) -> None:
    entities = play([frame(0), pose(0, 0.0), frame(1), pose(1, 2.0), keyframe(1)], frames=True)
    assert [row["frame"] for row in entities["/world/camera/image/color"]] == [0, 1]
    assert [row["Transform3D:translation"] for row in entities["/world/camera"]] == [[[0.0] * 3], [[2.0, 0.0, 0.0]]]
    assert kinds_in(tmp_path / "run.rrd")["Frame"] == 2


def test_the_path_is_one_step_a_pose_and_red_where_not_trusted(play: Play) -> None:
    entities = play([pose(0, 0.0), pose(1, 1.0), pose(2, 3.0, trusted=False)])
    strips = [row["LineStrips3D:strips"][0] for row in entities["/world/path"]]
    assert strips == [[[0, 0, 0], [0, 0, 0]], [[0, 0, 0], [1, 0, 0]], [[1, 0, 0], [3, 0, 0]]]
    colors = [row["LineStrips3D:colors"][0] for row in entities["/world/path"]]
    assert colors[0] == colors[1] != colors[2]
    assert "a white wall" in entities["/log/pose"][0]["TextLog:text"][0]
    assert len([row for row in entities["/pose/residual_m"] if row.get("Scalars:scalars")]) == 3


def test_no_tags_and_too_many_tags(play: Play) -> None:
    tags = m.Tags(frame_id=0, stamp_ns=0, names=(), scores=np.zeros(0, np.float32))
    assert "nothing recognised" in text_of(play([tags])["/tags"])
    many = tuple(f"tag {i}" for i in range(30))
    tags = m.Tags(frame_id=0, stamp_ns=0, names=many, scores=np.ones(30, np.float32))
    text = text_of(play([tags])["/tags"])
    assert text.count("tag ") == 12
    assert "and 18 more" in text


def test_detections_none_and_two(play: Play) -> None:
    none = m.Detections(
        frame_id=0, stamp_ns=0, names=(), boxes_px=np.zeros((0, 4), np.float32), scores=np.zeros(0, np.float32)
    )
    two = m.Detections(
        frame_id=1,
        stamp_ns=0,
        names=("cup", "chair"),
        boxes_px=np.array([[0, 0, 2, 4], [1, 1, 5, 3]], np.float32),
        scores=np.array([0.9, 0.5], np.float32),
    )
    rows = play([none, two])["/world/camera/image/detections"]
    assert rows[0]["Boxes2D:labels"] == []
    assert rows[1]["Boxes2D:labels"] == ["cup 0.90", "chair 0.50"]
    assert rows[1]["Boxes2D:centers"] == [[1.0, 2.0], [3.0, 2.0]]


def test_masks_take_numbers_by_name_and_the_better_one_is_on_top(play: Play) -> None:
    full = np.ones((2, 2), bool)
    entities = play([keyframe(), segments(("cup", "chair"), [[0, 0, 2, 2], [1, 1, 3, 3]], [full, full])])
    (row,) = entities["/world/camera/image/masks"]
    image = np.array(row["SegmentationImage:buffer"][0], np.uint8).reshape(4, 6)
    assert image[:3, :3].tolist() == [[1, 1, 0], [1, 1, 2], [0, 2, 2]]
    assert image.sum() == 4 + 3 * 2
    (announced,) = entities["/world/camera/image"][-1:]
    labels = [info["class_description"]["info"]["label"] for info in announced["AnnotationContext:context"][0]]
    assert labels[1:] == ["cup", "chair"]


def test_no_masks_and_masks_without_an_image(play: Play) -> None:
    rows = play([keyframe(), segments((), [], [])])["/world/camera/image/masks"]
    assert set(rows[0]["SegmentationImage:buffer"][0]) == {0}
    rows = play([segments(("cup",), [[2, 1, 5, 3]], [np.ones((2, 3), bool)])])["/world/camera/image/masks"]
    assert sum(rows[0]["SegmentationImage:buffer"][0]) == 6


def test_objects_are_named_boxes_and_vanish_with_the_next_map(play: Play) -> None:
    first = map_of({3: ("chair", "seat"), 57: ()})
    entities = play([first, map_of({3: ("chair",)}, frame_id=4)])
    (box, again) = entities["/world/objects/O3"]
    assert box["Boxes3D:labels"] == again["Boxes3D:labels"] == ["chair O3"]
    assert box["Boxes3D:half_sizes"] == [[0.5, 1.0, 1.5]]
    assert box["Boxes3D:quaternions"][0] == pytest.approx([0, 0, math.sqrt(0.5), math.sqrt(0.5)])
    shown, cleared = entities["/world/objects/O57"]
    assert shown["Boxes3D:labels"] == ["object O57"]
    assert cleared["frame"] == 4
    assert cleared["Clear:is_recursive"] == [False]


def test_an_empty_map_and_a_large_one(play: Play) -> None:
    (empty,) = play([map_of({}, points=0)])["/world/map"]
    assert empty["Points3D:positions"] == []
    drawn = play([map_of({}, points=250_001)])
    parts = [drawn[path][0]["Points3D:positions"] for path in ("/world/map", "/world/overhead")]
    assert sum(map(len, parts)) == 83_334
    assert max(point[2] for point in parts[0]) < min(point[2] for point in parts[1])


def test_places_are_outlines_at_the_floor(play: Play) -> None:
    nodes = [place("F0", "B0", "floor 1"), place("R2", "F0", "kitchen", corners=0), place("L1", "R2")]
    entities = play([graph(*nodes), graph(nodes[0], frame_id=5)])
    shown, cleared = entities["/world/rooms/R2"]
    assert shown["LineStrips3D:labels"] == ["R2 kitchen"]
    (strip,) = shown["LineStrips3D:strips"]
    assert strip[0] == strip[-1]
    assert len(strip) == 5
    assert [point[2] for point in strip] == pytest.approx([0.52] * 5)
    assert cleared["Clear:is_recursive"] == [False]
    assert entities["/world/locations/L1"][0]["LineStrips3D:labels"] == ["L1 location"]
    assert len([row for row in entities["/world/floors/F0"] if row.get("LineStrips3D:strips")]) == 2


def test_connections_are_discs_and_lines_and_vanish_with_the_next_graph(play: Play) -> None:
    nodes = [place("F0", "B0", "floor 1"), place("R2", "F0"), place("R3", "F0")]
    fields: dict[str, Any] = {"rooms": ("R2", "R3"), "width_m": 0.9}
    door = Connection(id="C0", kind="door", ends=np.array([[1.0, 2, 0.5]] * 2), length_m=0.0, **fields)
    climb = Connection(id="C1", kind="stairs", ends=np.array([[1.0, 2, 0.5], [4, 2, 3]]), length_m=4.0, **fields)
    segment = RouteSegment(room="R2", ends=("C0", "R2"), length_m=2.0, points=np.array([[1.0, 2], [3, 2]]))
    first = graph(*nodes)
    joined = SceneGraph.from_json(first.json).nodes.values()
    shown = dataclasses.replace(first, json=SceneGraph.of(joined, [door, climb], [segment]).to_json())
    entities = play([shown, graph(*nodes, frame_id=5)])
    disc, cleared = entities["/world/connections/C0"]
    assert disc["Ellipsoids3D:labels"] == ["C0 door"] and cleared["Clear:is_recursive"] == [False]
    assert disc["Ellipsoids3D:half_sizes"][0][:2] == pytest.approx([0.45, 0.45])
    (strip,) = entities["/world/connections/C1"][0]["LineStrips3D:strips"]
    assert [point[2] for point in strip] == pytest.approx([0.56, 3.06])
    (line,) = entities["/world/ways"][0]["LineStrips3D:strips"]
    assert [point[:2] for point in line] == [[1, 2], [3, 2]]


def test_the_graph_is_a_tree_without_nodes_on_top_of_each_other(play: Play) -> None:
    nodes = [place("F0", "B0"), place("R1", "F0"), place("R2", "F0"), *(place(f"O{i}", "R1", "cup") for i in range(3))]
    (row,) = play([graph(*nodes)])["/graph"]
    assert row["GraphNodes:labels"][-1] == "cup O2"
    positions = [tuple(position) for position in row["GraphNodes:positions"]]
    assert len(set(positions)) == len(positions) == 7
    edges = {(edge["first"], edge["second"]) for edge in row["GraphEdges:edges"]}
    assert edges == {("B0", "F0"), ("F0", "R1"), ("F0", "R2"), ("R1", "O0"), ("R1", "O1"), ("R1", "O2")}


def test_a_graph_that_is_none_is_refused(play: Play) -> None:
    with pytest.raises(SchemaError, match="Graph of revision 7: not JSON"):
        play([m.Graph(frame_id=0, stamp_ns=0, revision=7, final=False, json="{")])


def test_an_answer_is_words_and_a_box(play: Play) -> None:
    entities = play([question("Where is the [cup](http://x) #1?"), answer(**FOUND)])
    text = text_of(entities["/answers"])
    assert text.startswith(r"Where is the \[cup\]\(http://x\) \#1?")
    assert "### cup O3 (not sure)" in text
    assert "kitchen R1 › cup O3" in text
    assert r"cup O3 is 0\.40 m from sink O6" in text
    assert "Others: cup O4 (0.25)" in text
    (box,) = entities["/world/answer"]
    assert box["Boxes3D:labels"] == ["ANSWER: cup O3"]
    assert box["Boxes3D:centers"] == [[0.5, 0.5, 0.5]]


def test_an_answer_that_found_nothing_takes_the_box_away(play: Play) -> None:
    nothing = answer(status="not_in_map", evidence=["no piano"], object_id=None, box=None, question="a piano?")
    entities = play([answer(**FOUND), nothing])
    assert "### not in map" in text_of(entities["/answers"])
    assert entities["/world/answer"][-1]["Clear:is_recursive"] == [False]
    failed = text_of(play([answer(status="error", error="no graph yet")])["/answers"])
    assert "### error" in failed
    assert "no graph yet" in failed


@pytest.mark.parametrize("text", ["", "{", "[]", "null"])
def test_an_answer_that_is_no_object_is_refused(play: Play, text: str) -> None:
    with pytest.raises(SchemaError, match="Answer q1: "):
        play([m.Answer(frame_id=-1, stamp_ns=0, question_id="q1", json=text)])


def test_health_is_one_line_for_each_node_also_with_odd_names(play: Play) -> None:
    def health(node: str) -> m.Health:
        return m.Health(
            frame_id=-1,
            stamp_ns=0,
            node=node,
            steps=1,
            rate_hz=1.0,
            step_p50_ms=5.0,
            step_p95_ms=math.nan,
            queue=2,
            drops=0,
            memory_mb=1.0,
        )

    entities = play([pose(4, 0.0), health("pose"), health("my node/2")])
    assert [row["Scalars:scalars"] for row in entities["/health/step_ms/pose"]] == [[5.0]]
    assert [row["frame"] for row in entities["/health/queue/pose"]] == [4]
    assert len([path for path in entities if path.startswith("/health/step_ms/my")]) == 1


def test_colors_are_stable_and_bright() -> None:
    assert color_of("cup") == color_of("cup") != color_of("chair")
    assert max(color_of("")) == 255


def test_markdown_keeps_text_plain() -> None:
    assert markdown("") == ""
    assert markdown("![a](b)\n# c") == r"\!\[a\]\(b\) \# c"
