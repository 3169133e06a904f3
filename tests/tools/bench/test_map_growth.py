import numpy as np

from placegraph.tools.bench.box_building import NAMES, VIEWS, room, views
from placegraph.tools.bench.map_growth import drawing, grow, p95_by_floor


def test_furniture_stands_in_its_room_and_apart():
    middle, boxes = room(2, 7, np.random.default_rng(0))
    things = [box for box in boxes if box.name]
    assert [box.name for box in things] == list(NAMES)
    for i, one in enumerate(things):
        assert np.abs((one.low + one.high)[:2] / 2 - middle[:2]).max() < 2.0 and one.low[2] == middle[2]
        for other in things[i + 1 :]:
            assert ((one.low >= other.high) | (other.low >= one.high)).any()


def test_every_view_is_valid_and_shows_something():
    found = list(views(2, 1))
    assert [floor for floor, _, _ in found] == [0] * VIEWS + [1] * VIEWS
    for _, keyframe, segments in found:
        keyframe.check()
        segments.check()
        assert (keyframe.depth > 0).mean() > 0.5 and segments.names


def test_a_small_building_is_mapped_and_drawn():
    samples = grow(2, 2)
    assert len(samples) == 4 * VIEWS and sum(one.with_map for one in samples) >= 2
    assert len(p95_by_floor(samples)) == 2 and min(one.fusion_ms for one in samples) > 0
    text = drawing(samples, 2)
    assert text.count("<circle") == len(samples) and text.startswith("<svg") and text.endswith("</svg>\n")
