import numpy as np
import pytest

from placegraph.nodes.fusion.voxel_index import VoxelIndex, sum_by_key, voxel_centers, voxel_keys
from placegraph.runtime.errors import SchemaError

VOXEL = np.full(3, 0.05)


def test_the_center_of_a_points_voxel():
    xyz = np.array([[0.01, -0.01, 7.32], [-3.0, 0.05, -0.05]])
    assert np.allclose(voxel_centers(voxel_keys(xyz, 0.05), 0.05), [[0.025, -0.025, 7.325], [-2.975, 0.075, -0.025]])


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e9])
def test_points_without_a_voxel_key_are_refused(bad):
    with pytest.raises(SchemaError, match="not finite or more than"):
        voxel_keys(np.array([[0.0, bad, 0.0]]), 0.05)


def test_sum_by_key_of_nothing_and_of_shared_keys():
    keys, sums = sum_by_key(np.zeros(0, np.int64), np.zeros((0, 2)))
    assert keys.shape == (0,) and sums.shape == (0, 2)
    keys, sums = sum_by_key(np.array([7, 3, 7]), np.array([[1.0], [10], [2]]))
    assert keys.tolist() == [3, 7] and sums.tolist() == [[10], [3]]


def test_a_cell_keeps_its_row_whatever_comes_later():
    random, index = np.random.default_rng(0), VoxelIndex(VOXEL)
    rows: dict[int, int] = {}
    for _ in range(20):
        keys = np.unique(voxel_keys(random.uniform(-5, 5, (200, 3)), 0.5))
        for key, row in zip(keys.tolist(), index.rows(keys).tolist(), strict=True):
            assert rows.setdefault(key, row) == row
    assert sorted(rows.values()) == list(range(len(index)))
    assert index.rows(np.zeros(0, np.int64)).shape == (0,)


def test_rows_near_are_those_of_blocks_in_the_box_that_are_in_view():
    index = VoxelIndex(VOXEL)
    xyz = np.array([[x, 0.0, 1.0] for x in np.arange(-20, 20, 0.25)])
    keys = np.unique(voxel_keys(xyz, 0.05))
    at = dict(zip(keys.tolist(), index.rows(keys).tolist(), strict=True))
    box = np.array([[-4.0, -4, -3], [4, 4, 5]])
    rows = set(index.rows_near(box, lambda centers, radius: centers[:, 0] > -radius).tolist())
    seen = {at[key] for key, x in zip(voxel_keys(xyz, 0.05).tolist(), xyz[:, 0], strict=True) if 0.1 < x < 4}
    assert seen <= rows
    assert len(rows) < 2 * len(seen)  # blocks of 1.6 m
