import numpy as np
import pytest

from placegraph.nodes.hierarchy.persistent_ids import PersistentIds, PlaceFootprint, footprint_iou, height_footprint


def square(x, y, size=4.0, group="F0"):
    return PlaceFootprint(np.array([[x, y], [x + size, y], [x + size, y + size], [x, y + size]]), group)


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


def test_overlap_values():
    assert footprint_iou(square(0, 0), square(0, 0)) == 1
    assert footprint_iou(square(0, 0), square(2, 0)) == pytest.approx(1 / 3, abs=0.03)
    assert footprint_iou(square(0, 0), square(9, 9)) == 0
    assert footprint_iou(square(0, 0), PlaceFootprint(np.zeros((0, 2)), "F0")) == 0


def test_floors_are_told_apart_by_height():
    known = PersistentIds("F")
    spans = [PlaceFootprint(height_footprint(0, 2.6)), PlaceFootprint(height_footprint(3, 5.6))]
    assert known.assign(spans) == ["F0", "F1"]
    assert known.assign([PlaceFootprint(height_footprint(-3, -0.4)), *spans]) == ["F2", "F0", "F1"]


def test_a_place_that_falls_into_two_keeps_its_id_once():
    identities = PersistentIds("L")
    square = np.array([[0, 0], [4, 0], [4, 4], [0, 4]], float)
    assert identities.assign([PlaceFootprint(square, "F0")]) == ["L0"]
    left, right = (PlaceFootprint(square * (0.5, 1) + (x, 0), "F0") for x in (0, 2))
    assert sorted(identities.assign([left, right])) == ["L0", "L1"]


def test_many_places_far_apart_keep_their_ids():
    square = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float)
    places = [PlaceFootprint(square + np.array([2 * i, 0]), f"F{i % 2}") for i in range(60)]
    identities = PersistentIds("R")
    first = identities.assign(places)
    assert identities.assign(places[::-1]) == first[::-1]
