import numpy as np
import pytest

from placegraph.models_onnx import ScoredMasks
from placegraph.nodes.hierarchy.floors import FloorSpan
from placegraph.nodes.hierarchy.locations import LocationConfig, find_locations
from placegraph.runtime.errors import ConfigError

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


class Drawn:
    """A detector whose masks are given: rectangles x0 y0 x1 y1 in metres from the middle of the image."""

    def __init__(self, *found):
        self.found = found

    def locate(self, image):
        masks = []
        for (x0, y0, x1, y1), _ in self.found:
            mask = np.zeros(image.shape[:2], bool)
            middle = len(mask) // 2
            rows, columns = (slice(middle + round(a / 0.05), middle + round(b / 0.05)) for a, b in ((y0, y1), (x0, x1)))
            mask[rows, columns] = True
            masks.append(mask)
        return ScoredMasks(masks, np.array([score for _, score in self.found], np.float32))


def detect(found, *objects, **changes):
    return find_locations(objects, SPAN, LocationConfig(model="net", **changes), Drawn(*found))


PAIRS = (block(-2.25, -0.25), block(-1.5, -0.25), block(1.0, -0.25), block(1.75, -0.25))  # their middle is the origin


def test_objects_mostly_inside_a_mask_are_its_members():
    areas = detect([((0.8, -0.5, 2.6, 0.5), 0.9), ((-2.4, -0.5, -0.9, 0.5), 0.8)], *PAIRS)
    assert [area.members for area in areas] == [(0, 1), (2, 3)]
    assert areas[0].outline.min(axis=0) == pytest.approx((-2.4, -0.5), abs=0.06)
    assert areas[0].outline.max(axis=0) == pytest.approx((-0.9, 0.5), abs=0.06)


def test_an_object_belongs_to_the_better_of_two_masks():
    areas = detect([((0.8, -0.5, 2.6, 0.5), 0.9), ((-2.6, -0.5, 2.6, 0.5), 0.8)], *PAIRS)
    assert [area.members for area in areas] == [(0, 1), (2, 3)]


def test_the_outline_holds_members_that_stand_and_not_those_that_hang():
    hanging = block(2.4, -0.25, 0.5, (1.2, 1.6))
    counterweight = block(-2.85, -0.25)  # keeps the middle of all at the origin
    mask = (0.8, -0.5, 2.5, 0.5)
    (area,) = detect([(mask, 0.9)], *PAIRS, hanging, counterweight, inside_share=0.15)
    assert area.members == (2, 3, 4)
    assert area.outline[:, 0].max() < 2.6
    standing = block(2.4, -0.25, 0.5, (0.0, 1.6))
    (area,) = detect([(mask, 0.9)], *PAIRS, standing, counterweight, inside_share=0.15)
    assert area.outline[:, 0].max() > 2.8


def test_uncertain_empty_and_tiny_masks_are_none():
    assert detect([((0.8, -0.5, 2.6, 0.5), 0.1)], *PAIRS, min_score=0.2) == []
    assert detect([((0.8, 2.0, 1.6, 2.5), 0.9)], *PAIRS) == []
    assert len(detect([((0.8, -0.5, 1.6, 0.5), 0.9)], *PAIRS)) == 1
    assert detect([((0.8, -0.5, 1.6, 0.5), 0.9)], *PAIRS, min_area_m2=2.0) == []


def test_no_objects_need_no_network():
    assert detect([((0, 0, 1, 1), 0.9)]) == []


def test_a_model_that_was_not_loaded_is_an_error():
    with pytest.raises(ConfigError, match="'net'"):
        find_locations([block(0, 0)], SPAN, LocationConfig(model="net"))
