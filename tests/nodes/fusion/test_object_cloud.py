from copy import deepcopy

import numpy as np

from placegraph.nodes.fusion.object_cloud import MAX_SUBMAPS_PER_OBJECT, ObjectCloud, VoxelContext
from placegraph.nodes.fusion.voxel_index import sum_by_key, voxel_keys


def view(low=0.0, count=20):
    xyz = np.stack((low + 0.0125 + 0.025 * np.arange(count), np.full(count, 0.0125), np.full(count, 0.0125)), axis=1)
    values = np.concatenate((xyz, np.full((count, 3), 50.0), np.ones((count, 2))), axis=1)
    return sum_by_key(voxel_keys(xyz, 0.025), values)


def shifted(x):
    pose = np.eye(4)
    pose[0, 3] = x
    return pose


def points(cloud):
    return cloud.values[:, :3] / cloud.values[:, 6:7]


def test_voxels_follow_their_submaps():
    cloud = ObjectCloud(*view(0.0), 0, VoxelContext(0.025, keep_submaps=True))
    cloud.add(*view(1.0), 1)
    assert cloud.is_from_any([1, 2]) and not cloud.is_from_any([2])
    cloud.move_submaps({1: shifted(0.5)})
    assert np.allclose(np.sort(points(cloud)[:, 0]), np.r_[view(0.0)[1][:, 0], view(1.0)[1][:, 0] + 0.5])


def test_mask_shares_are_kept_through_a_move():
    cloud = ObjectCloud(*view(), 0, VoxelContext(0.025, keep_submaps=True))
    cloud.count_visible(cloud.keys[:5])
    cloud.count_visible(cloud.keys[:5])
    before = cloud.mask_shares()
    assert before[:5].tolist() == [0.5] * 5 and before[5:].min() == 1
    cloud.move_submaps({0: shifted(2.0)})
    assert np.allclose(cloud.mask_shares(), before)


def test_removed_voxels_stay_removed_through_a_move():
    cloud = ObjectCloud(*view(), 0, VoxelContext(0.025, keep_submaps=True))
    cloud.remove(np.arange(20) < 12)
    cloud.move_submaps({0: shifted(1.0)})
    assert len(cloud.keys) == 8


def test_the_oldest_submaps_are_merged_and_no_point_is_lost():
    cloud = ObjectCloud(*view(), 0, VoxelContext(0.025, keep_submaps=True))
    for submap in range(1, 3 * MAX_SUBMAPS_PER_OBJECT):
        cloud.add(*view(0.1 * submap), submap)
    assert len(cloud._by_submap) == MAX_SUBMAPS_PER_OBJECT
    before = points(cloud)
    cloud.move_submaps({})
    assert np.allclose(points(cloud), before)


def test_where_nothing_moves_nothing_is_kept_by_submap():
    cloud = ObjectCloud(*view(), 0, VoxelContext(0.025))
    cloud.add(*view(), 1)
    assert cloud._by_submap == {} and (cloud.values[:, 7] == 2).all()


def test_a_copy_changes_on_its_own():
    cloud = ObjectCloud(*view(), 0, VoxelContext(0.025, keep_submaps=True))
    other = deepcopy(cloud)
    other.remove(np.arange(20) < 12)
    other.add(*view(3.0), 1)
    assert len(cloud.keys) == 20 and list(cloud._by_submap) == [0]
