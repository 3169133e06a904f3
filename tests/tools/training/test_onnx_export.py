"""ONNX files of a tiny network: as float equal to PyTorch, as INT8 smaller and near."""

from __future__ import annotations

import numpy as np
import onnx
import onnxruntime
import pytest

torch = pytest.importorskip("torch", reason="training needs the extra `train`")

from placegraph.tools.training.networks import Conv, Csp  # noqa: E402
from placegraph.tools.training.onnx_export import export_onnx, image_feed, quantize  # noqa: E402

# the exporter is the older one on purpose, see onnx_export.py
pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::UserWarning")
torch.set_num_threads(1)


class Scored(torch.nn.Module):
    """Convolutions and a head of words, as the detector: (1, N, h * w) of image (1, 3, H, W) and words (1, N, 8)."""

    def __init__(self):
        super().__init__()
        self.body = torch.nn.Sequential(Conv(3, 32, 3, 2), Csp(32, 64, 1), Conv(64, 64))
        self.last = torch.nn.Conv2d(64, 8, 1)

    def forward(self, image, words):
        return torch.matmul(words, self.last(self.body(image)).flatten(2))


@pytest.fixture(scope="module")
def network():
    torch.manual_seed(0)
    made = Scored()
    for _ in range(20):  # so that batch norms hold what passes through them
        made(torch.rand(4, 3, 32, 32), torch.rand(4, 2, 8))
    return made.eval()


@pytest.fixture(scope="module")
def float_file(network, tmp_path_factory):
    folder = tmp_path_factory.mktemp("export")
    inputs = {"images": torch.rand(1, 3, 32, 32), "text": torch.rand(1, 2, 8)}
    open_axes = {"text": {1: "N"}, "scores": {1: "N"}}
    return export_onnx(network, inputs, ["scores"], folder / "made" / "tiny.onnx", open_axes)


def feeds(seed, count, words=2):
    random = np.random.default_rng(seed)
    for _ in range(count):
        image = random.integers(0, 256, (32, 32, 3)).astype(np.uint8)
        yield {"images": image_feed(image), "text": random.random((1, words, 8)).astype(np.float32)}


def run(file, feed):
    return onnxruntime.InferenceSession(str(file), providers=["CPUExecutionProvider"]).run(None, feed)[0]


def count_exact(network, feed):
    with torch.no_grad():
        return network(torch.from_numpy(feed["images"]), torch.from_numpy(feed["text"])).numpy()


def conv_weights_in_float(file):
    """Names of convolutions whose weights are not dequantised from INT8."""
    graph = onnx.load(file).graph
    made = {name: node.op_type for node in graph.node for name in node.output}
    return [
        node.name for node in graph.node if node.op_type == "Conv" and made.get(node.input[1]) != "DequantizeLinear"
    ]


def test_an_image_as_fed():
    image = np.zeros((2, 5, 3), np.uint8)
    image[1, 4] = (255, 51, 0)
    feed = image_feed(image)
    assert feed.shape == (1, 3, 2, 5) and feed.dtype == np.float32 and feed.flags["C_CONTIGUOUS"]
    np.testing.assert_allclose(feed[0, :, 1, 4], [1, 0.2, 0])
    assert feed.sum() == pytest.approx(1.2)


def test_the_float_file_equals_the_network(network, float_file):
    assert float_file.name == "tiny.onnx" and float_file.is_file()
    for words in (1, 2, 7):  # the axis is open
        feed = next(feeds(words, 1, words))
        np.testing.assert_allclose(run(float_file, feed), count_exact(network, feed), atol=1e-4)


def test_names_and_shapes_are_those_asked_for(float_file):
    session = onnxruntime.InferenceSession(str(float_file), providers=["CPUExecutionProvider"])
    assert [(one.name, one.shape) for one in session.get_inputs()] == [
        ("images", [1, 3, 32, 32]),
        ("text", [1, "N", 8]),
    ]
    assert [one.name for one in session.get_outputs()] == ["scores"]
    assert session.get_outputs()[0].shape[1] == "N"


def test_int8_is_smaller_and_near(network, float_file, tmp_path):
    file = quantize(float_file, tmp_path / "small.onnx", feeds(1, 8))
    assert file.stat().st_size < 0.6 * float_file.stat().st_size
    assert conv_weights_in_float(file) == []
    for feed in feeds(2, 3, words=4):
        wanted = count_exact(network, feed)
        off = np.abs(run(file, feed) - wanted)
        assert 0 < off.mean() < 0.1 * wanted.std()


def test_what_is_kept_float_stays_float(float_file, tmp_path):
    (last,) = [node.name for node in onnx.load(float_file).graph.node if "/last/" in node.name]
    file = quantize(float_file, tmp_path / "small.onnx", feeds(1, 4), keep_float=("/last/.*",))
    assert conv_weights_in_float(file) == [last]


def test_equal_feeds_give_equal_files(float_file, tmp_path):
    one, same = (quantize(float_file, tmp_path / name, feeds(1, 3)) for name in ("a.onnx", "b.onnx"))
    assert one.read_bytes() == same.read_bytes()
