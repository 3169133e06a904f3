"""The tagger's targets, and a few steps of its training."""

from __future__ import annotations

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="training needs the extra `train`")

from placegraph.tools.simulator.object_classes import NAMES  # noqa: E402
from placegraph.tools.training import tagger_training  # noqa: E402
from placegraph.tools.training.data_augmentation import TrainingSample  # noqa: E402
from placegraph.tools.training.networks import ObjectNetwork  # noqa: E402
from placegraph.tools.training.tagger_training import tag_targets, train_tagger  # noqa: E402
from placegraph.tools.training.view_rendering import visible_boxes  # noqa: E402

torch.set_num_threads(1)


def make_sample(classes, counts):
    n = len(classes)
    return TrainingSample(
        np.zeros((8, 8, 3), np.uint8), np.zeros((n, 4), np.float32), np.array(classes, np.int64),
        np.array(counts, bool),
        np.arange(n), np.zeros((8, 8), np.uint16), np.zeros((8, 8), np.float32), np.array([-1]),
    )  # fmt: skip


def test_a_tag_is_shown_unknown_or_not():
    last = len(NAMES) - 1
    found = tag_targets([make_sample([5, 5, 2, last], [True, False, False, True]), make_sample([], [])])
    assert found.shape == (2, len(NAMES)) and found.dtype == torch.float32
    assert found[0, 5] == 1 and found[0, last] == 1  # one good sight is enough, in whatever order
    assert torch.isnan(found[0, 2]) and int(torch.isnan(found).sum()) == 1
    assert float(torch.nansum(found)) == 2
    assert torch.equal(tag_targets([make_sample([5, 5], [False, True])])[0, 5], torch.tensor(1.0))


def test_a_few_steps_of_training(tmp_path, monkeypatch):
    folder = tmp_path / "data" / "20000"
    folder.mkdir(parents=True)
    instance = np.zeros((2, 48, 64), np.uint16)
    instance[0, 5:40, 10:50] = 1
    np.save(folder / "color.npy", np.random.default_rng(1).integers(0, 256, (2, 48, 64, 3)).astype(np.uint8))
    np.save(folder / "depth.npy", np.full(instance.shape, 1500, np.uint16))
    np.save(folder / "instance.npy", instance)
    np.save(folder / "item_class.npy", np.array([3], np.uint8))
    np.save(folder / "boxes.npy", np.insert(visible_boxes(instance[0], np.array([3], np.uint8)), 0, 0, axis=1))
    monkeypatch.setattr(tagger_training, "SIZE", 64)
    monkeypatch.setattr(tagger_training, "BATCH", 2)
    torch.manual_seed(0)
    objects = ObjectNetwork().eval()
    before = {name: value.clone() for name, value in objects.state_dict().items()}
    found = train_tagger(tmp_path / "data", objects, tmp_path / "tags.pt", steps=3, threads=1)
    assert not found.training
    with torch.no_grad():
        logits = found(torch.randn(1, 3, 64, 64))
    assert logits.shape == (1, len(NAMES)) and torch.isfinite(logits).all()
    for name, value in objects.state_dict().items():
        assert torch.equal(value, before[name]), f"{name}: the detector must stay as it is"
    assert not torch.equal(found.dense.embed[1].weight, objects.dense.embed[1].weight)
    assert not torch.equal(found.gains, torch.full((2, len(NAMES)), 0.5))
