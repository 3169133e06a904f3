import numpy as np
import pytest

from placegraph.tools.training import location_evaluation as location_labels
from placegraph.tools.training.location_evaluation import MappedRoom, comparison, house_iou
from placegraph.tools.training.room_scans import RoomScan


def square(x, y=0.0, size=1.0):
    return np.array([[x, y], [x + size, y], [x + size, y + size], [x, y + size]])


def room(*outlines, seen=None):
    seen = np.ones(len(outlines), bool) if seen is None else np.array(seen, bool)
    return MappedRoom(RoomScan(0, 0.0, 2.5, np.zeros(4), (), (), outlines), seen)


def test_what_is_found_in_one_room_is_not_right_for_another():
    iou = house_iou([room(square(0)), room(square(5))], lambda scan: [square(5)])
    np.testing.assert_allclose(iou, [[0, 0], [0, 1]])


def test_a_house_without_locations():
    assert house_iou([room()], lambda scan: []).shape == (0, 0)


def test_the_table_has_all_truths_and_those_seen(monkeypatch):
    houses = {1: [room(square(0), square(5), seen=(1, 0))], 2: [room(square(0)), room()]}
    monkeypatch.setattr(location_labels, "mapped_rooms", houses.__getitem__)
    lines = comparison({"one": lambda scan: [square(0)]}, seeds=(1, 2), deltas=(0.5,)).splitlines()
    assert lines[1].split() == ["1", "2", "0.667"]
    assert lines[2].split() == ["2", "1", "0.667"]
    assert lines[3].split() == ["all", "@0.5", "3", "0.667", "0.667", "0.667"]  # 2 of 3 finds, 2 of 3 truths
    assert lines[4].split() == ["seen", "@0.5", "2", "0.667", "1.000", "0.800"]


def test_an_unseen_location_that_was_found_all_the_same_is_a_wrong_find(monkeypatch):
    monkeypatch.setattr(location_labels, "mapped_rooms", lambda seed: [room(square(0), seen=(0,))])
    last = comparison({"one": lambda scan: [square(0)]}, seeds=(1,), deltas=(0.5,)).splitlines()[-2]
    assert last.split()[3] == "0.000" and last.split()[:3] == ["seen", "@0.5", "0"]


@pytest.mark.parametrize("delta", [0.3, 0.9])
def test_an_overlap_must_exceed_delta(monkeypatch, delta):
    monkeypatch.setattr(location_labels, "mapped_rooms", lambda seed: [room(square(0))])
    line = comparison({"one": lambda scan: [square(0.25)]}, seeds=(1,), deltas=(delta,)).splitlines()[2]
    assert line.split()[-1] == ("1.000" if delta == 0.3 else "0.000")  # IoU .6
