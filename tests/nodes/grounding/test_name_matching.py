import pytest

from placegraph.nodes.grounding.name_matching import is_misspelling
from placegraph.nodes.grounding.settings import NameSettings

N = NameSettings()


def test_nothing_is_like_nothing(names):
    assert names.similarity("", "chair") == 0
    assert names.similarity("chair", "") == 0
    assert names.best_matches("chair", []) == []
    assert names.nearest_names("chair", []) == []


@pytest.mark.parametrize(
    ("noun", "tag", "score"),
    [("chairs", "Chair", N.same_words_fit), ("chair", "office chair", N.head_noun_fit),
     ("couch", "sofa", N.synonym_fit), ("mug", "cup", N.synonym_fit),
     ("wooden chair", "chair", N.other_modifier_fit), ("chair", "zebra", 0),
     ("duffel bag", "bag", N.synonym_fit + N.shared_word_bonus), ("duffel bag", "backpack", N.synonym_fit),
     ("trashcan", "trash can", N.same_words_fit),
     ("dry erase board", "whiteboard", N.synonym_fit), ("seats", "armchair", N.superclass_fit),
     ("bookshlef", "bookshelf", N.misspelled_fit),
     ("angel staute", "statue", N.other_modifier_fit * N.misspelled_fit),
     ("leather couch", "sofa", N.other_modifier_fit * N.synonym_fit),
     ("mug", "rug", 0), ("glass", "window", 0),
     ("table", "tablecloth", 0)],
)  # fmt: skip
def test_likeness(names, noun, tag, score):
    assert names.similarity(noun, tag) == score


OTHER_KIND = [
    ("mug", "rug"), ("glass", "window"), ("desk", "sofa"), ("bed", "nightstand"), ("floor", "carpet"),
    ("chair", "armchair"), ("fridge", "shelf"), ("bin", "bicycle"), ("lamp", "chair"), ("piano", "table"),
]  # fmt: skip
SAME_KIND = [
    ("fridge", "refrigerator"),
    ("couch", "sofa"),
    ("tv", "television"),
    ("plant", "flower"),
    ("lamp", "light"),
]


def test_the_cosine_threshold_parts_the_pairs(names):
    assert max(names.cosine(a, b) for a, b in OTHER_KIND) < N.min_cosine
    assert (
        min(names.cosine(a, b) for a, b in [("fridge", "refrigerator"), ("couch", "sofa"), ("tv", "television")])
        > N.min_cosine
    )


def test_an_id_names_its_node(names, house):
    assert [fit.node.id for fit in names.best_matches("o14", house.layer("object"))] == ["O14"]
    assert names.best_matches("o999", house.layer("object")) == []


def test_weak_second_tags_count_less_and_slips_not_at_all(names, thing_of):
    second = thing_of(0, "R0", "stool", (0, 0, 0), (1, 1, 1), others=[("lamp", 3.0)])
    slip = thing_of(1, "R0", "stool", (0, 0, 0), (1, 1, 1), others=[("lamp", 0.5)])
    untagged = thing_of(2, "R0", "", (0, 0, 0), (1, 1, 1))
    assert [(fit.node.id, round(fit.score, 3)) for fit in names.best_matches("lamp", [second, slip, untagged])] == [
        ("O0", 0.8)
    ]


def test_nearest_names(names, house):
    assert names.nearest_names("carpet", house.layer("object"), 30)[0] != ""
    assert names.nearest_names("refrigerators", house.layer("object"))[0] == "fridge"


@pytest.mark.parametrize(
    ("noun", "word", "slip"),
    [("curtian", "curtain", True), ("widnow", "window", True), ("wimdow", "window", True), ("desk", "dusk", False),
     ("refridgerator", "refrigerator", True), ("lamp", "lamb", False), ("table", "cable", False),
     ("shelf", "shell", False),
     ("board", "boards", False), ("chairs", "chair", True), ("", "chair", False)],
)  # fmt: skip
def test_slips_of_spelling(noun, word, slip):
    assert is_misspelling(noun, word) == slip


def test_what_is_fairly_called_so_is_taken_where_nothing_is(names, house):
    objects = house.layer("object")
    fair = names.nearest_matches("sofas", objects)
    assert {fit.node.name for fit in fair} == {"sofa"}
    assert all(fit.score >= N.min_nearest_cosine for fit in fair)
    assert (
        names.nearest_matches("zebra", objects)
        == names.nearest_matches("", objects)
        == names.nearest_matches("o3", objects)
        == []
    )
