import numpy as np
import pytest

from placegraph.nodes.fusion.cells import pack, sum_by_key, unpack
from placegraph.nodes.fusion.voxels import FreeSpace, VoxelMap, depth_edges
from placegraph.runtime.errors import SchemaError


def colors(n, value=10):
    return np.full((n, 3), value, np.uint8)


def test_pack_and_unpack_give_the_cell_centre():
    xyz = np.array([[0.01, -0.01, 7.32], [-3.0, 0.05, -0.05]])
    assert np.allclose(unpack(pack(xyz, 0.05), 0.05), [[0.025, -0.025, 7.325], [-2.975, 0.075, -0.025]])


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e9])
def test_points_that_cannot_be_packed_are_refused(bad):
    with pytest.raises(SchemaError, match="not finite or more than"):
        pack(np.array([[0.0, bad, 0.0]]), 0.05)


def test_sum_by_key_of_nothing_and_of_shared_keys():
    keys, sums = sum_by_key(np.zeros(0, np.int64), np.zeros((0, 2)))
    assert keys.shape == (0,) and sums.shape == (0, 2)
    keys, sums = sum_by_key(np.array([7, 3, 7]), np.array([[1.0], [10], [2]]))
    assert keys.tolist() == [3, 7] and sums.tolist() == [[10], [3]]


def test_empty_map():
    voxels = VoxelMap(0.05)
    voxels.fuse(np.zeros((0, 3)), colors(0))
    assert len(voxels) == 0 and voxels.points().shape == (0, 3) and voxels.colors().shape == (0, 3)


def test_points_of_one_voxel_are_averaged_over_calls():
    voxels = VoxelMap(1.0)
    voxels.fuse(np.array([[0.2, 0.2, 0.2]]), colors(1, 10))
    voxels.fuse(np.array([[0.4, 0.6, 0.2], [1.5, 0.0, 0.0]]), colors(2, 20))
    assert np.allclose(voxels.points(), [[0.3, 0.4, 0.2], [1.5, 0, 0]], atol=1e-3)
    assert voxels.colors().tolist() == [[15] * 3, [20] * 3]


def test_map_grows_past_its_first_size_and_keeps_old_rows():
    xyz = np.stack((np.arange(5000.0), np.zeros(5000), np.zeros(5000)), axis=1)
    voxels = VoxelMap(1.0)
    for part in np.split(xyz, 10):
        voxels.fuse(part, colors(len(part)))
    assert np.allclose(voxels.points(), xyz)


def test_flat_and_slanted_depth_has_no_edges_but_a_jump_has():
    flat = np.full((6, 8), 2.0, np.float32)
    assert not depth_edges(flat).any()
    slanted = flat + 0.02 * np.arange(8, dtype=np.float32)
    assert not depth_edges(slanted).any()
    jump = flat.copy()
    jump[:, 4:] = 3
    assert np.flatnonzero(depth_edges(jump).all(axis=0)).tolist() == [3, 4]


def test_missing_depth_is_no_edge():
    depth = np.full((5, 5), 2.0, np.float32)
    depth[2, 2] = 0
    assert not depth_edges(depth).any()
    assert not depth_edges(np.zeros((5, 5), np.float32)).any()


def test_a_ray_frees_what_it_crosses_and_not_what_it_hits():
    free = FreeSpace(0.1, 0.5, 0.15)
    free.carve(np.array([0.0, 0.05, 0.25]), np.array([[2.0, 0.05, 0.25]]))
    x = np.sort(free.points()[:, 0])
    assert np.allclose(x, np.arange(0.05, 1.9, 0.1), atol=1e-6)
    assert np.allclose(free.points()[:, 1:], [0.05, 0.25])


def test_nothing_is_carved_without_points_or_closer_than_the_clearance():
    free = FreeSpace(0.1, 0.5, 0.15)
    free.carve(np.zeros(3), np.zeros((0, 3)))
    free.carve(np.zeros(3), np.array([[0.1, 0, 0], [0, 0, 0]]))
    assert len(free) == 0 and free.points().shape == (0, 3)


def test_carving_again_adds_nothing():
    free = FreeSpace(0.1, 0.5, 0.15)
    for _ in range(2):
        free.carve(np.array([0.0, 0.0, 1.0]), np.array([[3.0, 1.0, 0.0]]))
        count = len(free)
    once = FreeSpace(0.1, 0.5, 0.15)
    once.carve(np.array([0.0, 0.0, 1.0]), np.array([[3.0, 1.0, 0.0]]))
    assert count == len(once) > 20
