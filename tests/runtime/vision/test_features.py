import numpy as np
import pytest

from placegraph.runtime.vision.features import FeatureConfig, extract_features, match_views
from placegraph.runtime.vision.geometry import inverse

CONFIG = FeatureConfig()


def test_two_views_of_one_place_are_related_to_the_centimetre(room_view, standing) -> None:
    first, second = standing(0.0, 0.0, 0.3), standing(0.25, 0.2, 0.5)
    a, b = (extract_features(*room_view(pose), CONFIG) for pose in (first, second))
    found = match_views(a, b, CONFIG)
    assert found is not None
    assert np.allclose(found.reference_from_camera, inverse(first) @ second, atol=0.015)
    assert found.is_inlier.sum() >= CONFIG.min_inliers and found.overlap > 0.5


def test_views_of_different_walls_are_not(room_view, standing) -> None:
    a, b = (extract_features(*room_view(standing(0, 0, heading)), CONFIG) for heading in (0.0, np.pi))
    assert match_views(a, b, CONFIG) is None


def test_the_same_picture_on_another_surface_is_not_the_same_place(room_view, standing) -> None:
    gray, depth, intrinsics = room_view(standing(0, 0, 0.0))
    wavy = (depth + 0.8 * np.sin(np.arange(depth.shape[1]) / 9)).astype(np.float32)  # a poster of it, say
    true, poster = (extract_features(gray, surface, intrinsics, CONFIG) for surface in (depth, wavy))
    assert match_views(true, poster, CONFIG) is None


@pytest.mark.parametrize("value", [0, 200])
def test_a_blank_image_relates_to_nothing(value: int, room_view, standing) -> None:
    gray, depth, intrinsics = room_view(standing(0, 0, 0.0))
    blank = extract_features(np.full_like(gray, value), depth, intrinsics, CONFIG)
    seen = extract_features(gray, depth, intrinsics, CONFIG)
    assert len(blank.uv) == 0 and match_views(seen, blank, CONFIG) is None and match_views(blank, seen, CONFIG) is None


def test_without_depth_there_are_keypoints_but_no_places(room_view, standing) -> None:
    gray, depth, intrinsics = room_view(standing(0, 0, 0.0))
    flat = extract_features(gray, np.zeros_like(depth), intrinsics, CONFIG)
    assert len(flat.uv) and np.isnan(flat.xyz[:, 2]).all()
    assert match_views(flat, flat, CONFIG) is None


def test_the_same_views_give_the_same_bytes(room_view, standing) -> None:
    def once() -> bytes:
        a, b = (extract_features(*room_view(standing(x, 0, 0.3)), CONFIG) for x in (0.0, 0.2))
        found = match_views(a, b, CONFIG)
        assert found is not None
        return found.reference_from_camera.tobytes()

    assert once() == once()
