"""Folding batch norm away changes nothing; the packaged weights are a start that gives what their files give."""

from __future__ import annotations

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="training needs the extra `train`")

from placegraph.models_onnx.manifest import find_weights  # noqa: E402
from placegraph.models_onnx.session import Session  # noqa: E402
from placegraph.models_onnx.text_encoder import TextEncoder  # noqa: E402
from placegraph.runtime.errors import ModelError  # noqa: E402
from placegraph.tools.training import batch_norm_folding  # noqa: E402
from placegraph.tools.training.batch_norm_folding import fold_batch_norm, packaged_start  # noqa: E402
from placegraph.tools.training.networks import Csp, DetectorExport, ObjectNetwork  # noqa: E402

torch.set_num_threads(1)


def packaged():
    return find_weights("house_detector").files["model"], find_weights("house_tagger").files["model"]


def test_a_folded_network_is_the_same_function():
    torch.manual_seed(3)
    network = ObjectNetwork()
    image, text = torch.rand(4, 3, 64, 96), torch.rand(4, 5, 256)
    with torch.no_grad():
        network(image, text)  # moves the running statistics off their start
        wanted = network.eval()(image, text)
        words = network.words
        fold_batch_norm(network).eval().words = words  # its table is near them, and those of test_word_projection.py
        found = network(image, text)
    for one, other in zip(found, wanted, strict=True):
        torch.testing.assert_close(one, other, atol=1e-4, rtol=1e-4)
    assert not any(isinstance(module, torch.nn.BatchNorm2d) for module in network.modules())
    assert network.backbone.stem[0][0].bias is not None


def test_the_start_gives_what_the_packaged_detector_gives():
    session = Session(packaged()[0])
    height, width = session.inputs["images"][2:]
    text = TextEncoder().encode(("chair", "sofa", "lamp"))[None]
    image = np.random.default_rng(0).uniform(0, 1, (1, 3, height // 16, width // 16)).astype(np.float32)
    image = image.repeat(16, axis=2).repeat(16, axis=3)
    wanted = session.run({"images": image, "text": text})["output"]
    detector = DetectorExport(packaged_start(*packaged()), height, width).eval()
    with torch.no_grad():
        found = detector(torch.from_numpy(image), torch.from_numpy(text)).numpy()
    assert found.shape == wanted.shape
    assert np.corrcoef(found[0, :4].ravel(), wanted[0, :4].ravel())[0, 1] > 0.999
    assert np.abs(found[0, 4:] - wanted[0, 4:]).max() < 0.1  # INT8 activations


def test_new_steps_begin_by_adding_nothing(monkeypatch):
    image, text = torch.rand(1, 3, 64, 64), torch.rand(1, 3, 256)
    with torch.no_grad():
        wanted = packaged_start(*packaged()).eval()(image, text)

        def deeper(block, c_in, c_out, depth, init=Csp.__init__):
            init(block, c_in, c_out, depth + 1)

        monkeypatch.setattr(Csp, "__init__", deeper)
        found = packaged_start(*packaged()).eval()(image, text)
    for one, other in zip(found, wanted, strict=True):
        torch.testing.assert_close(one, other, atol=1e-4, rtol=1e-4)


def test_weights_that_do_not_fit_are_refused(monkeypatch):
    weights = batch_norm_folding._weights_by_module(packaged()[0])
    del weights["network.backbone.to8.0.0.weight"]
    monkeypatch.setattr(batch_norm_folding, "_weights_by_module", lambda file: weights)
    with pytest.raises(ModelError, match=r"no weights for backbone\.to8\.0\.0\.weight"):
        packaged_start(*packaged())
    weights["network.backbone.to8.0.0.weight"] = np.zeros((64, 999, 3, 3), np.float32)
    weights |= {name: one for name, one in batch_norm_folding._weights_by_module(packaged()[1]).items()}
    with pytest.raises(ModelError):
        packaged_start(*packaged())
