import numpy as np
import pytest

from placegraph.models_onnx.masks import pack_segments
from placegraph.runtime.messages import Keyframe


@pytest.fixture
def keyframe():
    return Keyframe(
        frame_id=7,
        stamp_ns=11,
        color=np.zeros((6, 9, 3), np.uint8),
        depth=np.zeros((6, 9), np.uint16),
        depth_unit_m=0.001,
        intrinsics=np.array([5.0, 5, 4, 3]),
        world_from_camera=np.eye(4),
    )


def test_no_masks(keyframe):
    segments = pack_segments(keyframe, [], np.zeros(0, np.float32), [])
    segments.check()
    assert (segments.frame_id, segments.stamp_ns, segments.names) == (7, 11, ())


def test_masks_come_back_at_their_place_and_empty_ones_go(keyframe):
    bent, dot = np.zeros((6, 9), bool), np.zeros((6, 9), bool)
    bent[1:4, 2] = bent[3, 2:8] = dot[5, 8] = True
    segments = pack_segments(
        keyframe, ["a", "b", "c"], np.array([0.9, 0.8, 0.7], np.float32), [bent, np.zeros((6, 9), bool), dot]
    )
    segments.check()
    assert segments.names == ("a", "c")
    np.testing.assert_allclose(segments.scores, [0.9, 0.7])
    np.testing.assert_array_equal(segments.boxes_px, [[2, 1, 8, 4], [8, 5, 9, 6]])
    for found, whole, (x0, y0, x1, y1) in zip(segments.masks(), [bent, dot], segments.boxes_px.tolist(), strict=True):
        np.testing.assert_array_equal(found, whole[y0:y1, x0:x1])
        assert found.sum() == whole.sum()
