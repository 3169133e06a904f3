import numpy as np
import pytest
from pydantic import ValidationError

from placegraph.nodes.fusion.visibility import DepthVisibility, VisibilityConfig

INTRINSICS = np.array([100.0, 100.0, 50.0, 40.0])
NO_EDGES = np.zeros((80, 100), bool)


def visibility(depth_m, **settings):
    return DepthVisibility(
        np.asarray(depth_m, np.float32), NO_EDGES, INTRINSICS, np.eye(4), VisibilityConfig(**settings)
    )


def judged(depth_m, point, **settings):
    through, there = visibility(depth_m, **settings).classify(np.array([point], float))
    return "through" if through[0] else "there" if there[0] else "hidden"


@pytest.mark.parametrize(
    ("z", "expected"), [(2.0, "there"), (1.95, "there"), (1.0, "through"), (2.5, "hidden"), (-1.0, "hidden")]
)
def test_before_at_and_behind_a_wall_at_two_metres(z, expected):
    assert judged(np.full((80, 100), 2.0), (0, 0, z)) == expected


def test_without_a_reading_or_out_of_view_or_reach_nothing_is_said():
    assert judged(np.zeros((80, 100)), (0, 0, 1)) == "hidden"
    assert judged(np.full((80, 100), 9.0), (5, 0, 1)) == "hidden"
    assert judged(np.full((80, 100), 9.0), (0, 0, 5), reach_m=4.0) == "hidden"


def test_a_thin_pole_beside_the_pixel_keeps_a_point_from_being_seen_through():
    depth = np.full((80, 100), 4.0)
    depth[:, 53] = 2.0
    assert judged(depth, (0, 0, 2.0)) == "hidden"
    assert judged(depth, (0.3, 0, 2.0)) == "through"


def test_the_margin_grows_with_the_square_of_the_distance():
    assert judged(np.full((80, 100), 1.15), (0, 0, 1.0)) == "through"
    assert judged(np.full((80, 100), 3.65), (0, 0, 3.5)) == "there"


def test_edges_are_not_believed():
    edges = np.ones((80, 100), bool)
    one = DepthVisibility(np.full((80, 100), 2.0, np.float32), edges, INTRINSICS, np.eye(4), VisibilityConfig())
    assert [mask.any() for mask in one.classify(np.array([[0, 0, 2.0], [0, 0, 1.0]]))] == [False, False]


def test_boxes_in_view_and_behind():
    one = visibility(np.full((80, 100), 2.0))
    assert one.box_in_view(np.array([[-0.1, -0.1, 1.9], [0.1, 0.1, 2.1]]))
    assert not one.box_in_view(np.array([[-0.1, -0.1, -2.1], [0.1, 0.1, -1.9]]))
    assert not one.box_in_view(np.array([[5.0, -0.1, 1.9], [5.2, 0.1, 2.1]]))


@pytest.mark.parametrize("settings", [{"views": 0}, {"views": 256}, {"margin_m": 0.0}, {"through_share": 0.4}])
def test_wrong_settings_are_refused(settings):
    with pytest.raises(ValidationError):
        VisibilityConfig(**settings)
