import numpy as np
import pytest

from placegraph.models_onnx import LocationDetector
from placegraph.models_onnx.yolo_locations import FAMILY
from placegraph.runtime.errors import ModelError


@pytest.fixture
def file(tiny, tmp_path):
    rows = [
        tiny.seg_row((32, 32, 16, 16), (0.6,), p1=1),  # upper half of its box
        tiny.seg_row((32, 32, 32, 32), (0.9,), p0=3),  # left half
        tiny.seg_row((10, 10, 8, 8), (0.05,), p0=3),  # not certain enough
    ]
    return tiny.yolo_seg(tmp_path / "m.onnx", rows, tiny.quadrants())


def test_masks_come_best_first_with_their_scores(file, weights, red):
    network = FAMILY(weights("yolo_locations", ("location",), {"min_score": 0.1}, model=file))
    found = network.locate(red())
    assert isinstance(network, LocationDetector)
    np.testing.assert_allclose(found.scores, [0.9, 0.6], atol=1e-5)
    assert len(found.masks) == 2 and found.masks[0].shape == (64, 64)
    rows, columns = np.nonzero(found.masks[0])
    assert (rows.min(), rows.max(), columns.min(), columns.max()) == (16, 47, 16, 31)


def test_nothing_in_a_black_image(file, weights):
    found = FAMILY(weights("yolo_locations", (), model=file)).locate(np.zeros((64, 64, 3), np.uint8))
    assert found.masks == [] and found.scores.shape == (0,)


def test_another_class_is_refused(file, weights):
    with pytest.raises(ModelError, match="'location'"):
        FAMILY(weights("yolo_locations", ("room",), model=file))


def test_a_network_of_more_classes_is_refused(tiny, weights, tmp_path):
    path = tiny.yolo_seg(tmp_path / "two.onnx", [tiny.seg_row((32, 32, 8, 8), (0.9, 0.1), p0=3)], tiny.quadrants())
    with pytest.raises(ModelError):
        FAMILY(weights("yolo_locations", ("location",), model=path))
