"""Words to unit rows: as trained, and as a table of the words of the training."""

from __future__ import annotations

import pytest

torch = pytest.importorskip("torch", reason="training needs the extra `train`")

from placegraph.models_onnx.text_encoder import TextEncoder  # noqa: E402
from placegraph.tools.simulator.object_classes import CLASSES  # noqa: E402
from placegraph.tools.training.word_projection import EMBEDDING, KNOWN_WORDS, WordProjection, WordTable  # noqa: E402

torch.set_num_threads(1)


def encoded(*words):
    return torch.from_numpy(TextEncoder().encode(words))


def test_words_are_unit_rows_also_for_a_text_without_letters():
    rows = WordProjection()(torch.cat((torch.randn(1, 5, 256), torch.zeros(1, 1, 256)), 1))
    assert rows.shape == (1, 6, EMBEDDING)
    torch.testing.assert_close(rows.norm(dim=-1), torch.ones(1, 6), atol=1e-3, rtol=0)


def test_the_table_gives_known_words_what_was_learnt():
    torch.manual_seed(2)
    words = WordProjection().eval()
    known = encoded("chair", "washing machine", "lamp")
    table = WordTable(words, known)
    with torch.no_grad():
        found, wanted = table(known[None])[0], words(known[None])[0]
    assert ((found * wanted).sum(1) > 0.99).all()
    torch.testing.assert_close(found.norm(dim=-1), torch.ones(3), atol=1e-3, rtol=0)


def test_an_unknown_word_means_what_the_nearest_known_one_means():
    torch.manual_seed(2)
    names = ("sofa", "toilet", "bicycle", "picture")
    table = WordTable(WordProjection().eval(), encoded(*names))
    with torch.no_grad():
        known, asked = table(encoded(*names)[None])[0], table(encoded("couch", "lavatory", "bike", "painting")[None])[0]
    assert (asked @ known.T).argmax(1).tolist() == [0, 1, 2, 3]


def test_the_table_learns():
    table = WordTable(WordProjection(), encoded("chair", "lamp"))
    table(encoded("chair")[None]).sum().backward()
    assert table.meaning.grad is not None and table.meaning.grad.abs().max() > 0


def test_no_synonym_that_is_kept_aside_is_in_the_table():
    assert not set(KNOWN_WORDS) & {word for one in CLASSES for word in one.held_out_words}
    assert len(set(KNOWN_WORDS)) == len(KNOWN_WORDS)
