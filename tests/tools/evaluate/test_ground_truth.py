import numpy as np
import pytest

from placegraph.tools.evaluate.ground_truth import ClassVocabulary


def test_words_of_no_class() -> None:
    for embedding in (False, True):
        words = ClassVocabulary({}, embedding)
        assert words.classes_of(["sofa", ""]) == ["", ""] and words.classes_of([]) == []


def test_names_and_other_words_in_any_number() -> None:
    words = ClassVocabulary({"couch": ["settee", "love seat"], "Coffee-Table": []})
    said = ["couch", "Couches", "settees", "love seat", "coffee table", "sofa", ""]
    assert words.classes_of(said) == ["couch", "couch", "couch", "couch", "Coffee-Table", "", ""]


def test_a_word_of_two_classes_is_refused() -> None:
    with pytest.raises(ValueError, match="the word 'Sofa' belongs to two classes, 'couch' and 'bench'"):
        ClassVocabulary({"couch": ["sofa"], "bench": ["Sofa"]})
    assert ClassVocabulary({"couch": ["couches"]}).classes_of(["couch"]) == ["couch"]  # twice the same is no quarrel


def test_by_embedding_a_word_means_the_class_nearest_in_meaning_if_any_is_near() -> None:
    words = ClassVocabulary({"couch": [], "table": [], "lamp": []}, embedding=True)
    assert words.classes_of(["sofa", "table", "chair", "?"]) == ["couch", "table", "", ""]


def test_likeness_is_a_cosine_for_each_class() -> None:
    words = ClassVocabulary({"couch": [], "table": []})
    found = words.class_similarities(["table", ""])
    assert found.shape == (2, 2) and found[0, 1] == pytest.approx(1, abs=1e-5) and found[0, 0] < 0.5
    assert np.array_equal(found[1], [0, 0])
