"""Prompts of the detector, and a few steps of its training on a folder of one tiny house."""

from __future__ import annotations

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="training needs the extra `train`")

from placegraph.models_onnx.text_encoder import TextEncoder  # noqa: E402
from placegraph.tools.simulator.object_classes import CLASSES  # noqa: E402
from placegraph.tools.training import detector_training  # noqa: E402
from placegraph.tools.training.batch_norm_folding import fold_batch_norm  # noqa: E402
from placegraph.tools.training.data_augmentation import TrainingSample  # noqa: E402
from placegraph.tools.training.detector_training import OTHERS, Prompts, image_batch, read_refined, train_objects  # noqa: E402
from placegraph.tools.training.networks import ObjectNetwork  # noqa: E402
from placegraph.tools.training.view_rendering import visible_boxes  # noqa: E402
from placegraph.tools.training.word_projection import OTHER_WORDS  # noqa: E402

torch.set_num_threads(1)


@pytest.fixture(scope="module")
def encoder():
    return TextEncoder()


def drawn_words(encoder, monkeypatch, draws):
    """Per draw, the words of its rows, found by their vectors; noise is off."""
    monkeypatch.setattr(detector_training, "TEXT_NOISE", 0.0)
    words = sorted({word for one in CLASSES for word in one.training_words + one.held_out_words} | set(OTHER_WORDS))
    table = encoder.encode(words)
    prompts = Prompts(4)
    for _ in range(draws):
        likeness = prompts.draw().numpy() @ table.T
        assert (likeness.max(axis=1) > 0.9999).all()  # nothing but these words
        yield [words[i] for i in likeness.argmax(axis=1)]


def test_prompts_keep_the_order_of_classes_and_never_say_what_is_kept_for_evaluation(encoder, monkeypatch):
    held_out_words = {word for one in CLASSES for word in one.held_out_words}
    names = 0
    for words in drawn_words(encoder, monkeypatch, 40):
        assert len(words) == len(CLASSES) + OTHERS
        assert all(word in one.training_words for word, one in zip(words, CLASSES, strict=False))
        others = words[len(CLASSES) :]
        assert len(set(others)) == OTHERS and set(others) <= set(OTHER_WORDS)
        assert not held_out_words & set(words)
        names += sum(word == one.name for word, one in zip(words, CLASSES, strict=False))
    # half of the time by name, besides those drawn by chance (two to four words a class)
    assert 0.6 < names / (40 * len(CLASSES)) < 0.85


def test_words_of_each_kind_are_apart():
    said, held_out_words = (
        [w for one in CLASSES for w in one.training_words],
        [w for one in CLASSES for w in one.held_out_words],
    )
    assert len(set(said)) == len(said)
    assert not set(said) & set(held_out_words)
    assert len(set(OTHER_WORDS)) == len(OTHER_WORDS) and not set(OTHER_WORDS) & {*said, *held_out_words}


def test_prompts_are_unit_rows_near_their_words(encoder):
    text = Prompts(4).draw()
    assert text.shape == (len(CLASSES) + OTHERS, 256) and text.dtype == torch.float32
    torch.testing.assert_close(text.norm(dim=1), torch.ones(len(text)))
    best = [
        float((encoder.encode(one.training_words) @ row).max()) for row, one in zip(text.numpy(), CLASSES, strict=False)
    ]
    assert min(best) > 0.8 and max(best) < 0.999  # noise is on


def test_same_seed_same_prompts():
    one, same, other = Prompts(4), Prompts(4), Prompts(5)
    for _ in range(3):
        text = one.draw()
        assert torch.equal(text, same.draw()) and not torch.equal(text, other.draw())


def make_sample(color):
    none = np.zeros(0, np.int64)
    size = color.shape[:2]
    return TrainingSample(
        color, np.zeros((0, 4), np.float32), none, none.astype(bool), none,
        np.zeros(size, np.uint16), np.zeros(size, np.float32), np.full(size[0] * size[1] // 64, -1),
    )  # fmt: skip


def test_images_of_samples():
    color = np.zeros((8, 16, 3), np.uint8)
    color[2, 5] = (255, 51, 0)
    found = image_batch([make_sample(color), make_sample(np.full((8, 16, 3), 255, np.uint8))])
    assert found.shape == (2, 3, 8, 16) and found.dtype == torch.float32
    torch.testing.assert_close(found[0, :, 2, 5], torch.tensor([1.0, 0.2, 0.0]))
    assert float(found[0].sum()) == pytest.approx(1.2) and (found[1] == 1).all()
    assert found.is_contiguous(memory_format=torch.channels_last)


def write_shard(folder, views=4, size=(48, 64)):
    """A shard of random rectangles on noise."""
    random = np.random.default_rng(6)
    folder.mkdir(parents=True)
    instance = np.zeros((views, *size), np.uint16)
    for k in range(views):
        instance[k, 5:25, 5 + k : 30] = 1
        instance[k, 20:45, 34:60] = 2
    item_class = np.array([3, 17], np.uint8)
    np.save(folder / "color.npy", random.integers(0, 256, (views, *size, 3)).astype(np.uint8))
    np.save(folder / "depth.npy", np.full((views, *size), 1500, np.uint16))
    np.save(folder / "instance.npy", instance)
    np.save(folder / "item_class.npy", item_class)
    rows = [np.insert(visible_boxes(one, item_class), 0, k, axis=1) for k, one in enumerate(instance)]
    np.save(folder / "boxes.npy", np.concatenate(rows))


def test_a_few_steps_of_training(tmp_path, monkeypatch):
    write_shard(tmp_path / "data" / "20000")
    monkeypatch.setattr(detector_training, "FIRST_SIZES", ((64, 64), (64, 96)))
    monkeypatch.setattr(detector_training, "BATCH", 2)
    seen = []

    real = ObjectNetwork.forward

    def forward(network, image, text):
        seen.append((tuple(image.shape), tuple(text.shape)))
        return real(network, image, text)

    monkeypatch.setattr(ObjectNetwork, "forward", forward)
    words = len(CLASSES) + OTHERS
    found = train_objects(tmp_path / "data", tmp_path / "objects.pt", steps=5, threads=1)
    small, large = ((2, 3, 64, 64), (2, words, 256)), ((2, 3, 64, 96), (2, words, 256))
    assert seen == [small, small, small, small, large]  # .8 of the steps small
    assert isinstance(found, ObjectNetwork) and not found.training
    assert all(torch.isfinite(value).all() for value in found.state_dict().values() if value.is_floating_point())
    again = train_objects(tmp_path / "data", tmp_path / "objects.pt", steps=5, threads=1)
    assert len(seen) == 5  # it was finished
    torch.testing.assert_close(again.words.linear.weight, found.words.linear.weight)


def test_refining_goes_on_without_batch_norm(tmp_path, monkeypatch):
    write_shard(tmp_path / "data" / "20000")
    monkeypatch.setattr(detector_training, "SIZES", ((64, 96), (96, 96)))
    monkeypatch.setattr(detector_training, "BATCH", 2)
    start = fold_batch_norm(ObjectNetwork())
    before = start.backbone.stem[0][0].weight.detach().clone()
    found = train_objects(tmp_path / "data", tmp_path / "refined.pt", 3, start, seed=2, threads=1)
    assert not any(isinstance(module, torch.nn.BatchNorm2d) for module in found.modules())
    assert not torch.equal(found.backbone.stem[0][0].weight, before)
    image, text = torch.rand(1, 3, 64, 64), torch.rand(1, 3, 256)
    with torch.no_grad():
        for one, other in zip(read_refined(tmp_path / "refined.pt")(image, text), found(image, text), strict=True):
            torch.testing.assert_close(one, other)
