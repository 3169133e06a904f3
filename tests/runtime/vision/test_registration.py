import numpy as np
import pytest

from placegraph.runtime.vision.geometry import inverse, rotation_angle_rad
from placegraph.runtime.vision.point_to_plane import SurfaceConfig, SurfaceMap, coarse_depth, scan_points
from placegraph.runtime.vision.registration import (
    PointMatches,
    RegistrationConfig,
    SurfaceMatch,
    exponential,
    inverse_depth_at,
    logarithm,
    project,
    register,
)

INTRINSICS = np.array([260.0, 260.0, 160.0, 120.0])
CONFIG = RegistrationConfig()
NONE = PointMatches(np.zeros((0, 3)), np.zeros((0, 2), np.float32), np.zeros(0))


def seen_from(pose: np.ndarray, count: int, seed: int = 0) -> PointMatches:
    """Points in front of the reference as a camera at `pose` sees them, without noise."""
    xyz = np.random.default_rng(seed).uniform((-1.5, -1, 2), (1.5, 1, 5), (count, 3))
    depth = (xyz - pose[:3, 3]) @ pose[:3, 2]
    return PointMatches(xyz, project(xyz, INTRINSICS, pose).astype(np.float32), 1 / depth)


MOVED = exponential(np.array([0.05, -0.02, 0.08, 0.02, -0.06, 0.03]))


@pytest.mark.parametrize("step", [np.zeros(6), np.array([0.1, -0.2, 0.3, 0.4, -0.5, 0.6])])
def test_logarithm_undoes_exponential(step: np.ndarray) -> None:
    assert np.allclose(logarithm(exponential(step)), step)


def test_corners_alone_give_the_pose() -> None:
    found = register(seen_from(MOVED, 60), None, INTRINSICS, np.eye(4), CONFIG)
    assert np.allclose(found.reference_from_camera, MOVED, atol=1e-4) and found.is_inlier.all()
    assert found.overlap == 0


def test_a_third_of_wrong_corners_does_not_move_it_and_is_named() -> None:
    good = seen_from(MOVED, 60)
    uv = good.uv.copy()
    uv[:20] += np.random.default_rng(1).uniform(15, 60, (20, 2)).astype(np.float32)
    found = register(PointMatches(good.xyz, uv, good.inverse_depth), None, INTRINSICS, np.eye(4), CONFIG)
    assert np.allclose(found.reference_from_camera, MOVED, atol=2e-3)
    assert not found.is_inlier[:20].any() and found.is_inlier[20:].all()


def test_corners_without_depth_count_by_their_pixels() -> None:
    good = seen_from(MOVED, 60)
    found = register(PointMatches(good.xyz, good.uv, np.zeros(60)), None, INTRINSICS, np.eye(4), CONFIG)
    assert np.allclose(found.reference_from_camera, MOVED, atol=1e-3)


def test_nothing_seen_leaves_the_prediction() -> None:
    found = register(NONE, None, INTRINSICS, MOVED, CONFIG, prior_sigmas=(0.03, 0.02))
    assert np.allclose(found.reference_from_camera, MOVED) and len(found.is_inlier) == 0


def test_a_wall_holds_distance_and_tilt_and_the_prediction_what_slides(room_view, standing) -> None:
    reference, camera = standing(0, 0, 0.0), standing(0.06, 0.05, 0.05)
    (_, depth, _), (_, later, _) = room_view(reference), room_view(camera)
    surface = SurfaceMap(coarse_depth(depth), INTRINSICS, SurfaceConfig())
    surface_match = SurfaceMatch(scan_points(coarse_depth(later), INTRINSICS), surface, reference)
    found = register(NONE, surface_match, INTRINSICS, reference, CONFIG, prior_sigmas=(0.05, 0.1))
    off = inverse(camera) @ found.reference_from_camera
    assert abs(off[2, 3]) < 0.01 and rotation_angle_rad(off[:3, :3]) < 0.01
    assert found.overlap > 0.8


def test_depth_at_an_edge_a_hole_and_the_border() -> None:
    depth = np.full((20, 30), 2.0, np.float32)
    depth[:, 15:] = 3.0
    depth[5, 5] = 0
    uv = np.array([[8, 8], [15, 8], [5, 5], [0, 0], [29.4, 19.4]], np.float32)
    assert inverse_depth_at(depth, uv).tolist() == pytest.approx([0.5, 0, 0, 0.5, 1 / 3])
    assert inverse_depth_at(np.zeros((20, 30), np.float32), uv).tolist() == [0] * 5
