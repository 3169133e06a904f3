import numpy as np
import pytest

from placegraph.nodes.pose.feature_tracker import RgbdView
from placegraph.nodes.pose.relocalization import RelocalizationConfig, Relocalizer
from placegraph.runtime.vision.features import FeatureConfig


@pytest.fixture
def seen(room_view):
    return lambda pose: RgbdView(*room_view(pose), FeatureConfig())


def test_a_view_is_found_again_and_another_place_is_not(standing, seen) -> None:
    relocalizer = Relocalizer(RelocalizationConfig())
    remembered, near, elsewhere = standing(0, 0, 0), standing(0.05, 0.02, 0.05), standing(0.5, 1.0, 3.6)
    relocalizer.remember(seen(remembered), remembered)
    for find in (relocalizer.match_newest, relocalizer.relocalize):
        found = find(seen(near))
        assert found is not None and np.linalg.norm((found - near)[:3, 3]) < 0.03
        assert find(seen(elsewhere)) is None


def test_a_search_gets_to_old_views_and_the_newest_alone_do_not(standing, seen) -> None:
    relocalizer, old = Relocalizer(RelocalizationConfig(max_candidates=2)), standing(0, 0, 0)
    relocalizer.remember(seen(old), old)
    other = seen(standing(0.5, 1.0, 3.6))
    for _ in range(3):
        relocalizer.remember(other, np.eye(4))
    assert relocalizer.match_newest(seen(old)) is None
    assert relocalizer.relocalize(seen(old)) is not None  # the newest, and the first of all in turn


def test_the_oldest_view_is_forgotten(standing, seen) -> None:
    relocalizer, old = Relocalizer(RelocalizationConfig(max_remembered_views=1)), standing(0, 0, 0)
    relocalizer.remember(seen(old), old)
    relocalizer.remember(seen(standing(0.5, 1.0, 3.6)), np.eye(4))
    assert relocalizer.relocalize(seen(old)) is None
