from dataclasses import replace

import numpy as np
import pytest

from placegraph.nodes.pose import feature_tracker
from placegraph.nodes.pose.feature_tracker import RgbdView
from placegraph.nodes.pose.rgbd_odometry import RgbdOdometry, RgbdOdometryConfig
from placegraph.runtime.vision.features import FeatureConfig, ViewFeatures, extract_features
from placegraph.runtime.vision.geometry import inverse

PERIOD_NS = 100_000_000


@pytest.fixture
def seen(room_view):
    def view(pose: np.ndarray) -> RgbdView:
        return RgbdView(*room_view(pose), FeatureConfig())

    return view


def covered(view: RgbdView) -> RgbdView:
    return replace(view, gray=np.zeros_like(view.gray), depth_m=np.zeros_like(view.depth_m))


def walk(standing, count: int) -> list[np.ndarray]:
    return [standing(-0.8 + 0.04 * i, 0.1 * np.sin(0.3 * i), 0.05 * i) for i in range(count)]


def test_follows_a_walk_to_two_centimetres(standing, seen) -> None:
    odometry, poses = RgbdOdometry(RgbdOdometryConfig()), walk(standing, 25)
    found = [odometry.register(seen(pose), i * PERIOD_NS) for i, pose in enumerate(poses)]
    assert all(one.trusted for one in found)
    off = inverse(inverse(poses[0]) @ poses[-1]) @ found[-1].start_from_camera
    assert np.linalg.norm(off[:3, 3]) < 0.02


def test_a_covered_lens_is_told_and_the_track_goes_on(standing, seen) -> None:
    odometry, poses = RgbdOdometry(RgbdOdometryConfig()), walk(standing, 12)
    for i, pose in enumerate(poses[:8]):
        odometry.register(seen(pose), i * PERIOD_NS)
    dark = covered(seen(poses[0]))
    assert not odometry.register(dark, 8 * PERIOD_NS).trusted
    again = [odometry.register(seen(pose), (9 + i) * PERIOD_NS) for i, pose in enumerate(poses[9:])]
    assert again[-1].trusted
    off = inverse(inverse(poses[0]) @ poses[-1]) @ again[-1].start_from_camera
    assert np.linalg.norm(off[:3, 3]) < 0.05


def test_a_carried_camera_is_lost_and_found_again_where_it_was_before(standing, seen) -> None:
    odometry, poses = RgbdOdometry(RgbdOdometryConfig(max_coasting_s=0.3)), walk(standing, 15)
    for i, pose in enumerate(poses):
        odometry.register(seen(pose), i * PERIOD_NS)
    dark = covered(seen(poses[0]))
    told = [odometry.register(dark, (15 + i) * PERIOD_NS) for i in range(8)]
    assert not any(one.trusted for one in told) and "lost" in told[-1].reason
    elsewhere = odometry.register(seen(standing(0.5, 1.0, 3.6)), 23 * PERIOD_NS)  # a wall it has not seen
    assert not elsewhere.trusted
    back = odometry.register(seen(poses[3]), 24 * PERIOD_NS)
    assert back.trusted
    off = inverse(inverse(poses[0]) @ poses[3]) @ back.start_from_camera
    assert np.linalg.norm(off[:3, 3]) < 0.03


def test_it_begins_with_the_first_view_that_has_corners_with_depth(standing, seen) -> None:
    odometry = RgbdOdometry(RgbdOdometryConfig())
    view = seen(standing(0, 0, 0))
    blind = odometry.register(replace(view, depth_m=np.zeros_like(view.depth_m)), 0)
    assert not blind.trusted and "0 corners" in blind.reason
    assert odometry.register(view, PERIOD_NS).trusted


def test_an_image_of_another_size_is_a_lost_frame_not_a_crash(standing, seen) -> None:
    odometry = RgbdOdometry(RgbdOdometryConfig())
    view = seen(standing(0, 0, 0))
    odometry.register(view, 0)
    small = RgbdView(view.gray[::2, ::2].copy(), view.depth_m[::2, ::2].copy(), view.intrinsics / 2, FeatureConfig())
    assert not odometry.register(small, PERIOD_NS).trusted


def test_same_views_same_poses_bit_for_bit(standing, seen) -> None:
    def once() -> list[bytes]:
        odometry = RgbdOdometry(RgbdOdometryConfig())
        return [odometry.register(seen(p), i).start_from_camera.tobytes() for i, p in enumerate(walk(standing, 6))]

    assert once() == once()


def test_a_tiny_image_does_not_crash_the_search_for_patches(standing, seen) -> None:
    odometry = RgbdOdometry(RgbdOdometryConfig(min_inliers=6))
    for i, pose in enumerate(walk(standing, 3)):
        view = seen(pose)
        tiny = RgbdView(view.gray[::5, ::5].copy(), view.depth_m[::5, ::5].copy(), view.intrinsics / 5, FeatureConfig())
        assert np.isfinite(odometry.register(tiny, i * PERIOD_NS).start_from_camera).all()


def test_a_camera_that_was_carried_is_not_trusted_until_it_knows_where_it_is(standing, seen) -> None:
    odometry, poses = RgbdOdometry(RgbdOdometryConfig()), walk(standing, 12)
    for i, pose in enumerate(poses):
        odometry.register(seen(pose), i * PERIOD_NS)
    elsewhere = [standing(0.9 - 0.03 * i, 1.2, 3.6 + 0.02 * i) for i in range(6)]  # frame by frame, as if nothing were
    assert not any(odometry.register(seen(pose), (12 + i) * PERIOD_NS).trusted for i, pose in enumerate(elsewhere))
    back = odometry.register(seen(poses[6]), 18 * PERIOD_NS)
    assert back.trusted
    off = inverse(inverse(poses[0]) @ poses[6]) @ back.start_from_camera
    assert np.linalg.norm(off[:3, 3]) < 0.03


def test_the_features_of_a_view_are_computed_at_most_once(standing, seen, monkeypatch) -> None:
    computed: list[int] = []

    def counted(gray: np.ndarray, *rest: object) -> ViewFeatures:
        computed.append(id(gray))
        return extract_features(gray, *rest)

    monkeypatch.setattr(feature_tracker, "extract_features", counted)
    odometry, poses = RgbdOdometry(RgbdOdometryConfig()), walk(standing, 20)
    views = [covered(seen(pose)) if i == 10 else seen(pose) for i, pose in enumerate(poses)]
    for i, view in enumerate(views):
        odometry.register(view, i * PERIOD_NS)
    assert 1 < len(computed) == len(set(computed))  # when it starts, and at least when it has coasted
