import numpy as np
import pytest

from placegraph.nodes.hierarchy.watershed import watershed

WIDE = [[3, 3, 1, 2, 2, 2]]  # two basins and the neck between them


def flooded(field, parts=lambda neck: True, space=None):
    field = np.array(field, np.float32)
    return watershed(field, field > 0 if space is None else np.array(space, bool), 1.0, 0.5, parts).tolist()


@pytest.mark.parametrize("shape", [(0, 0), (1, 1), (3, 0)])
def test_no_cells_at_all(shape):
    assert watershed(np.zeros(shape, np.float32), np.zeros(shape, bool), 1.0, 0.5, lambda neck: True).shape == shape


def test_one_cell_is_a_basin():
    assert flooded([[1]]) == [[1]]


def test_two_basins_stay_apart_or_join_as_their_neck_decides():
    asked = []

    def keep(neck):
        asked.append(neck)
        return True

    assert flooded(WIDE, keep) == [[1, 1, 2, 2, 2, 2]]  # the later basin wins a tie
    (neck,) = asked
    assert neck.level == 1 and sorted(neck.seed_levels) == [2, 3] and neck.cell in ((0, 1), (0, 2))
    assert flooded(WIDE, lambda neck: False) == [[1] * 6]


def test_a_neck_is_asked_about_once_also_after_one_side_has_joined_another():
    asked = []

    def parts(neck):
        asked.append(neck.level)
        return neck.level > 1.5

    row = [[5, 5, 2, 4, 4, 1, 3]]
    assert flooded(row, parts) == [[1, 1, 2, 2, 2, 2, 2]]
    assert asked == [2, 1]


def test_space_outside_and_space_without_a_seed_have_no_label():
    assert flooded([[3, 0, 0.2, 0, 3]], space=[[1, 0, 1, 0, 1]]) == [[1, 0, 0, 0, 2]]


def test_low_cells_join_the_basin_beside_them_across_a_corner_never():
    assert flooded([[3, 0.2, 0], [0, 0, 3]], space=[[1, 1, 0], [0, 0, 1]]) == [[1, 1, 0], [0, 0, 2]]
