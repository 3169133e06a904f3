import numpy as np
import pytest

from placegraph.models_onnx.ram import FAMILY, MEAN, STD
from placegraph.runtime.errors import ModelError

TAGS = ("red", "green", "blue")


@pytest.fixture
def build(tiny, weights, tmp_path):
    def make(thresholds="0.5\n0.1\n0.5\n", tags=TAGS, size=384):
        path = tmp_path / "thresholds.txt"
        path.write_text(thresholds)
        model = tiny.channel_means(tmp_path / "ram.onnx", np.eye(3), size, name="image")
        return FAMILY(weights("ram", tags, model=model, thresholds=path))

    return make


def sigmoid(x):
    return 1 / (1 + np.exp(-x))


def test_tags_above_their_own_threshold(build, red):
    logits = (np.array([1, 0, 0]) - MEAN) / STD  # of a red image, by the published normalisation
    tags = build().tag(red(48, 64))
    assert tags.names == ("red", "green")  # green at .115 exceeds its .1, blue at .141 does not reach .5
    np.testing.assert_allclose(tags.scores, sigmoid(logits)[:2], atol=1e-4)
    assert tags.scores.dtype == np.float32


def test_best_first(build, red):
    assert build("0\n0\n0").tag(red()).names == ("red", "blue", "green")
    assert build("1\n1\n1").tag(red()).names == ()


@pytest.mark.parametrize(
    ("thresholds", "text"),
    [
        ("0.5\n0.5", r"thresholds\.txt: 2 thresholds for 3 tags"),
        ("0.5\nhigh\n0.5", r"entry 2: expected a threshold in 0..1, got 'high'"),
        ("0.5\n0.5\n1.5", "entry 3"),
        ("nan\n0.5\n0.5", "entry 1"),
        ("", r"thresholds\.txt: no line of text"),
    ],
)
def test_wrong_thresholds_are_named(build, thresholds, text):
    with pytest.raises(ModelError, match=text):
        build(thresholds)


def test_the_thresholds_are_needed(tiny, weights, tmp_path):
    model = tiny.channel_means(tmp_path / "ram.onnx", np.eye(3), 384)
    with pytest.raises(ModelError, match="needs a file of role 'thresholds'"):
        FAMILY(weights("ram", TAGS, model=model))


def test_tags_must_fit(build):
    with pytest.raises(ModelError, match=r"output 'logits' has shape \[1, 3\], expected \[1, 2\]"):
        build("0.5\n0.5", tags=TAGS[:2])
