import numpy as np
import pytest

from placegraph.tools.evaluate.ground_truth import Words


def test_words_of_no_class() -> None:
    for embedding in (False, True):
        words = Words({}, embedding)
        assert words.called(["sofa", ""]) == ["", ""] and words.called([]) == []


def test_names_and_other_words_in_any_number() -> None:
    words = Words({"couch": ["settee", "love seat"], "Coffee-Table": []})
    said = ["couch", "Couches", "settees", "love seat", "coffee table", "sofa", ""]
    assert words.called(said) == ["couch", "couch", "couch", "couch", "Coffee-Table", "", ""]


def test_a_word_of_two_classes_is_refused() -> None:
    with pytest.raises(ValueError, match="the word 'Sofa' belongs to two classes, 'couch' and 'bench'"):
        Words({"couch": ["sofa"], "bench": ["Sofa"]})
    assert Words({"couch": ["couches"]}).called(["couch"]) == ["couch"]  # twice the same is no quarrel


def test_by_embedding_a_word_means_the_class_nearest_in_meaning_if_any_is_near() -> None:
    words = Words({"couch": [], "table": [], "lamp": []}, embedding=True)
    assert words.called(["sofa", "table", "chair", "?"]) == ["couch", "table", "", ""]


def test_likeness_is_a_cosine_for_each_class() -> None:
    words = Words({"couch": [], "table": []})
    found = words.likeness(["table", ""])
    assert found.shape == (2, 2) and found[0, 1] == pytest.approx(1, abs=1e-5) and found[0, 0] < 0.5
    assert np.array_equal(found[1], [0, 0])
