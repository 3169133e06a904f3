import numpy as np

from placegraph.nodes.fusion.mask_lifting import Observation
from placegraph.nodes.fusion.object_cloud import VoxelContext
from placegraph.nodes.fusion.object_instance import KeyframeStamp, ObjectInstance
from placegraph.nodes.fusion.voxel_index import sum_by_key, voxel_keys
from placegraph.runtime.vision.geometry import bounding_box


def seen(xyz, name="cup", score=0.5):
    values = np.concatenate((xyz, np.tile((10.0, 20, 30), (len(xyz), 1)), np.ones((len(xyz), 2))), axis=1)
    keys, values = sum_by_key(voxel_keys(xyz, 0.025), values)
    points = values[:, :3] / values[:, 6:7]
    return Observation(name, score, keys, values, points, bounding_box(points))


def new(number, observation, keyframe=0, frame_id=0):
    return ObjectInstance(number, observation, KeyframeStamp(keyframe, frame_id, 0), VoxelContext(0.025))


def block(low=0.0):
    axis = np.arange(0.0125, 0.2, 0.025)
    return low + np.stack(np.meshgrid(axis, axis, axis), axis=-1).reshape(-1, 3)


def test_geometry_of_one_point():
    points, color, *_ = new(0, seen(np.full((1, 3), 0.5)), 0, 0).geometry(0.075, 10)
    assert np.allclose(points, 0.5) and color.tolist() == [10, 20, 30]


def test_edge_points_of_single_views_do_not_inflate_the_box():
    instance = new(0, seen(np.r_[block(), [[0.6, 0.1, 0.1]]]), 0, 0)
    for k in range(1, 5):
        instance.update(seen(np.r_[block(), [[0.6 + 0.1 * k, 0.1, 0.1]]]), KeyframeStamp(k, k, 0))
    assert instance.box[1, 0] > 0.9
    box = bounding_box(instance.geometry(0.075, 10)[0])
    assert np.allclose(box, [[0.0125] * 3, [0.1875] * 3], atol=0.001)


def test_an_object_seen_from_all_around_keeps_every_side():
    parts = [block(0.175 * k) for k in range(5)]
    instance = new(0, seen(parts[0]), 0, 0)
    for k in range(1, 5):
        instance.update(seen(parts[k]), KeyframeStamp(k, k, 0))
    points = instance.geometry(0.075, 10).points
    assert points[:, 0].max() > 0.85 and points[:, 0].min() < 0.05


def test_a_small_leak_onto_the_background_goes():
    leak = np.array([[2.0, 0.1, 0.0125 + 0.025 * i] for i in range(12)])
    instance = new(0, seen(np.r_[block(), leak]), 0, 0)
    assert instance.geometry(0.075, 5)[0][:, 0].max() < 0.2


def test_merging_adds_views_and_votes():
    a, b = new(0, seen(block(), "cup"), 0, 3), new(1, seen(block(), "mug", 0.7), 1, 9)
    a.merge(b)
    assert a.observations == 2 and (a.first_frame, a.last_frame) == (3, 9)
    assert a.ranked_votes() == [("mug", 0.7), ("cup", 0.5)]
    assert len(a.points) == len(block()) and (a.values[:, 7] == 2).all()


def test_equal_votes_are_ordered_by_name():
    a = new(0, seen(block(), "mug"), 0, 0)
    a.update(seen(block(), "cup"), KeyframeStamp(1, 1, 0))
    assert [name for name, _ in a.ranked_votes()] == ["cup", "mug"]
