import numpy as np
import pytest

from placegraph.nodes.hierarchy.floors import FloorSpan
from placegraph.nodes.hierarchy.locations import LocationConfig, find_locations

SPAN = FloorSpan(0.0, 2.5, 0.0, 2.5)


def block(x, y, size=0.5, z=(0.0, 0.8)):
    axis = np.arange(0, size, 0.05)
    return np.stack(np.meshgrid(x + axis, y + axis, np.arange(*z, 0.05)), axis=-1).reshape(-1, 3)


def find(*objects, **changes):
    return find_locations(objects, SPAN, LocationConfig(**changes))


def test_no_objects():
    assert find() == []


def test_one_object_is_no_location():
    assert find(block(0, 0)) == []


def test_two_near_objects_are_one_and_the_far_one_is_not_in_it():
    (area,) = find(block(0, 0), block(5, 5), block(0.7, 0))
    assert area.members == (0, 2)
    assert area.outline.min(axis=0) == pytest.approx((0, 0), abs=0.1)
    assert area.outline.max(axis=0) == pytest.approx((1.2, 0.5), abs=0.1)


def test_two_groups_come_in_the_order_of_their_first_object():
    groups = find(block(5, 5), block(0, 0), block(0.6, 0), block(5.6, 5))
    assert [area.members for area in groups] == [(0, 3), (1, 2)]


def test_lamps_and_carpets_do_not_join_what_stands_between():
    lamp = block(0.0, 0, 3.0, (2.3, 2.4))
    carpet = block(0.0, 0, 3.0, (0.0, 0.05))
    assert find(block(0, 0), lamp, carpet, block(2.5, 2.5)) == []


def test_an_object_joins_the_cluster_with_most_of_its_points():
    straggler = np.concatenate((block(0.6, 0), block(5.0, 5, 0.1)))
    groups = find(block(0, 0), block(5, 5), block(5.6, 5), straggler)
    assert [area.members for area in groups] == [(0, 3), (1, 2)]


def test_small_and_elongated_areas_go():
    assert find(block(0, 0, 0.1), block(0.2, 0, 0.1)) == []
    row = [block(0.3 * i, 0, 0.2) for i in range(12)]
    assert len(find(*row, compactness=0.05)) == 1
    assert find(*row) == []


def test_objects_without_points_in_the_band():
    assert find(block(0, 0, z=(2.2, 2.5)), block(0.5, 0, z=(2.2, 2.5))) == []
