import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from placegraph.nodes.camera.tum import SOURCE as TUM
from placegraph.runtime.errors import SchemaError
from placegraph.runtime.messages import Pose
from placegraph.runtime.scene_graph import GraphNode, SceneGraph, Tag
from placegraph.runtime.vision.geometry import inverse, transform
from placegraph.tools.evaluate.aligned_map import align_folder
from placegraph.tools.evaluate.house_truth import HOUSE_VOCABULARY, MIN_FRAMES, house_ground_truth, visibility_of
from placegraph.tools.map_files.map_folder import read_graph, read_object_clouds
from placegraph.tools.map_files.ply import write_points
from placegraph.tools.map_files.trajectory_file import write_trajectory
from placegraph.tools.simulator.ground_truth import FrameCounts, read_truth, truth_of, write_truth
from placegraph.tools.simulator.house_frames import generate_house
from placegraph.tools.simulator.object_classes import CLASSES
from placegraph.tools.simulator.questions import HouseQuestion, to_json
from placegraph.tools.simulator.tum_export import HouseOrder, export

ORDER = HouseOrder(seed=5, floors=1, limit=4, width=64, height=48)
MAP_FROM_TRUE = np.eye(4)
MAP_FROM_TRUE[:3, :3] = Rotation.from_euler("z", 0.7).as_matrix()
MAP_FROM_TRUE[:3, 3] = (4, -5, 0.6)


@pytest.fixture(scope="module")
def source(tmp_path_factory):
    """A house folder of few frames whose truth says that every object was seen well."""
    folder = tmp_path_factory.mktemp("house") / "made"
    run = export(ORDER, folder, workers=1)
    house = generate_house(ORDER.seed, ORDER.floors)
    seen = tuple(FrameCounts(item.id, MIN_FRAMES, MIN_FRAMES) for item in house.items)
    write_truth(truth_of(house, run, seen), folder)
    return folder


def corners(box):
    x, y, z = np.array(np.meshgrid(*box.T, indexing="ij")).reshape(3, -1)
    return np.stack((x, y, z), axis=1)


def into_map(outline):
    return outline @ MAP_FROM_TRUE[:2, :2].T + MAP_FROM_TRUE[:2, 3]


def node(id, parent, box, outline, tags=()):
    return GraphNode(id=id, parent=parent, tags=tags, box=box, footprint=outline, first_frame=-1, last_frame=-1)


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


def test_boxes_are_made_anew_from_the_clouds(perfect, source) -> None:
    aligned_map = align_folder(perfect, read_graph(perfect), inverse(MAP_FROM_TRUE))
    truth = read_truth(source)
    by_id = {one.id: one for one in aligned_map.objects}
    for one in truth.objects:
        assert by_id[f"O{one.id}"].box == pytest.approx(one.box, abs=1e-4)
    assert aligned_map.floors[0] == pytest.approx([0, truth.floors[0].height_m], abs=2e-3)
    assert aligned_map.rooms[0].outline == pytest.approx(truth.rooms[0].polygon, abs=2e-3)


def test_damaged_clouds_are_named(perfect) -> None:
    file = perfect / "objects.ply"
    whole = file.read_bytes()
    for damaged in (b"", whole[:-1], whole.replace(b"int object", b"int thing")):
        file.write_bytes(damaged)
        with pytest.raises(SchemaError, match=r"objects\.ply: (not a PLY file|cut short|not the objects' points)"):
            read_object_clouds(perfect)
    file.unlink()
    with pytest.raises(SchemaError, match=r"objects\.ply: cannot read"):
        align_folder(perfect, read_graph(perfect), np.eye(4))


def test_clouds_of_another_run_are_noticed(perfect) -> None:
    write_points(perfect / "objects.ply", np.zeros((0, 3)), {"object": np.zeros(0, np.int32)})
    assert read_object_clouds(perfect) == {}
    with pytest.raises(SchemaError, match="no points of O0"):
        align_folder(perfect, read_graph(perfect), np.eye(4))


def test_a_perfect_map_is_perfect_wherever_it_starts(cli, perfect, source) -> None:
    done = cli("evaluate", "map", perfect, "--source", source, "--json")
    assert done.code == 0, done.err
    found = json.loads(done.out)
    truth = read_truth(source)
    assert found["ate_rmse_m"] == 0
    assert found["floors"].pop("boundary_error_m") < 2e-3
    assert found["floors"] == {
        "truth": 1, "of": 1, "map": 1, "count_equal": True, "right": 1, "precision": 1, "recall": 1,
    }  # fmt: skip
    assert (found["ate_share"], found["rpe_m"]) == (0, None)  # so few frames are no metre of path
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
    things = json.loads(cli("evaluate", "map", folder, "--source", source, "--json").out)["objects"]
    assert things["found"] == len(half) - 1 and things["map"] == len(half)
    assert things["precision"] == pytest.approx((len(half) - 1) / len(half), abs=1e-4)


def test_the_command_in_words_with_the_table(cli, perfect, source) -> None:
    done = cli("evaluate", "map", perfect, "--source", source, "--per-class")
    lines = done.out.splitlines()
    assert [line.split()[0] for line in lines[:6]] == ["ATE", "floors", "rooms", "locations", "objects", "names"]
    assert "recall 1.000, precision 1.000" in lines[4]
    assert any(line.split()[:1] == ["class"] for line in lines)
    assert "class  " not in cli("evaluate", "map", perfect, "--source", source).out


def test_questions_are_asked_and_scored(cli, perfect, source, tmp_path) -> None:
    truth = read_truth(source)
    names = [one.class_name for one in truth.objects]
    single = next(one for one in truth.objects if names.count(one.class_name) == 1)
    asked = [
        HouseQuestion(f"find the {single.class_name}", single.id, single.box, "name", (), single.room, 0),
        HouseQuestion("find the submarine", 0, truth.objects[0].box, "none", (), 0, 0),
    ]
    absent = cli("evaluate", "map", perfect, "--source", source, "--questions")
    assert absent.code == 1 and absent.reason.endswith("no questions in truth/questions.json")
    settings = {"grounding": {"use_model": False}}
    (perfect / "run.json").write_text(json.dumps({"config": {"run": {}, "nodes": settings}}))
    file = source / "truth" / "questions.json"
    file.write_text(json.dumps(to_json(asked)))
    try:
        found = json.loads(cli("evaluate", "map", perfect, "--source", source, "--questions", "--json").out)[
            "questions"
        ]
        words = cli("evaluate", "map", perfect, "--source", source, "--questions").out
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
    assert set(json.loads(cli("evaluate", "map", perfect, "--source", bare, "--json").out)) == {
        "ate_rmse_m", "ate_max_m", "poses", "path_m", "ate_share", "rpe_m", "rpe_deg", "poses_given",
    }  # fmt: skip
    assert cli("evaluate", "map", perfect, "--source", bare).out.startswith("ATE rmse 0.0 m")
    refused = cli("evaluate", "map", perfect, "--source", bare, "--questions")
    assert refused.code == 2 and "need a house with its truth" in refused.reason


def test_seen_well_needs_frames_and_pixels() -> None:
    assert visibility_of(FrameCounts(0, 99, MIN_FRAMES)) == "well"
    assert (
        visibility_of(FrameCounts(0, 99, MIN_FRAMES - 1)) == "poorly" and visibility_of(FrameCounts(0, 0, 0)) == "never"
    )


def test_every_word_has_one_class() -> None:
    words = HOUSE_VOCABULARY.class_of_word
    assert words["couch"] == "sofa" and words["mug"] == "cup" and words["book"] == "book"
    assert all(words[one.name] == one.name for one in CLASSES)  # normal form of a name is the name itself


def test_what_the_walk_did_not_show_is_not_asked_for(source) -> None:
    truth = read_truth(source)
    place = next(one for one in truth.locations if len(one.members) >= 3)
    shown = {place.members[0]}
    seen = [FrameCounts(one.id, 9, 9 if one.id in shown else 0) for one in truth.objects]
    nowhere = np.array([[0.0, 0.0, 99.0]])
    known = house_ground_truth(truth, seen, nowhere)
    assert [one.seen for one in known.floors] == [False]
    assert [one.id for one, kept in zip(truth.rooms, known.rooms, strict=True) if kept.seen] == [place.room]
    assert not any(one.seen for one in known.locations)  # one of three members is less than half
    assert {one.seen for one in known.objects} == {"well", "poorly"}
    inside = np.array([[*truth.rooms[0].polygon.mean(axis=0), truth.floors[0].z_m + 1.5]])
    assert (
        house_ground_truth(truth, seen, inside).floors[0].seen and house_ground_truth(truth, seen, inside).rooms[0].seen
    )
    climbing = inside - (0, 0, 0.8)  # the camera is above the storey's surface, whoever carries it is not
    assert not house_ground_truth(truth, seen, climbing).floors[0].seen


def test_the_truth_of_a_house_as_a_file_gives_the_same_scores(cli, perfect, source, tmp_path) -> None:
    file = tmp_path / "truth.json"
    by_source = json.loads(cli("evaluate", "map", perfect, "--source", source, "--write-truth", file, "--json").out)
    done = cli("evaluate", "map", perfect, "--against", file, "--json")
    assert done.code == 0, done.err
    by_file = json.loads(done.out)
    assert by_source.pop("poses_given") == 4
    assert by_source.keys() >= by_file.keys() == {
        "floors", "rooms", "locations", "objects",
        "ate_rmse_m", "ate_max_m", "poses", "path_m", "ate_share", "rpe_m", "rpe_deg",
    }  # fmt: skip
    for layer in ("floors", "rooms"):
        assert by_file[layer] == pytest.approx(by_source[layer], abs=2e-3)  # a file rounds to 1 mm
    assert by_file["locations"]["f1_at"] == by_source["locations"]["f1_at"]
    assert by_file["objects"]["classes"] == by_source["objects"]["classes"]
    assert by_file["objects"]["top_k"] == by_source["objects"]["top_k"]


def test_a_truth_file_with_parts_left_out(cli, perfect, source, tmp_path) -> None:
    truth = read_truth(source)
    file = tmp_path / "truth.json"
    boxes = [transform(MAP_FROM_TRUE, corners(one.box)) for one in truth.objects]
    objects = [{"name": o.class_name, "box": extent(b).tolist()} for o, b in zip(truth.objects, boxes, strict=True)]
    file.write_text(json.dumps({"version": 1, "objects": objects}))  # in the map's frame: no trajectory to lay it by
    found = json.loads(cli("evaluate", "map", perfect, "--against", file, "--json").out)
    assert set(found) == {"objects"} and (found["objects"]["recall"], found["objects"]["precision"]) == (1, 1)
    lines = cli("evaluate", "map", perfect, "--against", file).out.splitlines()
    assert [line.split()[0] for line in lines] == ["objects", "names", "floors", "rooms", "locations", "trajectory"]
    assert all("not in the truth: not scored" in line for line in lines[2:])


def test_several_maps_are_one_table_with_means(cli, source, tmp_path) -> None:
    truth = read_truth(source)
    whole = write_map(source, tmp_path / "whole")
    half = write_map(source, tmp_path / "half", truth.objects[: len(truth.objects) // 2])
    two = ("evaluate", "map", whole, half, "--source", source, "--source", source)
    found = json.loads(cli(*two, "--json").out)
    assert found["maps"][str(whole)]["objects"]["recall"] == 1
    recall = found["maps"][str(half)]["objects"]["recall"]
    assert found["mean"]["obj R"] == pytest.approx((1 + recall) / 2, abs=1e-3) and recall < 0.6
    lines = cli(*two).out.splitlines()
    assert [line.split()[0] for line in lines] == ["map", str(whole), str(half), "mean"]
    file = tmp_path / "rooms.json"
    polygon = into_map(truth.rooms[0].polygon).tolist()
    file.write_text(json.dumps({"version": 1, "rooms": [{"polygon": polygon}]}))
    head = cli("evaluate", "map", whole, half, "--against", file, "--against", file).out.splitlines()[0]
    assert "room F1" in head and "obj P" not in head and "ATE" not in head


def test_only_a_house_has_quarters_and_a_truth_to_write(cli, perfect, source, tmp_path) -> None:
    for name in ("rgb.txt", "depth.txt", "groundtruth.txt", "calibration.txt", "rgb", "depth"):
        (tmp_path / name).symlink_to(source / name)
    for option in (("--progress",), ("--write-truth", tmp_path / "t.json")):
        done = cli("evaluate", "map", perfect, "--source", tmp_path, *option)
        assert done.code == 2 and f"{option[0]} needs a house with its truth" in done.reason


def test_a_house_of_which_nothing_was_seen_can_be_told(cli, perfect, source, tmp_path) -> None:
    truth = read_truth(source)
    for name in ("rgb.txt", "depth.txt", "groundtruth.txt", "calibration.txt", "rgb", "depth"):
        (tmp_path / name).symlink_to(source / name)
    write_truth(replace(truth, seen=tuple(FrameCounts(one.id, 0, 0) for one in truth.objects)), tmp_path)
    found = json.loads(cli("evaluate", "map", perfect, "--source", tmp_path, "--json").out)
    assert (found["objects"]["truth"], found["objects"]["recall"], found["locations"]["truth"]) == (0, None, 0)
    assert 0 < found["rooms"]["truth"] < found["rooms"]["of"]  # those that were walked through
    assert cli("evaluate", "map", perfect, "--source", tmp_path).code == 0
