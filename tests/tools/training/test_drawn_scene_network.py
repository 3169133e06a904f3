from pathlib import Path

import numpy as np
import pytest

from placegraph.models_onnx.manifest import Weights, find_weights
from placegraph.models_onnx.semantic import FAMILY
from placegraph.nodes.camera._flat_scene import CLASSES
from placegraph.tools.training import drawn_scene_network as tool


@pytest.fixture
def layers() -> list[np.ndarray]:
    random = np.random.default_rng(5)
    shapes = [(4, tool.HIDDEN), (tool.HIDDEN,), (tool.HIDDEN, len(CLASSES)), (len(CLASSES),)]
    return [random.normal(0, 0.5, shape) for shape in shapes]


def test_features_of_black_are_finite():
    assert tool.features(np.zeros((1, 3), np.uint8)).tolist() == [[0, 0, 0, 0]]


def test_gradients_are_those_of_the_loss(layers):
    random = np.random.default_rng(6)
    inputs, labels = random.normal(0, 1, (50, 4)), random.integers(0, len(CLASSES), 50)

    def loss() -> float:
        logits = np.maximum(inputs @ layers[0] + layers[1], 0) @ layers[2] + layers[3]
        return float((np.log(np.exp(logits).sum(axis=1)) - logits[np.arange(50), labels]).mean())

    gradients = tool._gradients(layers, inputs, labels)
    for layer, gradient in zip(layers, gradients, strict=True):
        place = np.unravel_index(int(np.abs(gradient).argmax()), gradient.shape)
        before, step = layer[place], 1e-5
        layer[place] = before + step
        above = loss()
        layer[place] = before - step
        below = loss()
        layer[place] = before
        assert gradient[place] == pytest.approx((above - below) / (2 * step), rel=1e-4)


def test_the_file_computes_what_was_fitted(layers, tmp_path: Path):
    """A plain image: averaging over neighbours changes nothing."""
    file = tmp_path / "network.onnx"
    file.write_bytes(tool.build(layers))
    family = FAMILY(Weights("drawn_scene", "semantic", {"model": file}, CLASSES, {}), 1)
    for color in ((200, 60, 40), (26, 24, 34), (0, 0, 0)):
        pixel = np.array([color], np.uint8)
        logits = np.maximum(tool.features(pixel) @ layers[0] + layers[1], 0) @ layers[2] + layers[3]
        label, confidence = family.classify(np.broadcast_to(pixel[0], (5, 6, 3)))
        assert (label == logits.argmax()).all()
        odds = np.exp(logits - logits.max())
        assert confidence == pytest.approx(np.full((5, 6), 1 / odds.sum()), rel=1e-3)


def test_the_manifest_lists_the_classes_of_the_scene():
    assert find_weights("drawn_scene").labels == CLASSES
