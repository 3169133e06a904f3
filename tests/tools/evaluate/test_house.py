import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from placegraph.nodes.camera.tum import SOURCE as TUM
from placegraph.runtime.errors import SchemaError
from placegraph.runtime.geometry import inverse, transform
from placegraph.runtime.messages import Pose
from placegraph.runtime.scene_graph import Node, SceneGraph, Tag
from placegraph.tools.evaluate.aligned_map import read_aligned
from placegraph.tools.evaluate.objects import LEAST_FRAMES
from placegraph.tools.evaluate.report import number, plain, table
from placegraph.tools.evaluate.trajectory import level_alignment
from placegraph.tools.house.build import build
from placegraph.tools.house.export import HouseOrder, export
from placegraph.tools.house.questions import AskedQuestion, to_json
from placegraph.tools.house.truth import Seen, read_truth, truth_of, write_truth
from placegraph.tools.map_folder import read_object_clouds, write_trajectory
from placegraph.tools.ply import write_points

ORDER = HouseOrder(seed=5, floors=1, limit=4, width=64, height=48)
MAP_FROM_TRUE = np.eye(4)
MAP_FROM_TRUE[:3, :3] = Rotation.from_euler("z", 0.7).as_matrix()
MAP_FROM_TRUE[:3, 3] = (4, -5, 0.6)


@pytest.fixture(scope="module")
def source(tmp_path_factory):
    """A house folder of few frames whose truth says that every object was seen well."""
    folder = tmp_path_factory.mktemp("house") / "made"
    run = export(ORDER, folder, workers=1)
    house = build(ORDER.seed, ORDER.floors)
    seen = tuple(Seen(item.id, LEAST_FRAMES, LEAST_FRAMES) for item in house.items)
    write_truth(truth_of(house, run, seen), folder)
    return folder


def corners(box):
    x, y, z = np.array(np.meshgrid(*box.T, indexing="ij")).reshape(3, -1)
    return np.stack((x, y, z), axis=1)


def into_map(outline):
    return outline @ MAP_FROM_TRUE[:2, :2].T + MAP_FROM_TRUE[:2, 3]


def node(id, parent, box, outline, tags=()):
    return Node(id=id, parent=parent, tags=tags, box=box, footprint=outline, first_frame=-1, last_frame=-1)


def extent(points):
    return np.stack((points.min(axis=0), points.max(axis=0)))


def write_map(source, folder, objects=None):
    """A map that is the truth itself, turned and shifted; `objects`: of these alone."""
    truth = read_truth(source)
    folder.mkdir()
    floor = truth.floors[0]
    heights = np.array([floor.z_m, floor.z_m + floor.height_m]) + MAP_FROM_TRUE[2, 3]

    def slab(outline):
        low, high = extent(into_map(outline))
        return np.array([[*low, heights[0]], [*high, heights[1]]])

    nodes = [node(i, p, slab(floor.outline), into_map(floor.outline)) for i, p in (("B0", ""), ("F0", "B0"))]
    nodes += [node(f"R{r.id}", "F0", slab(r.polygon), into_map(r.polygon)) for r in truth.rooms]
    nodes += [node(f"L{p.id}", f"R{p.room}", slab(p.outline), into_map(p.outline)) for p in truth.locations]
    clouds, ids = [np.zeros((0, 3))], [np.zeros(0, int)]
    for one in truth.objects if objects is None else objects:
        points = transform(MAP_FROM_TRUE, corners(one.box))
        tags = (Tag(one.class_name, 1.0),)
        nodes.append(node(f"O{one.id}", f"R{one.room}", extent(points), points[:, :2], tags))
        clouds.append(points)
        ids.append(np.full(len(points), one.id))
    SceneGraph.of(nodes).save(folder / "graph.json")
    write_points(folder / "objects.ply", np.concatenate(clouds), {"object": np.concatenate(ids).astype(np.int32)})
    poses = [
        Pose(
            frame_id=k, stamp_ns=stamp, world_from_camera=MAP_FROM_TRUE @ pose, trusted=True, quality=1.0,
            residual_m=0.0, innovation_m=0.0, reason="",
        )
        for k, (stamp, pose) in enumerate(sorted(TUM(source, {}).given_poses().items()))
    ]  # fmt: skip
    write_trajectory(folder / "trajectory.txt", poses)
    return folder


@pytest.fixture
def perfect(source, tmp_path):
    return write_map(source, tmp_path / "map")


def test_the_level_alignment_undoes_a_turn_about_z_and_nothing_else() -> None:
    walk = np.random.default_rng(0).normal(size=(30, 3))
    found = level_alignment(transform(MAP_FROM_TRUE, walk), walk)
    assert found == pytest.approx(inverse(MAP_FROM_TRUE), abs=1e-12)
    tilted = walk @ Rotation.from_euler("x", 0.2).as_matrix().T
    assert level_alignment(tilted, walk)[2, :3].tolist() == [0, 0, 1]
    assert np.isfinite(level_alignment(np.zeros((3, 3)), np.ones((3, 3)))).all()  # a camera that stands


def test_a_straight_walk_says_where_the_map_is() -> None:
    line = np.column_stack((np.arange(5.0), np.zeros(5), np.zeros(5)))
    assert level_alignment(transform(MAP_FROM_TRUE, line), line) == pytest.approx(inverse(MAP_FROM_TRUE), abs=1e-12)


def test_boxes_are_made_anew_from_the_clouds(perfect, source) -> None:
    aligned = read_aligned(perfect, inverse(MAP_FROM_TRUE))
    truth = read_truth(source)
    by_id = {one.id: one for one in aligned.objects}
    for one in truth.objects:
        assert by_id[f"O{one.id}"].box == pytest.approx(one.box, abs=1e-4)
    assert aligned.floors[0] == pytest.approx([0, truth.floors[0].height_m], abs=2e-3)
    assert aligned.rooms[0].outline == pytest.approx(truth.rooms[0].polygon, abs=2e-3)


def test_damaged_clouds_are_named(perfect) -> None:
    file = perfect / "objects.ply"
    whole = file.read_bytes()
    for damaged in (b"", whole[:-1], whole.replace(b"int object", b"int thing")):
        file.write_bytes(damaged)
        with pytest.raises(SchemaError, match=r"objects\.ply: (not a PLY file|cut short|not the objects' points)"):
            read_object_clouds(perfect)
    file.unlink()
    with pytest.raises(SchemaError, match=r"objects\.ply: cannot read"):
        read_aligned(perfect, np.eye(4))


def test_clouds_of_another_run_are_noticed(perfect) -> None:
    write_points(perfect / "objects.ply", np.zeros((0, 3)), {"object": np.zeros(0, np.int32)})
    assert read_object_clouds(perfect) == {}
    with pytest.raises(SchemaError, match="no points of O0"):
        read_aligned(perfect, np.eye(4))


def test_a_perfect_map_is_perfect_wherever_it_starts(cli, perfect, source) -> None:
    done = cli("evaluate", perfect, "--source", source, "--json")
    assert done.code == 0, done.err
    found = json.loads(done.out)
    truth = read_truth(source)
    assert found["ate_rmse_m"] == 0
    assert found["floors"].pop("boundary_error_m") < 2e-3
    assert found["floors"] == {"truth": 1, "map": 1, "count_equal": True, "right": 1}
    rooms, places, things = found["rooms"], found["locations"], found["objects"]
    assert (rooms["f1"], rooms["precision"], rooms["recall"]) == (1, 1, 1)
    assert rooms["hydra_precision"] > 0.98 and rooms["hydra_recall"] > 0.98
    assert places["truth"] == len(truth.locations) and places["f1_at"]["0.9"] == 1
    assert (things["truth"], things["found"]) == (len(truth.objects), len(truth.objects))
    assert (things["recall"], things["precision"], things["recall_50"]) == (1, 1, 1)
    assert things["mean_iou"] > 0.99 and things["top_k"]["auc"] > 0.99
    assert "questions" not in found


def test_what_a_map_lacks_is_missed(cli, source, tmp_path) -> None:
    truth = read_truth(source)
    half = truth.objects[: len(truth.objects) // 2]
    renamed = [replace(half[0], class_name="guitar" if half[0].class_name != "guitar" else "piano"), *half[1:]]
    folder = write_map(source, tmp_path / "map", renamed)
    things = json.loads(cli("evaluate", folder, "--source", source, "--json").out)["objects"]
    assert things["found"] == len(half) - 1 and things["map"] == len(half)
    assert things["precision"] == pytest.approx((len(half) - 1) / len(half), abs=1e-4)


def test_the_command_in_words_with_the_table(cli, perfect, source) -> None:
    done = cli("evaluate", perfect, "--source", source, "--per-class")
    lines = done.out.splitlines()
    assert [line.split()[0] for line in lines[:6]] == ["ATE", "floors", "rooms", "locations", "objects", "names"]
    assert "recall 1.000, precision 1.000" in lines[4]
    assert any(line.split()[:1] == ["class"] for line in lines)
    assert "class  " not in cli("evaluate", perfect, "--source", source).out


def test_questions_are_asked_and_scored(cli, perfect, source, tmp_path) -> None:
    truth = read_truth(source)
    names = [one.class_name for one in truth.objects]
    single = next(one for one in truth.objects if names.count(one.class_name) == 1)
    asked = [
        AskedQuestion(f"find the {single.class_name}", single.id, single.box, "name", (), single.room, 0),
        AskedQuestion("find the submarine", 0, truth.objects[0].box, "none", (), 0, 0),
    ]
    absent = cli("evaluate", perfect, "--source", source, "--questions")
    assert absent.code == 1 and absent.reason.endswith("no questions in truth/questions.json")
    settings = {"grounding": {"name_places": False, "use_model": False}}
    (perfect / "run.json").write_text(json.dumps({"config": {"run": {}, "nodes": settings}}))
    file = source / "truth" / "questions.json"
    file.write_text(json.dumps(to_json(asked)))
    try:
        found = json.loads(cli("evaluate", perfect, "--source", source, "--questions", "--json").out)["questions"]
        words = cli("evaluate", perfect, "--source", source, "--questions").out
    finally:
        file.unlink()
    assert (found["forms"]["name"]["acc_0.75"], found["forms"]["none"]["acc_0.1"]) == (1, 0)
    assert found["forms"]["none"]["not_in_map"] == 1 and found["all"]["acc_0.5"] == 0.5
    assert words.splitlines()[-1].split()[:3] == ["all", "2", "0.50"]


def test_without_truth_the_house_options_are_refused(cli, perfect, source, tmp_path) -> None:
    bare = tmp_path / "bare"
    bare.mkdir()
    for name in ("rgb.txt", "depth.txt", "groundtruth.txt", "calibration.txt", "rgb", "depth"):
        (bare / name).symlink_to(source / name)
    assert set(json.loads(cli("evaluate", perfect, "--source", bare, "--json").out)) == {
        "ate_rmse_m", "ate_max_m", "poses", "path_m",
    }  # fmt: skip
    refused = cli("evaluate", perfect, "--source", bare, "--questions")
    assert refused.code == 2 and "need a house with its truth" in refused.reason


def test_an_undefined_number_is_a_dash_and_null() -> None:
    assert (number(float("nan")), number(0.12345), number(2, 0)) == ("-", "0.123", "2")
    assert plain({"a": float("nan"), "b": {"c": 0.123456}, "d": 3, "e": True}) == {
        "a": None, "b": {"c": 0.1235}, "d": 3, "e": True,
    }  # fmt: skip
    assert table([("a", "bb"), ("ccc", "d")]) == "a    bb\nccc   d"


def test_a_house_of_which_nothing_was_seen_can_be_told(cli, perfect, source, tmp_path) -> None:
    truth = read_truth(source)
    for name in ("rgb.txt", "depth.txt", "groundtruth.txt", "calibration.txt", "rgb", "depth"):
        (tmp_path / name).symlink_to(source / name)
    write_truth(replace(truth, seen=tuple(Seen(one.id, 0, 0) for one in truth.objects)), tmp_path)
    found = json.loads(cli("evaluate", perfect, "--source", tmp_path, "--json").out)
    assert (found["objects"]["truth"], found["objects"]["recall"], found["locations"]["truth"]) == (0, None, 0)
    assert 0 < found["rooms"]["truth"] < found["rooms"]["of"]  # those that were walked through
    assert cli("evaluate", perfect, "--source", tmp_path).code == 0
