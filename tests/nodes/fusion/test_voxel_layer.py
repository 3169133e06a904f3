import numpy as np

from placegraph.nodes.fusion.voxel_layer import MAX_POINTS_PER_VOXEL, MAX_SUBMAPS_PER_VOXEL, VoxelLayer, with_capacity


def layer(keep=True):
    return VoxelLayer(np.full(3, 0.1), 2, keep)


def ones(n, value=1):
    return np.full((n, 2), value, np.int32)


def test_nothing():
    one = layer()
    one.add(np.zeros(0, np.int64), ones(0), 0)
    one.remove(np.zeros(0, np.int64))
    one.close_submap()
    one.move_submap(7, np.eye(4))
    assert len(one) == 0


def test_sums_add_up_and_a_cell_takes_from_a_few_submaps_only():
    one, keys = layer(), np.arange(5, dtype=np.int64)
    for submap in range(10):
        for _ in range(3):
            one.add(keys, ones(5), submap)
    assert (one.sums[one.occupied_rows()] == 3 * MAX_SUBMAPS_PER_VOXEL).all()
    assert list(one._by_submap) == [0, 1, 2, 3]


def test_where_nothing_moves_counts_stop_before_they_overflow():
    one, keys = layer(keep=False), np.arange(1, dtype=np.int64)
    for _ in range(3):
        one.add(keys, ones(1, MAX_POINTS_PER_VOXEL), 0)
    assert one.sums[0].tolist() == [MAX_POINTS_PER_VOXEL] * 2


def test_cells_that_every_submap_has_lost_leave_no_submap_behind():
    one, keys = layer(), np.arange(5, dtype=np.int64)
    one.add(keys, ones(5), 0)
    one.add(keys, ones(5), 1)
    one.remove(one.occupied_rows())
    one.close_submap()
    assert len(one) == 0 and list(one._by_submap) == [1]  # the open one, which is empty
    assert not len(one._by_submap[1].fused()[0])


def test_enlarged_arrays_keep_what_they_hold():
    assert with_capacity(np.array([1, 2]), 4, -1).tolist() == [1, 2, -1, -1]
