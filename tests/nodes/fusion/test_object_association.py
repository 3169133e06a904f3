import numpy as np
import pytest

from placegraph.nodes.fusion.mask_lifting import Observation
from placegraph.nodes.fusion.object_association import AssociationConfig, ObjectMap
from placegraph.nodes.fusion.object_cloud import VoxelContext
from placegraph.nodes.fusion.object_instance import KeyframeStamp
from placegraph.nodes.fusion.voxel_index import sum_by_key, voxel_keys
from placegraph.runtime.vision.geometry import bounding_box

NAMES = ["chair", "table", "cup", "couch", "sofa", "bed"]


def encode(names):
    rows = np.zeros((len(names), 6), np.float32)
    for i, name in enumerate(names):
        if name in NAMES:
            rows[i, NAMES.index("couch" if name == "sofa" else name)] = 1
    return rows


@pytest.fixture
def objects():
    return ObjectMap(encode, VoxelContext(0.025), AssociationConfig())


def surface(low, high, name, faces="all", score=0.5):
    """The surface of a box as an observation; faces: 'all', or those towards one side, such as '-y'."""
    low, high = np.asarray(low, float), np.asarray(high, float)
    axes = [np.arange(a + 0.0125, max(b, a + 0.02), 0.025) for a, b in zip(low, high, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    shape = grid.shape[:3]
    index = np.indices(shape)
    keep = np.zeros(shape, bool)
    for axis, letter in enumerate("xyz"):
        if faces in ("all", "-" + letter):
            keep |= index[axis] == 0
        if faces in ("all", "+" + letter):
            keep |= index[axis] == shape[axis] - 1
    xyz = grid[keep]
    values = np.concatenate((xyz, np.full((len(xyz), 3), 100.0), np.ones((len(xyz), 2))), axis=1)
    keys, values = sum_by_key(voxel_keys(xyz, 0.025), values)
    points = values[:, :3] / values[:, 6:7]
    return Observation(name, score, keys, values, points, bounding_box(points))


def test_a_view_of_nothing(objects):
    objects.add([], KeyframeStamp(0, 0, 0))
    objects.merge_duplicates(0)
    assert objects.instances == {}


def test_the_same_thing_again_is_one_object_with_votes_of_all_views(objects):
    for k, name in enumerate(("couch", "sofa", "couch")):
        objects.add([surface((0, 0, 0), (1.5, 0.8, 0.8), name)], KeyframeStamp(k, 10 * k, 0))
    (couch,) = objects.instances.values()
    assert couch.observations == 3 and (couch.first_frame, couch.last_frame) == (0, 20)
    assert couch.ranked_votes() == [("couch", 1.0), ("sofa", 0.5)]


def test_a_thing_elsewhere_is_another_object(objects):
    objects.add([surface((0, 0, 0), (0.5, 0.5, 0.9), "chair")], KeyframeStamp(0, 0, 0))
    objects.add([surface((0.8, 0, 0), (1.3, 0.5, 0.9), "chair")], KeyframeStamp(1, 1, 0))
    assert sorted(objects.instances) == [0, 1]


def test_two_chairs_side_by_side_in_one_view_stay_two_and_are_not_merged_later(objects):
    for k in range(20):
        left = surface((0, 0, 0), (0.5, 0.5, 0.9), "chair")
        right = surface((0.5, 0, 0), (1.0, 0.5, 0.9), "chair")
        objects.add([left, right], KeyframeStamp(k, k, 0))
    assert [i.observations for i in objects.instances.values()] == [20, 20]


def test_the_table_does_not_swallow_the_cup_on_it(objects):
    table = ((0, 0, 0.7), (1.2, 0.8, 0.75))
    for k in range(12):
        cup = surface((0.5, 0.4, 0.75), (0.6, 0.5, 0.85), "cup")
        objects.add([surface(*table, "table"), cup], KeyframeStamp(k, k, 0))
    assert [max(i.votes, key=i.votes.get) for i in objects.instances.values()] == ["table", "cup"]
    assert [i.observations for i in objects.instances.values()] == [12, 12]


def test_a_cup_inside_the_tables_own_cloud_is_still_a_cup(objects):
    tall = surface((0, 0, 0.7), (1.2, 0.8, 0.85), "table")  # a mask that held what stands on the table
    for k in range(12):
        objects.add([tall, surface((0.5, 0.4, 0.75), (0.6, 0.5, 0.85), "cup")], KeyframeStamp(k, k, 0))
    assert len(objects.instances) == 2


def test_two_sides_of_one_chair_become_one_object(objects):
    box = ((0, 0, 0), (0.5, 0.1, 0.9))
    objects.add([surface(*box, "chair", "-y")], KeyframeStamp(0, 0, 0))
    objects.add([surface(*box, "chair", "+y")], KeyframeStamp(1, 1, 0))
    objects.add([surface(*box, "chair", "all")], KeyframeStamp(2, 2, 0))  # on the way round, both were seen
    objects.merge_duplicates(2)
    assert len(objects.instances) == 1
    assert next(iter(objects.instances.values())).observations == 3


def test_a_detector_that_changes_its_mind_about_one_thing_makes_one_object(objects):
    for k, name in enumerate(("couch", "bed", "couch")):
        objects.add([surface((0, 0, 0), (1.5, 0.8, 0.8), name)], KeyframeStamp(k, k, 0))
    assert len(objects.instances) == 1


def test_names_without_an_embedding_match_when_equal(objects):
    for k in range(3):
        objects.add([surface((0, 0, 0), (0.5, 0.5, 0.5), "zzz")], KeyframeStamp(k, k, 0))
    assert [i.observations for i in objects.instances.values()] == [3]


def test_merging_shrinks_a_chain_to_one_object_and_keeps_the_lowest_number(objects):
    for k in range(4):  # pieces that do not overlap enough one by one
        objects.add([surface((k, 0, 0), (k + 1.0, 0.8, 0.8), "couch")], KeyframeStamp(k, k, 0))
    assert len(objects.instances) == 4
    objects.add([surface((0, 0, 0), (4, 0.8, 0.8), "couch")], KeyframeStamp(4, 4, 0))
    objects.merge_duplicates(4)
    assert list(objects.instances) == [0]
    assert objects.instances[0].observations == 5
    objects.merge_duplicates(4)
    assert list(objects.instances) == [0]


def test_what_was_seen_once_long_ago_goes_and_its_number_is_not_used_again(objects):
    objects.add([surface((0, 0, 0), (0.5, 0.5, 0.5), "cup")], KeyframeStamp(0, 0, 0))
    for k in range(1, 30):
        objects.add([surface((5, 0, 0), (5.5, 0.5, 0.5), "chair")], KeyframeStamp(k, k, 0))
    assert list(objects.instances) == [1]
    objects.add([surface((0, 0, 0), (0.5, 0.5, 0.5), "cup")], KeyframeStamp(30, 30, 0))
    assert list(objects.instances) == [1, 2]


def test_a_second_mask_of_one_view_is_no_further_observation(objects):
    twice = [surface((0, 0, 0), (1, 0.8, 0.8), "couch"), surface((0, 0, 0), (0.9, 0.8, 0.8), "couch")]
    objects.add(twice, KeyframeStamp(0, 0, 0))
    (couch,) = objects.instances.values()
    assert couch.observations == 1 and couch.votes == {"couch": 1.0}


def test_comparisons_grow_with_neighbors_and_not_with_all_objects(monkeypatch):
    objects = ObjectMap(encode, VoxelContext(0.025), AssociationConfig(prune_after=1000))
    calls = 0
    shares = ObjectMap._overlap_shares

    def counting(self, *args):
        nonlocal calls
        calls += 1
        return shares(self, *args)

    monkeypatch.setattr(ObjectMap, "_overlap_shares", counting)
    for k in range(100):
        objects.add([surface((2.0 * k, 0, 0), (2.0 * k + 0.2, 0.2, 0.2), "cup")], KeyframeStamp(k, k, 0))
    objects.merge_duplicates(0)
    assert len(objects.instances) == 100 and calls == 0
    objects.add([surface((20.0, 0, 0), (20.2, 0.2, 0.2), "cup")], KeyframeStamp(101, 101, 0))
    assert calls == 1


def test_two_chairs_that_were_taken_for_one_are_told_apart_by_views_with_a_gap(objects):
    left, right = ((0, 0, 0), (0.5, 0.5, 0.9)), ((0.7, 0, 0), (1.2, 0.5, 0.9))
    objects.add([surface((0, 0, 0), (1.2, 0.5, 0.9), "chair")], KeyframeStamp(0, 0, 0))  # one mask over both
    for k in range(1, 14):
        objects.add([surface(*left, "chair"), surface(*right, "chair")], KeyframeStamp(k, k, 0))
    assert sorted(objects.instances) == [0, 1]
    for box, expected in zip((objects.instances[0].box, objects.instances[1].box), (left, right), strict=True):
        assert np.allclose(box, expected, atol=0.13)  # the first mask's bridge is shared out between them


def test_one_thing_behind_a_post_stays_one(objects):
    for k in range(12):
        halves = [surface((0, 0, 0), (0.8, 0.8, 0.8), "couch"), surface((1.0, 0, 0), (1.8, 0.8, 0.8), "couch")]
        whole = [surface((0, 0, 0), (1.8, 0.8, 0.8), "couch")]
        objects.add(whole if k % 2 == 0 else halves, KeyframeStamp(k, k, 0))
    assert list(objects.instances) == [0]


def test_two_sides_of_a_thin_board_that_share_no_point_become_one(objects):
    objects.add([surface((0, 0, 0), (0.6, 0.02, 0.9), "lamp")], KeyframeStamp(0, 0, 0))
    objects.add([surface((0, 0.1, 0), (0.6, 0.12, 0.9), "lamp")], KeyframeStamp(1, 1, 0))
    objects.merge_duplicates(1)
    assert list(objects.instances) == [0]


def test_two_cups_that_were_seen_together_are_not_taken_for_two_sides(objects):
    first, second = ((0, 0, 0), (0.08, 0.08, 0.1)), ((0.12, 0, 0), (0.2, 0.08, 0.1))
    objects.add([surface(*first, "cup"), surface(*second, "cup")], KeyframeStamp(0, 0, 0))
    objects.merge_duplicates(0)
    assert len(objects.instances) == 2
