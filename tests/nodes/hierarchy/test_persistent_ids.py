import numpy as np

from placegraph.nodes.hierarchy.persistent_ids import PersistentIds, height_outline


def square(x, y, size=4.0, group="F0"):
    return group, np.array([[x, y], [x + size, y], [x + size, y + size], [x, y + size]])


def test_nothing_to_name():
    assert PersistentIds("R").assign([]) == []


def test_ids_follow_places_and_not_their_order():
    known = PersistentIds("R")
    assert known.assign([square(0, 0), square(5, 0)]) == ["R0", "R1"]
    assert known.assign([square(5.2, 0), square(0, 0.3)]) == ["R1", "R0"]


def test_a_place_that_grows_keeps_its_id_and_a_new_one_gets_a_new_one():
    known = PersistentIds("R")
    known.assign([square(0, 0, 2)])
    assert known.assign([square(10, 0), square(0, 0, 4)]) == ["R1", "R0"]


def test_when_a_place_splits_the_larger_part_keeps_the_id():
    known = PersistentIds("R")
    known.assign([square(0, 0, 4)])
    assert known.assign([square(3, 3, 1), square(0, 0, 3)]) == ["R1", "R0"]


def test_an_id_that_went_is_not_given_to_another_place_but_to_the_same_one_again():
    known = PersistentIds("R")
    known.assign([square(0, 0), square(5, 0)])
    assert known.assign([square(20, 0)]) == ["R2"]
    assert known.assign([square(5, 0)]) == ["R1"]


def test_places_of_different_floors_never_match():
    known = PersistentIds("R")
    known.assign([square(0, 0, group="F0")])
    assert known.assign([square(0, 0, group="F1")]) == ["R1"]


def test_floors_are_told_apart_by_height():
    known = PersistentIds("F")
    spans = [("", height_outline(0, 2.6)), ("", height_outline(3, 5.6))]
    assert known.assign(spans) == ["F0", "F1"]
    assert known.assign([("", height_outline(-3, -0.4)), *spans]) == ["F2", "F0", "F1"]


def test_a_place_that_falls_into_two_keeps_its_id_once():
    identities = PersistentIds("L")
    square = np.array([[0, 0], [4, 0], [4, 4], [0, 4]], float)
    assert identities.assign([("F0", square)]) == ["L0"]
    left, right = (("F0", square * (0.5, 1) + (x, 0)) for x in (0, 2))
    assert sorted(identities.assign([left, right])) == ["L0", "L1"]


def test_many_places_far_apart_keep_their_ids():
    square = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float)
    places = [(f"F{i % 2}", square + np.array([2 * i, 0])) for i in range(60)]
    identities = PersistentIds("R")
    first = identities.assign(places)
    assert identities.assign(places[::-1]) == first[::-1]
