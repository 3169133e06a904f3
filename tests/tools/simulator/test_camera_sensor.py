"""The sensor model: its statistics on views whose truth is simple."""

from __future__ import annotations

import numpy as np
import pytest

from placegraph.runtime.errors import SourceError
from placegraph.tools.simulator.camera_sensor import SensorSettings, sensor_settings, simulate_camera
from placegraph.tools.simulator.render import RenderedView

FOCAL = 320 / np.tan(0.6)
PERFECT = SensorSettings(edge_share=0, fat_share=0, blank_share=0, shiny_share=0)


def make_view(
    depth_m: np.ndarray | float, width: int = 640, height: int = 480, level: int | None = None
) -> RenderedView:
    texture = np.random.default_rng(0).integers(20, 230, (height // 4, width // 4, 3)).repeat(4, 0).repeat(4, 1)
    color = np.full((height, width, 3), level) if level is not None else texture
    depth = np.broadcast_to(np.asarray(depth_m, np.float32), (height, width)).copy()
    return RenderedView(
        color.astype(np.uint8), depth, np.zeros((height, width), np.uint16), np.zeros((height, width), np.uint8)
    )


def depth_of(view: RenderedView, settings: SensorSettings = PERFECT, seed: int = 0) -> np.ndarray:
    width = view.depth_m.shape[1]
    focal = FOCAL * width / 640
    intrinsics = np.array([focal, focal, width / 2, view.depth_m.shape[0] / 2])
    return simulate_camera(view, intrinsics, np.random.default_rng(seed), settings)[1]


@pytest.mark.parametrize(("width", "height"), [(640, 480), (416, 312)])
def test_the_error_grows_with_the_square_of_the_distance(width, height):
    errors = []
    for true in (2.0, 4.0):
        depth = depth_of(make_view(true, width, height))
        assert (depth > 0).mean() > 0.99
        errors.append(float((depth[depth > 0] - true).std()))
    assert errors[1] / errors[0] == pytest.approx(4, rel=0.2)
    assert errors[1] == pytest.approx(4.0**2 * 0.095 / (FOCAL * 0.075), rel=0.1)


def test_the_error_is_smooth_along_the_surface():
    error = depth_of(make_view(3.0)) - 3.0
    assert np.corrcoef(error[:, :-1].ravel(), error[:, 1:].ravel())[0, 1] > 0.5
    assert abs(np.corrcoef(error[:, :-40].ravel(), error[:, 40:].ravel())[0, 1]) < 0.1
    assert abs(error.mean()) < 0.01


def test_disparity_comes_in_eighths_of_a_pixel():
    depth = depth_of(make_view(3.0)).astype(float)
    eighths = FOCAL * 0.075 / depth[depth > 0] * 8
    assert np.abs(eighths - np.round(eighths)).max() < 1e-3
    assert len(set(np.round(eighths).tolist())) > 3


@pytest.mark.parametrize("true", [0.2, 0.0, 12.0])
def test_what_is_out_of_range_or_not_there_has_no_depth(true):
    assert not depth_of(make_view(true)).any()


def test_an_edge_loses_depth_and_grows_towards_the_far_side():
    true = np.full((480, 640), 4.0, np.float32)
    true[:, :320] = 1.5
    depth = depth_of(make_view(true), SensorSettings())
    lost = depth == 0
    assert lost[:, 318:322].mean() > 0.2 > 2 * lost[:, 100:280].mean()
    expand_rectangle = (depth[:, 320:322] > 0) & (depth[:, 320:322] < 2)
    assert 0.05 < expand_rectangle.mean() < 0.6
    assert not ((depth[:, 330:] > 0) & (depth[:, 330:] < 2)).any()


def test_blank_shiny_and_grazing_surfaces_lose_more_than_textured_ones():
    settings = SensorSettings()
    textured = (depth_of(make_view(3.0), settings) == 0).mean()
    blank = (depth_of(make_view(3.0, level=150), settings) == 0).mean()
    mirror = make_view(3.0, level=150)
    mirror.shine[:] = 255
    shiny = (depth_of(mirror, settings) == 0).mean()
    steep = np.broadcast_to(1 / np.linspace(1, 0.12, 640), (480, 640)) * 1.0
    rows = np.arange(480)[:, None] - 239.5
    floor = np.where(rows > 8, 0.4 * FOCAL / np.maximum(rows, 1), 0)  # seen from 0.4 m above it
    grazing = depth_of(make_view(floor), settings)[250:300]
    assert textured < 0.02
    assert 0.04 < blank < 0.15
    assert shiny > 0.4
    assert (grazing[floor[250:300, 0] < 9] == 0).mean() > 0.1
    assert (depth_of(make_view(steep), PERFECT) == 0).mean() < 0.1


def test_exposure_adapts_and_a_grey_wall_stays_grey_but_for_noise():
    intrinsics = np.array([FOCAL, FOCAL, 320, 240])
    means = []
    for level in (60, 190):
        color, _ = simulate_camera(make_view(3.0, level=level), intrinsics, np.random.default_rng(1))
        assert color.shape == (480, 640, 3) and color.dtype == np.uint8
        means.append(float(color.mean()))
        middle = color[200:280, 280:360].astype(float)
        assert 1 < middle[..., 1].std() < 5
        assert np.ptp(middle.mean(axis=(0, 1))) < 8
    assert 60 < means[0] < means[1] < 190


def test_black_and_white_views_do_not_overflow():
    intrinsics = np.array([FOCAL, FOCAL, 320, 240])
    black, _ = simulate_camera(make_view(3.0, level=0), intrinsics, np.random.default_rng(2))
    white, _ = simulate_camera(
        make_view(3.0, level=255), intrinsics, np.random.default_rng(2), SensorSettings(exposure=1.6)
    )
    assert black.max() < 30
    assert white[230:250, 310:330].min() > 150


def test_equal_seeds_give_equal_bytes_and_leave_the_view_as_it_was():
    view, intrinsics = make_view(3.0), np.array([FOCAL, FOCAL, 320, 240])
    before = view.color.copy(), view.depth_m.copy()
    results = [simulate_camera(view, intrinsics, np.random.default_rng(seed)) for seed in (5, 5, 6)]
    for k in range(2):
        assert results[0][k].tobytes() == results[1][k].tobytes()
        assert (results[0][k] != results[2][k]).any()
    assert (view.color == before[0]).all() and (view.depth_m == before[1]).all()


def test_houses_differ_in_exposure_and_equal_seeds_do_not():
    assert sensor_settings(3) == sensor_settings(3) != sensor_settings(4)
    assert 0.6 < sensor_settings(3).exposure < 1.6


def test_arrays_of_different_sizes_are_refused():
    view = make_view(3.0)
    broken = RenderedView(view.color[:100], view.depth_m, view.instance, view.shine)
    with pytest.raises(SourceError, match="different sizes"):
        depth_of(broken)
