import numpy as np
import pytest

from placegraph.nodes.hierarchy.floors import FloorSpan
from placegraph.nodes.hierarchy.object_rooms import FloorRoom, assign_rooms
from placegraph.nodes.hierarchy.plan_grid import PlanGrid
from placegraph.nodes.hierarchy.rooms import RoomArea


def room(name, floor, columns, low):
    mask = np.zeros((10, 20), bool)
    mask[:, columns] = True
    span = FloorSpan(low, low + 2.6, low - 0.1, low + 2.8)
    return FloorRoom(name, floor, span, PlanGrid(np.zeros(2), 0.5, mask.shape), RoomArea(mask, np.zeros((0, 2))))


ROOMS = [room(f"R{2 * f + k}", f"F{f}", slice(8 * k, 8 * k + 8), 3.0 * f) for f in range(2) for k in range(2)]


def homes(*objects):
    return [home.id for home in assign_rooms([np.array(xyz, float) for xyz in objects], ROOMS)]


def test_no_objects_and_no_rooms():
    assert assign_rooms([], []) == []


@pytest.mark.parametrize(
    ("points", "expected"),
    [
        ([[1, 1, 0.5]], "R0"),
        ([[1, 1, 0.5], [5, 1, 0.5], [5, 2, 0.5]], "R1"),  # most of its points
        ([[9.5, 1, 0.5]], "R1"),  # in no room: the nearest
        ([[1, 1, 2.84]], "R0"),  # between two floors: the nearer zone
        ([[1, 1, 2.7], [1, 1, 4.9]], "R2"),  # over a boundary: its middle decides
        ([[1, 1, 99.0]], "R2"),
        ([[1, 1, -99.0]], "R0"),
    ],
)
def test_an_object_is_where_most_of_it_is(points, expected):
    assert homes(points) == [expected]
