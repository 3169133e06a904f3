import numpy as np
import pytest

from placegraph.runtime.scene_graph import Tag
from placegraph.tools.evaluate.aligned_map import MapObject
from placegraph.tools.evaluate.ground_truth import ClassVocabulary, GroundTruthObject
from placegraph.tools.evaluate.house_truth import HOUSE_VOCABULARY
from placegraph.tools.evaluate.object_scores import object_scores, top_k
from placegraph.tools.simulator.object_classes import NAMES


def box(x, size=(1.0, 1.0, 1.0), y=0.0):
    return np.array([[x, y, 0.0], [x + size[0], y + size[1], size[2]]])


def things(*rows):
    return [
        MapObject(f"O{i}", tuple(Tag(n, 1.0 / (k + 1)) for k, n in enumerate(names.split("/"))) if names else (), b)
        for i, (names, b) in enumerate(rows)
    ]


def scores(found, true, poor=(), unseen=(), words=HOUSE_VOCABULARY):
    visibilities = ["never" if i in unseen else "poorly" if i in poor else "well" for i in range(len(true))]
    known = [GroundTruthObject(name, b, sight) for (name, b), sight in zip(true, visibilities, strict=True)]
    return object_scores(things(*found), known, words)


def test_nothing_at_all() -> None:
    found = scores([], [])
    assert (found["truth"], found["map"], found["found"], found["classes"]) == (0, 0, 0, {})
    assert np.isnan([found["recall"], found["precision"], found["mean_iou"], found["map_per_found"]]).all()


def test_an_empty_map_and_an_empty_house() -> None:
    missed = scores([], [("sofa", box(0))])
    assert missed["recall"] == 0 and np.isnan(missed["precision"])
    invented = scores([("sofa", box(0))], [])
    assert invented["precision"] == 0 and np.isnan(invented["recall"])
    assert invented["classes"]["sofa"] == {"truth": 0, "found": 0, "map": 1, "wrong": 1}


@pytest.mark.parametrize(
    ("name", "recall"), [("sofa", 1), ("Couches", 1), ("settee", 1), ("armchair", 0), ("unheard of", 0), ("", 0)]
)
def test_the_strongest_tag_must_be_a_word_of_the_class(name, recall) -> None:
    found = scores([(name, box(0))], [("sofa", box(0))])
    assert (found["recall"], found["precision"], found["recall_any_name"]) == (recall, recall, 1)


def test_a_second_tag_is_not_enough() -> None:
    assert scores([("bed/sofa", box(0))], [("sofa", box(0))])["recall"] == 0


def test_the_overlap_decides() -> None:
    near, far = scores([("sofa", box(0.5))], [("sofa", box(0))]), scores([("sofa", box(0.7))], [("sofa", box(0))])
    assert (near["recall"], near["recall_50"], near["mean_iou"]) == (1, 0, pytest.approx(1 / 3))
    assert (far["recall"], far["recall_any_name"]) == (0, 0)
    assert scores([("sofa", box(0.3))], [("sofa", box(0))])["recall_50"] == 1


def test_only_a_thin_true_object_is_found_by_its_center() -> None:
    flat, deep = (1.0, 0.04, 1.0), (1.0, 0.4, 1.0)
    beside = [("picture", box(0, flat, y=0.2))]
    assert scores(beside, [("picture", box(0, flat))])["recall"] == 1
    assert scores(beside, [("picture", box(0, flat))])["recall_50"] == 0
    assert scores([("picture", box(0, flat, y=0.3))], [("picture", box(0, flat))])["recall"] == 0
    assert scores([("sofa", box(0, flat, y=0.18))], [("sofa", box(0, deep))])["recall"] == 0


def test_two_of_a_kind_are_paired_one_to_one_best_first() -> None:
    found = scores([("chair", box(0.4)), ("chair", box(0.0))], [("chair", box(0.1)), ("chair", box(5))])
    # O1 overlaps more (.82 against .54) and takes it; O0 is its duplicate
    assert (found["found"], found["recall"], found["precision"], found["map_per_found"]) == (1, 0.5, 0.5, 2)
    assert found["mean_iou"] == pytest.approx(0.9 / 1.1)
    assert found["classes"]["chair"] == {"truth": 2, "found": 1, "map": 2, "wrong": 1}


def test_a_small_piece_inside_is_a_duplicate_but_one_of_another_class_is_not() -> None:
    piece = box(0.1, (0.2, 0.2, 0.2))
    found = scores([("sofa", box(0)), ("sofa", piece), ("cushion", piece)], [("sofa", box(0))])
    assert (found["found"], found["map_per_found"], found["precision"]) == (1, 2, pytest.approx(1 / 3))


def test_what_was_seen_poorly_is_neither_asked_for_nor_wrong() -> None:
    found = scores([("sofa", box(0)), ("bed", box(5))], [("sofa", box(0)), ("bed", box(5))], poor={1})
    assert (found["truth"], found["of"], found["recall"], found["precision"], found["aside"]) == (1, 2, 1, 1, 1)
    wrong_name = scores([("bed", box(0))], [("sofa", box(0))], poor={0})
    assert (wrong_name["precision"], wrong_name["aside"]) == (0, 0)


def test_what_was_never_seen_excuses_nothing() -> None:
    found = scores([("sofa", box(0))], [("sofa", box(0))], unseen={0})
    assert (found["precision"], found["aside"]) == (0, 0) and np.isnan(found["recall"])


def test_a_poorly_seen_neighbor_takes_no_map_object_from_one_seen_well() -> None:
    found = scores([("chair", box(0.3))], [("chair", box(0)), ("chair", box(0.3))], poor={1})
    assert (found["recall"], found["precision"], found["aside"]) == (1, 1, 0)


def test_top_k_ranks_the_true_class_by_the_tags() -> None:
    assert top_k([], HOUSE_VOCABULARY) == {"objects": 0, "classes": len(NAMES)}
    exact = top_k([((Tag("sofa", 2.0),), "sofa")], HOUSE_VOCABULARY)
    assert exact["top_1"] == 1 and exact["auc"] == 1
    outvoted = top_k([((Tag("bed", 5.0), Tag("sofa", 1.0)), "sofa")], HOUSE_VOCABULARY)
    assert outvoted["top_1"] == 0 and outvoted["top_10"] == 1 and 0.8 < outvoted["auc"] < 1
    both = top_k([((Tag("sofa", 2.0),), "sofa"), ((Tag("bed", 5.0), Tag("sofa", 1.0)), "sofa")], HOUSE_VOCABULARY)
    assert both["top_1"] == 0.5 and both["auc"] == pytest.approx((1 + outvoted["auc"]) / 2)


def test_an_object_without_tags_gets_no_credit_for_the_order_of_equals() -> None:
    found = scores([("", box(0))], [("sofa", box(0))])
    assert found["top_k"]["objects"] == 1 and found["classes"]["(no name)"]["wrong"] == 1
    count = len(NAMES)
    assert found["top_k"]["top_1"] == pytest.approx(1 / count)
    assert found["top_k"]["auc"] == pytest.approx((count + 1) / (2 * count))  # what guessing gets


def test_fewer_classes_than_k() -> None:
    one = top_k([((Tag("bed", 1.0),), "sofa")], ClassVocabulary({"sofa": []}))
    assert (one["top_1"], one["top_10"], one["auc"], one["classes"]) == (1, 1, 1, 1)


def test_all_objects_twice() -> None:
    true = [("sofa", box(0)), ("bed", box(3)), ("chair", box(6))]
    found = scores([*true, *true], true)
    assert (found["recall"], found["precision"], found["map_per_found"], found["map_per_found_any_name"]) == (
        1,
        0.5,
        2,
        2,
    )
    renamed = scores([*true, *(("lamp", b) for _, b in true)], true)
    assert (renamed["map_per_found"], renamed["map_per_found_any_name"], renamed["precision"]) == (1, 2, 0.5)


def test_one_object_in_three_pieces_and_two_in_one() -> None:
    thirds = [("bed", box(x, (1.0, 3.0, 1.0))) for x in (0.0, 1.0, 2.0)]
    split = scores(thirds, [("bed", box(0, (3.0, 3.0, 1.0)))])
    assert (split["recall"], split["precision"], split["map_per_found"]) == (1, pytest.approx(1 / 3, abs=1e-4), 3)
    merged = scores([("bed", box(0, (2.0, 1.0, 1.0)))], [("bed", box(0)), ("bed", box(1))])
    assert (merged["recall"], merged["precision"], merged["map_per_found"]) == (0.5, 1, 1)


def test_a_box_without_volume_overlaps_nothing() -> None:
    point = np.zeros((2, 3))
    found = scores([("sofa", point)], [("sofa", point)])
    assert found["recall_any_name"] == 0 and found["recall"] == 1  # but it is thin, and found by its centre
