import numpy as np
import pytest

from placegraph.nodes.pose.motion_model import MAX_EXTRAPOLATION, extrapolate_motion
from placegraph.runtime.vision.geometry import pose_from_quaternion, rotation_angle_rad

TURN = pose_from_quaternion(np.array([0.1, 0.0, 0.0]), np.array([0.0, 0.0, np.sin(0.05), np.cos(0.05)]))


@pytest.mark.parametrize(("span", "old"), [(0, 5), (5, 0), (100, 100), (104, 100), (-3, 5)])
def test_even_or_unknown_spans_leave_the_motion_as_it_is(span: int, old: int) -> None:
    assert extrapolate_motion(TURN, span, old) is TURN


@pytest.mark.parametrize(("span", "ratio"), [(200, 2.0), (50, 0.5), (10_000, MAX_EXTRAPOLATION)])
def test_motion_goes_on_for_as_long_as_the_frames_are_apart(span: int, ratio: float) -> None:
    longer = extrapolate_motion(TURN, span, 100)
    assert longer[0, 3] == pytest.approx(0.1 * ratio)
    assert rotation_angle_rad(longer[:3, :3]) == pytest.approx(0.1 * ratio)
