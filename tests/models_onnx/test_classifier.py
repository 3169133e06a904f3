import numpy as np
import pytest

from placegraph.models_onnx.classifier import FAMILY, first_synonym, probabilities
from placegraph.runtime.errors import ModelError

LABELS = ("background", "red thing, Rubrum", "sea_blue", "red thing")
PLAIN = {"mean": [0.0, 0.0, 0.0], "std": [255.0, 255.0, 255.0]}
LOGITS = [[4, 0, 0], [2, 0, 0], [0, 0, 5], [1, 0, 0]]


@pytest.fixture
def build(tiny, weights, tmp_path):
    def make(**options):
        path = tiny.channel_means(tmp_path / "m.onnx", LOGITS, 8)
        return FAMILY(weights("classifier", LABELS, PLAIN | options, model=path))

    return make


def softmax(*logits):
    return np.exp(logits) / np.exp(logits).sum()


def test_best_first_without_background_and_with_synonyms_joined(build, red):
    found = build(label_offset=1, min_score=0.0)
    tags = found.tag(red(30, 50))
    assert tags.names == ("red thing", "sea blue")
    np.testing.assert_allclose(tags.scores, softmax(4, 2, 0, 1)[[1, 2]], atol=1e-6)
    assert tags.scores.dtype == np.float32


def test_the_floor_and_the_count(build, red):
    assert build(min_score=0.5).tag(red()).names == ("background",)
    assert build(min_score=0.0, max_tags=2).tag(red()).names == ("background", "red thing")
    assert build(min_score=0.99).tag(red()).names == ()


def test_channels_and_normalization(build, red):
    blue = red()[:, :, ::-1].copy()
    assert build(label_offset=1).tag(blue).names[0] == "sea blue"
    centered = build(mean=[127.5] * 3, std=[127.5] * 3, min_score=0.0).tag(red())
    assert centered.scores[0] == pytest.approx(softmax(4, 2, -5, 1)[0], abs=1e-6)


def test_probabilities():
    given = np.array([0.2, 0.8], np.float32)
    np.testing.assert_array_equal(probabilities(given), given)
    np.testing.assert_allclose(probabilities(np.array([0, 0, 900], np.float32)), [0, 0, 1])
    np.testing.assert_allclose(probabilities(np.array([0.2, 0.9], np.float32)).sum(), 1, atol=1e-6)


def test_first_synonym():
    assert first_synonym("tench, Tinca tinca") == "tench"
    assert first_synonym(" dining_table ") == "dining table"


@pytest.mark.parametrize(
    ("labels", "options", "text"),
    [
        (LABELS[:3], PLAIN, r"expected \[1, 3\]"),
        (LABELS, {"label_offset": 4}, "label_offset leaves none of 4"),
        (LABELS, {"mean": [1.0]}, "options: mean"),
        (LABELS, {"top": 3}, "options: top"),
    ],
)
def test_what_does_not_fit_is_named(tiny, weights, tmp_path, labels, options, text):
    path = tiny.channel_means(tmp_path / "m.onnx", LOGITS, 8)
    with pytest.raises(ModelError, match=text):
        FAMILY(weights("classifier", labels, options, model=path))


def test_an_input_that_is_no_image_is_refused(tiny, weights, tmp_path):
    encoder = tiny.sam_decoder(tmp_path / "m.onnx")
    with pytest.raises(ModelError, match="expected one input"):
        FAMILY(weights("classifier", LABELS, model=encoder))


@pytest.mark.weights
def test_mobilenet_sees_a_television(real_models, real_frame):
    from placegraph.models_onnx.load import load

    network = load("mobilenet_v2", [real_models])
    tags = {name for number in range(0, 500, 50) for name in network.tag(real_frame(number)).names}
    assert {"desk", "television"} <= tags and "background" not in tags
