import numpy as np
import pytest

from placegraph.tools.simulator.house_frames import generate_house
from placegraph.tools.simulator.occupancy_grid import points_in_polygon
from placegraph.tools.simulator.room_connections import room_connections


@pytest.fixture(scope="module")
def house():
    return generate_house(5, 2)


def test_every_door_of_the_plan_and_every_flight_is_a_passage(house):
    found = room_connections(house)
    holes = [hole for floor in house.floors for wall in floor.walls for hole in wall.openings if len(hole.rooms) == 2]
    assert sorted((one.kind, one.rooms) for one in found if one.kind != "stairs") == sorted(
        (hole.kind, hole.rooms) for hole in holes
    )
    assert [one.id for one in found] == list(range(len(found)))
    (stairs,) = [one for one in found if one.kind == "stairs"]
    assert np.array_equal(stairs.ends, [house.stairs[0].foot, house.stairs[0].head])
    assert [house.rooms[room].floor for room in stairs.rooms] == [0, 1]


def test_the_middle_of_a_door_is_between_its_two_rooms(house):
    rooms = {room.id: room for room in house.rooms}
    for one in room_connections(house):
        if one.kind != "stairs":
            ring = np.linspace(0, 2 * np.pi, 16, endpoint=False)
            around = one.ends[0, :2] + 0.25 * np.stack((np.cos(ring), np.sin(ring)), axis=1)
            assert all(points_in_polygon(rooms[room].polygon, around).any() for room in one.rooms), one
            assert 0.8 < one.width_m < 2.7 and one.ends[0, 2] == house.floors[rooms[one.rooms[0]].floor].z_m


def test_travel_is_on_one_floor_between_all_pairs_and_not_below_the_straight_line(house):
    found = room_connections(house)
    floors = {room.id: room.floor for room in house.rooms}
    for one in found:
        mine = {floors[room] for room in one.rooms}
        there = [other for other in found if other.id > one.id and mine & {floors[room] for room in other.rooms}]
        assert [i for i, _ in one.travel_m] == [other.id for other in there]  # every room can be reached
        for other, (_, length) in zip(there, one.travel_m, strict=True):
            straight = min(np.linalg.norm(a - b) for a in one.ends for b in other.ends if abs(a[2] - b[2]) < 1e-6)
            assert straight - 0.6 <= length < 40  # the nearest cell to stand in may be off the middle
