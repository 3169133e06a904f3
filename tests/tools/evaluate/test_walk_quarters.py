import numpy as np
import pytest

from placegraph.nodes.camera.tum import SOURCE as TUM
from placegraph.runtime.errors import SchemaError, SourceError
from placegraph.runtime.messages import Graph, Map, Segments
from placegraph.runtime.recording import RecordingWriter
from placegraph.runtime.scene_graph import GraphNode, SceneGraph, Tag
from placegraph.tools.evaluate.house_truth import visibility_of
from placegraph.tools.evaluate.walk_quarters import recorded_snapshots, walk_quarter_scores
from placegraph.tools.simulator.ground_truth import read_truth
from placegraph.tools.simulator.tum_export import HouseOrder, export

FRAMES = 8


@pytest.fixture(scope="module")
def source(tmp_path_factory):
    """A house of which a walk of 8 frames was filmed."""
    folder = tmp_path_factory.mktemp("house") / "made"
    export(HouseOrder(seed=5, floors=1, limit=FRAMES, width=64, height=48), folder, workers=1)
    return folder


@pytest.fixture(scope="module")
def given(source):
    return TUM(source, {}).given_poses()


def blank(kind, sizes, **values):
    """A message of zeros with the sizes of its letters, and these values."""

    def length(letter):
        return letter if isinstance(letter, int) else sizes.get(letter.removesuffix("+1"), 0) + letter.endswith("+1")

    arrays = {name: np.zeros([*map(length, spec.shape)], spec.dtype) for name, spec in kind.array_specs().items()}
    scalars = {name: () if hint == tuple[str, ...] else hint() for name, hint in kind.scalar_types().items()}
    return kind(**(arrays | scalars | values))


def corners(box):
    return np.array(np.meshgrid(*box.T, indexing="ij")).reshape(3, -1).T


def snapshot(source, given, revision, frames, shift, cameras=None):
    """Map and Graph of the whole house after some frames, in a world of its own that is shifted."""
    truth, stamps = read_truth(source), sorted(given)[:frames]
    sizes = {"N": len(truth.objects), "K": len(stamps), "Q": 8 * len(truth.objects)}
    points = [corners(one.box) + shift for one in truth.objects]
    positions = np.array([given[stamp][:3, 3] for stamp in stamps]) + shift
    if cameras is not None:
        positions, sizes["K"] = positions[:cameras], cameras
    age = {"frame_id": frames - 1, "stamp_ns": stamps[-1], "revision": revision}
    floor = truth.floors[0]
    low, high = (np.append(corner, z) + shift for corner, z in zip(
        (floor.outline.min(axis=0), floor.outline.max(axis=0)), (floor.z_m, floor.z_m + floor.height_m), strict=True
    ))  # fmt: skip
    slab = np.stack((low, high))

    def node(id, parent, box, outline, tags=()):
        return GraphNode(id=id, parent=parent, tags=tags, box=box, footprint=outline, first_frame=-1, last_frame=-1)

    nodes = [node("B0", "", slab, slab[:, :2]), node("F0", "B0", slab, slab[:, :2])]
    nodes += [node(f"R{room.id}", "F0", slab, room.polygon + shift[:2]) for room in truth.rooms]
    nodes += [
        node(f"O{one.id}", f"R{one.room}", one.box + shift, one.footprint + shift[:2], (Tag(one.class_name, 1.0),))
        for one in truth.objects
    ]
    made = blank(
        Map, sizes, **age, keyframes=sizes["K"], camera_positions_world=positions.astype(np.float32),
        object_ids=np.arange(len(points)), object_points_world=np.concatenate(points).astype(np.float32),
        object_point_offsets=8 * np.arange(len(points) + 1),
    )  # fmt: skip
    return [made, Graph(**age, final=False, json=SceneGraph.of(nodes).to_json())]


def record(folder, given, messages):
    folder.mkdir(exist_ok=True)
    writer = RecordingWriter(folder / "run.rrd", "test", {})
    for frame, stamp in enumerate(sorted(given)):
        writer.write(blank(Segments, {}, frame_id=frame, stamp_ns=stamp))
    for message in messages:
        writer.write(message)
    writer.close()
    return folder


def test_each_quarter_is_scored_against_what_was_seen_by_then(source, given, tmp_path) -> None:
    # after 6 frames the map lies elsewhere than after 8: a pose graph has moved it in between
    early = snapshot(source, given, 0, 6, np.array([3.0, -2, 0.4]))
    late = snapshot(source, given, 1, 8, np.array([-1.0, 5, 0.1]))
    found = walk_quarter_scores(record(tmp_path, given, [*early, *late]), source, given)
    assert list(found) == ["25%", "50%", "75%", "100%"]
    assert [row["frames"] for row in found.values()] == [2, 4, 6, 8]
    assert [row["keyframes"] for row in found.values()] == [0, 0, 6, 8]
    for part in ("25%", "50%"):  # no map yet, and in so few frames nothing was seen well
        objects = found[part]["objects"]
        assert (objects["map"], objects["truth"]) == (0, 0) and "ate_rmse_m" not in found[part]
        assert found[part]["rooms"]["recall"] == 0
    truth = read_truth(source)
    well = sum(visibility_of(one) == "well" for one in truth.seen)
    assert 0 < found["75%"]["objects"]["truth"] <= found["100%"]["objects"]["truth"] == well
    for part in ("75%", "100%"):
        assert found[part]["ate_rmse_m"] == 0 and found[part]["floors"]["right"] == 1
        assert found[part]["objects"]["recall"] == 1 and found[part]["objects"]["mean_iou"] > 0.99
        assert found[part]["rooms"]["recall"] == 1


def test_the_newest_graph_not_later_than_a_time_counts(source, given, tmp_path) -> None:
    stamps = sorted(given)
    shots = [snapshot(source, given, k, frames, np.zeros(3)) for k, frames in enumerate((3, 5))]
    unbuilt = [message for message in snapshot(source, given, 2, 6, np.zeros(3)) if isinstance(message, Map)]
    folder = record(tmp_path, given, [*shots[0], *shots[1], *unbuilt])
    parts = recorded_snapshots(folder / "run.rrd", [stamps[1], stamps[2], stamps[3], stamps[7]])
    assert [None if part is None else part.graph.revision for part in parts] == [None, 0, 0, 1]
    assert parts[3].stamps_ns == tuple(stamps[:5]) and parts[3].map.keyframes == 5


def test_recordings_that_do_not_fit_are_named(source, given, tmp_path) -> None:
    shot = snapshot(source, given, 0, 6, np.zeros(3))
    with pytest.raises(SchemaError, match=r"run\.rrd: holds Graph 0 without the Map"):
        walk_quarter_scores(record(tmp_path / "a", given, shot[1:]), source, given)
    with pytest.raises(SchemaError, match="Map 0 knows 5 keyframes, and 6 Segments"):
        walk_quarter_scores(record(tmp_path / "b", given, snapshot(source, given, 0, 6, np.zeros(3), 5)), source, given)
    with pytest.raises(SourceError, match=r"run\.rrd"):
        walk_quarter_scores(tmp_path / "none", source, given)


def test_a_map_of_two_keyframes_cannot_be_laid_onto_the_truth(source, given, tmp_path) -> None:
    found = walk_quarter_scores(record(tmp_path, given, snapshot(source, given, 0, 2, np.zeros(3))), source, given)
    assert found["100%"]["objects"]["map"] == 0 and found["100%"]["keyframes"] == 2


def test_damaged_images_of_the_truth_are_named(source, given, tmp_path) -> None:
    (tmp_path / "truth" / "instances").mkdir(parents=True)
    for file in (source / "truth").glob("*.json"):
        (tmp_path / "truth" / file.name).symlink_to(file)
    folder = record(tmp_path / "map", given, snapshot(source, given, 0, 6, np.zeros(3)))
    image = tmp_path / "truth" / "instances" / "000000.png"
    with pytest.raises(SourceError, match=r"000000\.png: cannot be read"):
        walk_quarter_scores(folder, tmp_path, given)
    image.write_bytes(b"")
    with pytest.raises(SourceError, match=r"000000\.png: not the image of object ids"):
        walk_quarter_scores(folder, tmp_path, given)
    with pytest.raises(SourceError, match="3 frames have a pose"):
        walk_quarter_scores(folder, tmp_path, dict(list(given.items())[:3]))
