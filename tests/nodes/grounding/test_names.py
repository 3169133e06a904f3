import pytest

from placegraph.nodes.grounding.names import COSINE, HEAD, KIND, SAME, SYNONYM


def test_nothing_is_like_nothing(names):
    assert names.likeness("", "chair") == 0
    assert names.likeness("chair", "") == 0
    assert names.named("chair", []) == []
    assert names.nearest("chair", []) == []


@pytest.mark.parametrize(
    ("noun", "tag", "score"),
    [("chairs", "Chair", SAME), ("chair", "office chair", KIND), ("couch", "sofa", SYNONYM), ("mug", "cup", SYNONYM),
     ("wooden chair", "chair", HEAD), ("chair", "zebra", 0), ("mug", "rug", 0), ("glass", "window", 0),
     ("table", "tablecloth", 0)],
)  # fmt: skip
def test_likeness(names, noun, tag, score):
    assert names.likeness(noun, tag) == score


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
    assert max(names.cosine(a, b) for a, b in OTHER_KIND) < COSINE
    assert (
        min(names.cosine(a, b) for a, b in [("fridge", "refrigerator"), ("couch", "sofa"), ("tv", "television")])
        > COSINE
    )


def test_an_id_names_its_node(names, house):
    assert [fit.node.id for fit in names.named("o14", house.layer("object"))] == ["O14"]
    assert names.named("o999", house.layer("object")) == []


def test_weak_second_tags_count_less_and_slips_not_at_all(names, thing_of):
    second = thing_of(0, "R0", "stool", (0, 0, 0), (1, 1, 1), others=[("lamp", 3.0)])
    slip = thing_of(1, "R0", "stool", (0, 0, 0), (1, 1, 1), others=[("lamp", 0.5)])
    untagged = thing_of(2, "R0", "", (0, 0, 0), (1, 1, 1))
    assert [(fit.node.id, round(fit.score, 3)) for fit in names.named("lamp", [second, slip, untagged])] == [
        ("O0", 0.8)
    ]


def test_nearest_names(names, house):
    assert names.nearest("carpet", house.layer("object"), 30)[0] != ""
    assert names.nearest("refrigerators", house.layer("object"))[0] == "fridge"
