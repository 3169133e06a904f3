import numpy as np
import pytest

from placegraph.nodes.hierarchy.birds_eye_view import CELL_M, MIN_LEVEL, SIZE_PX, birds_eye_image
from placegraph.nodes.hierarchy.floors import FloorSpan

SPAN = FloorSpan(1.0, 3.5, 1.0, 3.5)


def block(x, y, z, size=0.5):
    axis = np.arange(0, size, 0.02)
    return np.stack(np.meshgrid(x + axis, y + axis, np.array(z)), axis=-1).reshape(-1, 3).astype(np.float32)


@pytest.mark.parametrize("objects", [[], [np.zeros((0, 3), np.float32)], [block(0, 0, (3.4,))]])
def test_nothing_in_the_band_is_a_black_image(objects):
    image, grid = birds_eye_image(objects, SPAN, 0.8)
    assert image.shape == (SIZE_PX, SIZE_PX, 3) and image.dtype == np.uint8 and not image.any()
    assert grid.shape == (SIZE_PX, SIZE_PX)


def test_what_is_high_is_bright_in_the_first_channel_and_dark_in_the_second():
    carpet, table = block(0, 0, (1.0,)), block(2, 0, (1.7, 1.75))
    image, grid = birds_eye_image([carpet, table], SPAN, 0.8)
    at_carpet, at_table = (tuple(int(v[0]) for v in grid.cells(np.array([[x, 0.25]]))) for x in (0.25, 2.25))
    assert image[at_carpet][0] == MIN_LEVEL and image[at_carpet][1] == 255
    assert image[at_table][0] > 100 > MIN_LEVEL and image[at_table][1] < 220


def test_the_scale_is_fixed_while_it_fits_and_the_middle_is_the_middle():
    image, grid = birds_eye_image([block(10, 20, (1.2,)), block(13, 22, (1.2,))], SPAN, 0.8)
    assert grid.cell_m == CELL_M
    rows, columns = np.nonzero(image[..., 2])
    assert (rows.min() + rows.max()) / 2 == pytest.approx(SIZE_PX / 2, abs=1.5)
    assert (columns.min() + columns.max()) / 2 == pytest.approx(SIZE_PX / 2, abs=1.5)
    assert columns.max() - columns.min() == pytest.approx(3.5 / CELL_M, abs=2)


def test_a_large_room_shrinks_until_it_fits():
    far = [block(0, 0, (1.2,)), block(30, 3, (1.2,))]
    image, grid = birds_eye_image(far, SPAN, 0.8)
    assert grid.cell_m > CELL_M
    _, columns = np.nonzero(image[..., 0])
    assert columns.min() >= 2 and columns.max() <= SIZE_PX - 3


def test_objects_are_told_apart_by_their_edges():
    one = birds_eye_image([block(0, 0, (1.2,), 1.0)], SPAN, 0.8)[0][..., 2]
    two = birds_eye_image([block(0, 0, (1.2,), 1.0), block(0.25, 0.25, (1.2,))], SPAN, 0.8)[0][..., 2]
    assert (two == 255).sum() > (one == 255).sum()


def test_points_of_another_density_give_nearly_the_same_image():
    axis = np.arange(0, 1, 0.025)
    dense = np.stack(np.meshgrid(axis, axis, [1.4]), axis=-1).reshape(-1, 3)
    thin = dense[np.random.default_rng(0).random(len(dense)) < 0.7]
    a, b = (birds_eye_image([xyz], SPAN, 0.8)[0] for xyz in (dense, thin))
    assert (a != b).any(axis=2).mean() < 0.01
