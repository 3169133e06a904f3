"""The walk through a house: everywhere, never through walls, in steps that a tracker can follow."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from placegraph.runtime.arrays import F64, I64, Bool
from placegraph.runtime.errors import SourceError
from placegraph.tools.simulator.camera_trajectory import EYE_M, CameraTrajectory, camera_trajectory
from placegraph.tools.simulator.house_model import (
    Floor,
    House,
    Item,
    Material,
    PlacedItem,
    Room,
    Staircase,
    Wall,
    WallOpening,
)
from placegraph.tools.simulator.mesh_primitives import block
from placegraph.tools.simulator.occupancy_grid import free_grid, points_in_polygon
from placegraph.tools.simulator.robot_navigation import build_free_space, resample, route, routes_to

WHITE = Material((230, 230, 230))


NO_ROOM = -1


def items_in_view(house: House, trajectory: CameraTrajectory, half_view: tuple[float, float] = (0.6, 0.47)) -> Bool:
    """(I,) whether the centre of each item was in view, .5 to 4.5 m ahead; half_view in radians, across and upright."""
    result = np.zeros(len(house.items), bool)
    camera_from_world = np.linalg.inv(trajectory.world_from_camera)
    for k, item in enumerate(house.items):
        x, y, z = (camera_from_world[:, :3, :3] @ item.box.mean(axis=0) + camera_from_world[:, :3, 3]).T
        framed = (np.abs(x) < z * np.tan(half_view[0])) & (np.abs(y) < z * np.tan(half_view[1]))
        result[k] = bool(np.any(framed & (z > 0.5) & (z < 4.5)))
    return result


def rooms_of_frames(house: House, world_from_camera: F64) -> I64:
    """(N,) Room.id of each camera pose (N, 4, 4), NO_ROOM on stairs; in a doorway the room that is being left."""
    xyz = world_from_camera[:, :3, 3]
    rooms = np.full(len(xyz), NO_ROOM, np.int64)
    for floor in house.floors:
        level = (xyz[:, 2] > floor.z_m + EYE_M[0] - 0.02) & (xyz[:, 2] < floor.z_m + EYE_M[1] + 0.02)
        for room in floor.rooms:
            rooms[level & points_in_polygon(room.polygon, xyz[:, :2])] = room.id
        for k in np.flatnonzero(level):
            rooms[k] = rooms[k - 1] if rooms[k] == NO_ROOM and k else rooms[k]
    return rooms


def rectangle(x0: float, y0: float, x1: float, y1: float) -> np.ndarray:
    return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])


def placed(id: int, room: int, at: tuple[float, float, float], size: tuple[float, float, float]) -> PlacedItem:
    return PlacedItem(id, Item("box", (block((0, 0, 0), size, WHITE),)), *at, 0.0, room)


def a_house(door: bool = True) -> House:
    """Below a living room, and a bathroom behind a door; the flight along the north wall leads to a bedroom."""
    hole = rectangle(1.0, 3.0, 4.0, 4.0)
    opening = (WallOpening("door", 1.0, 1.9, 0.0, 2.0, (0, 1)),) if door else ()
    middle = Wall((6.05, 0.0), (6.05, 4.0), 0.1, opening)
    rooms = (Room(0, 0, "living room", rectangle(0, 0, 6, 4)), Room(1, 0, "bathroom", rectangle(6.1, 0, 8.1, 2.4)))
    upper = Room(2, 1, "bedroom", rectangle(0, 0, 6, 4))
    floors = (
        Floor(0, 0.0, 2.5, rectangle(0, 0, 8.1, 4), rooms, (middle,)),
        Floor(1, 2.8, 2.5, rectangle(0, 0, 6, 4), (upper,), ()),
    )
    stairs = (Staircase(0, np.array([1.0, 3.5, 0.0]), np.array([4.0, 3.5, 2.8]), 0.9, hole),)
    items = (
        placed(0, 0, (3.5, 0.4, 0.0), (1.6, 0.7, 0.8)),
        placed(1, 0, (5.7, 2.9, 0.0), (0.5, 1.0, 1.9)),
        placed(2, 0, (2.6, 3.5, 0.0), (2.9, 0.9, 1.5)),  # the body of the stairs
        placed(3, 1, (7.8, 1.9, 0.0), (0.5, 0.5, 0.4)),
        placed(4, 2, (3.0, 0.9, 2.8), (1.6, 1.6, 0.5)),
        placed(5, 2, (0.3, 1.5, 2.8), (0.5, 1.4, 2.0)),
    )
    return House(3, floors, stairs, (), items)


@pytest.fixture(scope="module")
def walked() -> CameraTrajectory:
    return camera_trajectory(a_house(), 3)


def test_every_room_is_entered_and_all_items_are_looked_at(walked: CameraTrajectory) -> None:
    rooms = rooms_of_frames(a_house(), walked.world_from_camera)
    assert set(rooms.tolist()) == {NO_ROOM, 0, 1, 2}
    assert rooms[0] == 0
    assert rooms[-1] == 2
    assert items_in_view(a_house(), walked).all()


def test_the_camera_is_above_free_floor_or_on_the_stairs(walked: CameraTrajectory) -> None:
    house = a_house()
    xyz = walked.world_from_camera[:, :3, 3]
    on_flight = points_in_polygon(rectangle(0.4, 3.2, 4.7, 3.8), xyz[:, :2])
    for floor in house.floors:
        made = build_free_space(*free_grid(house, floor.index), 0.05)
        level = (xyz[:, 2] > floor.z_m + 1.2) & (xyz[:, 2] < floor.z_m + 1.45) & ~on_flight
        assert level.sum() > 50
        assert (made.clearance(xyz[level, :2]) > 0).all()


def test_frames_follow_each_other_in_small_steps(walked: CameraTrajectory) -> None:
    poses = walked.world_from_camera
    assert np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1).max() <= 0.08
    turns = np.einsum("nji,njk->nik", poses[:-1, :3, :3], poses[1:, :3, :3])
    angles = np.degrees(np.arccos(np.clip((np.trace(turns, axis1=1, axis2=2) - 1) / 2, -1, 1)))
    assert angles.max() <= 5.0
    np.testing.assert_array_equal(walked.stamps_ns, np.arange(len(poses)) * 100_000_000)


def test_poses_are_right_handed_upright_and_look_a_little_down(walked: CameraTrajectory) -> None:
    turn = walked.world_from_camera[:, :3, :3]
    np.testing.assert_allclose(np.linalg.det(turn), 1.0)
    np.testing.assert_allclose(turn @ turn.transpose(0, 2, 1), np.tile(np.eye(3), (len(turn), 1, 1)), atol=1e-12)
    assert (turn[:, 2, 1] < -0.85).all()  # the image's y axis points down
    down = -np.degrees(np.arcsin(turn[:, 2, 2]))
    assert down.min() >= 9.9
    assert down.max() <= 26.1  # on the stairs


def test_the_stairs_are_climbed_without_a_step_back(walked: CameraTrajectory) -> None:
    z = walked.world_from_camera[:, 2, 3]
    between = (z > EYE_M[1] + 0.05) & (z < 2.8 + EYE_M[0] - 0.05)
    assert np.diff(np.flatnonzero(between)).max() == 1  # once, in one go
    assert (np.diff(z[between]) > 0).all()


def test_the_same_seed_gives_the_same_bytes_and_another_one_another_walk(walked: CameraTrajectory) -> None:
    assert camera_trajectory(a_house(), 3).world_from_camera.tobytes() == walked.world_from_camera.tobytes()
    assert camera_trajectory(a_house(), 4).world_from_camera.tobytes() != walked.world_from_camera.tobytes()


def test_another_rate_samples_the_same_way(walked: CameraTrajectory) -> None:
    twice = camera_trajectory(a_house(), 3, rate_hz=20.0)
    np.testing.assert_allclose(
        twice.world_from_camera[::2][: len(walked.stamps_ns)], walked.world_from_camera, atol=1e-9
    )


def test_a_room_that_cannot_be_reached_is_named() -> None:
    with pytest.raises(SourceError, match=r"house 3: the bathroom \(room 1\)"):
        camera_trajectory(a_house(door=False), 3)


def test_a_blocked_flight_is_named() -> None:
    house = a_house()
    far = replace(house.stairs[0], foot=np.array([-3.0, 3.5, 0.0]))
    with pytest.raises(SourceError, match="house 3: the foot of the stairs of floor 0 is blocked"):
        camera_trajectory(replace(house, stairs=(far,)), 3)


def test_a_floor_without_stairs_to_it_is_refused() -> None:
    with pytest.raises(SourceError, match="house 3: no stairs lead from floor 0"):
        camera_trajectory(replace(a_house(), stairs=()), 3)


def test_the_robot_looks_along_its_way_and_around_in_a_large_room(walked: CameraTrajectory) -> None:
    house = a_house()
    ahead = walked.world_from_camera[:, :2, 2] / np.linalg.norm(walked.world_from_camera[:, :2, 2], axis=1)[:, None]
    steps = np.diff(walked.world_from_camera[:, :2, 3], axis=0)
    fast = np.linalg.norm(steps, axis=1) > 0.045
    along = (steps * ahead[:-1]).sum(axis=1)[fast] / np.linalg.norm(steps[fast], axis=1)
    assert np.median(along) > 0.95
    rooms = rooms_of_frames(house, walked.world_from_camera)
    for room in (0, 2):
        headings = np.degrees(np.arctan2(ahead[rooms == room, 1], ahead[rooms == room, 0]))
        assert np.histogram(headings, 6, (-180, 180))[0].min() > 0


def test_a_route_bends_around_what_is_in_the_way() -> None:
    free = np.ones((60, 80), bool)
    free[:45, 40] = False
    made = build_free_space(np.zeros(2), free, 0.05)
    path = route(made, routes_to(made, int(made.cells(np.array([3.5, 0.5]))[0])), np.array([0.5, 0.5]))
    np.testing.assert_allclose(path[[0, -1]], [[0.5, 0.5], [3.525, 0.525]])
    assert path[:, 1].max() > 2.25
    assert (made.clearance(resample(path, 0.005)) > 0).all()
    assert np.linalg.norm(np.diff(path, axis=0), axis=1).sum() < 6.0
