import numpy as np
import pytest

from placegraph.runtime.scene_graph import Tag
from placegraph.tools.evaluate.aligned_map import EMPTY_MAP, AlignedMap, MapObject, MapPlace
from placegraph.tools.evaluate.ground_truth import (
    ClassVocabulary,
    GroundTruth,
    GroundTruthFloor,
    GroundTruthObject,
    GroundTruthPlace,
)
from placegraph.tools.evaluate.layer_scores import map_scores

BOX = np.array([[0.0, 0, 0], [1, 1, 1]])
STOREYS = (GroundTruthFloor(0, 2.5), GroundTruthFloor(2.8, 5.3))
FLOORS = np.array([[0, 2.5], [2.8, 5.3]])
EMPTY = GroundTruth(floors=(), rooms=(), locations=(), objects=())


def square(x, side=2.0):
    return np.array([[x, 0], [x + side, 0], [x + side, side], [x, side]])


def map_of(floors=FLOORS, rooms=()):
    return AlignedMap(floors, tuple(MapPlace(f"R{i}", *room) for i, room in enumerate(rooms)), (), ())


def test_what_is_not_known_is_not_scored() -> None:
    assert map_scores(EMPTY_MAP, GroundTruth()) == {}
    assert set(map_scores(map_of(), GroundTruth(floors=STOREYS))) == {"floors"}


def test_an_empty_map_finds_nothing() -> None:
    room = GroundTruthPlace(0, square(0))
    known = GroundTruth(STOREYS, (room,), (room,), (GroundTruthObject("sofa", BOX),), ClassVocabulary({"sofa": []}))
    found = map_scores(EMPTY_MAP, known)
    for layer in ("floors", "rooms", "objects"):
        assert found[layer]["recall"] == 0 and np.isnan(found[layer]["precision"]), layer
    assert found["rooms"]["f1"] == 0 and found["rooms"]["hydra_recall"] == 0
    assert np.isnan(found["floors"]["boundary_error_m"]) and not found["floors"]["count_equal"]
    assert set(found["locations"]["f1_at"].values()) == {0}


def test_where_nothing_is_true_everything_is_wrong() -> None:
    things = (MapObject("O0", (Tag("sofa", 1.0),), BOX),)
    room = (MapPlace("R0", 0, square(0)),)
    found = map_scores(AlignedMap(FLOORS, room, room, things), EMPTY)
    for layer in ("floors", "rooms", "objects"):
        assert found[layer]["precision"] == 0 and np.isnan(found[layer]["recall"]), layer
    assert found["rooms"]["hydra_precision"] == 0 and set(found["locations"]["f1_at"].values()) == {0}


def test_nothing_of_nothing_is_undefined() -> None:
    found = map_scores(EMPTY_MAP, EMPTY)
    numbers = [found["floors"]["precision"], found["rooms"]["f1"], found["objects"]["recall"]]
    assert np.isnan(numbers).all() and found["floors"]["count_equal"]


def test_more_floors_than_truth() -> None:
    phantom = np.array([[0, 2.5], [1.2, 1.9], [2.8, 5.3], [20, 22]])
    found = map_scores(map_of(phantom), GroundTruth(STOREYS))["floors"]
    assert (found["right"], found["recall"], found["precision"], found["boundary_error_m"]) == (2, 1, 0.5, 0)
    assert not found["count_equal"]


def test_two_floors_taken_for_one_are_one_wrong_and_one_missed() -> None:
    found = map_scores(map_of(np.array([[0, 5.3]])), GroundTruth(STOREYS))["floors"]
    assert (found["right"], found["recall"], found["precision"]) == (0, 0, 0)
    assert found["boundary_error_m"] == pytest.approx(2.8)


def test_a_floor_that_the_walk_was_not_on_is_neither_right_nor_wrong() -> None:
    known = GroundTruth((STOREYS[0], GroundTruthFloor(2.8, 5.3, seen=False)))
    both, one = (map_scores(map_of(floors), known)["floors"] for floors in (FLOORS, FLOORS[:1]))
    for found in (both, one):
        assert (found["truth"], found["of"], found["precision"], found["recall"]) == (1, 2, 1, 1)
        assert found["count_equal"]


def test_rooms_are_compared_on_their_own_floor() -> None:
    known = GroundTruth(STOREYS, (GroundTruthPlace(1, square(0)),))
    upper, lower = map_of(rooms=[(1, square(0))]), map_of(rooms=[(0, square(0))])
    assert map_scores(upper, known)["rooms"]["f1"] == 1 and map_scores(lower, known)["rooms"]["f1"] == 0
    third = map_of(np.array([[2.8, 5.3], [20, 22.5]]), [(1, square(0))])  # on a floor that is no true one
    assert map_scores(third, known)["rooms"]["f1"] == 0
    flat = GroundTruth(rooms=(GroundTruthPlace(0, square(0)),))  # floors are not known: all lie on one
    assert map_scores(upper, flat)["rooms"]["f1"] == 1


def test_rooms_that_were_not_seen_are_not_asked_for() -> None:
    known = GroundTruth(STOREYS, (GroundTruthPlace(0, square(0)), GroundTruthPlace(0, square(5), seen=False)))
    found = map_scores(map_of(rooms=[(0, square(0))]), known)["rooms"]
    assert (found["f1"], found["truth"], found["of"]) == (1, 1, 2)
