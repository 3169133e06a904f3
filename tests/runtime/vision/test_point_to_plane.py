import numpy as np
import pytest

from placegraph.runtime.vision.point_to_plane import GRID, SurfaceConfig, SurfaceMap, coarse_depth, scan_points

INTRINSICS = np.array([200.0, 200.0, 160.0, 120.0])
WALL = np.full((240, 320), 2.0, np.float32)


def test_a_wall_has_normals_towards_the_camera() -> None:
    surface = SurfaceMap(coarse_depth(WALL), INTRINSICS, SurfaceConfig())
    known = np.isfinite(surface.normals[..., 0])
    assert known.mean() > 0.9 and np.allclose(surface.normals[known], [0, 0, -1])


@pytest.mark.parametrize("depth", [np.zeros((240, 320), np.float32), np.full((240, 320), 50.0, np.float32)])
def test_nothing_known_or_too_far_is_no_surface(depth: np.ndarray) -> None:
    surface = SurfaceMap(coarse_depth(depth), INTRINSICS, SurfaceConfig())
    matrix, gradient, overlap = surface.normal_equations(np.eye(4), scan_points(coarse_depth(WALL), INTRINSICS))
    assert not matrix.any() and not gradient.any() and overlap == 0


def test_no_points_are_met_by_nothing() -> None:
    surface = SurfaceMap(coarse_depth(WALL), INTRINSICS, SurfaceConfig())
    assert surface.normal_equations(np.eye(4), np.zeros((0, 3)))[2] == 0


def test_a_step_towards_the_wall_is_felt_and_a_step_along_it_is_not() -> None:
    surface = SurfaceMap(coarse_depth(WALL), INTRINSICS, SurfaceConfig())
    points = scan_points(coarse_depth(WALL - 0.05), INTRINSICS)  # taken 5 cm nearer
    matrix, gradient, overlap = surface.normal_equations(np.eye(4), points)
    assert overlap > 0.9
    step = np.linalg.lstsq(matrix, -gradient, rcond=1e-9)[0]
    # the camera's points shift by -5 cm along the axis: it has moved 5 cm ahead
    assert step[2] == pytest.approx(-0.05, abs=1e-3)
    assert np.abs(matrix[:2, :2]).max() < 1e-6 * matrix[2, 2]


def test_depth_is_smoothed_on_a_surface_and_not_across_an_edge() -> None:
    noisy = WALL + np.random.default_rng(0).normal(0, 0.02, WALL.shape).astype(np.float32)
    noisy[:, 160:] += 1.0
    coarse = coarse_depth(noisy)
    assert coarse.shape == (240 // GRID, 320 // GRID)
    assert coarse[:, 5:35].std() < 0.012
    assert not ((coarse > 2.2) & (coarse < 2.8)).any()
