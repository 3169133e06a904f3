"""Frames that show little, or show it oddly, through the real fusion and hierarchy nodes."""

import itertools

import numpy as np
import pytest

from placegraph.nodes.fusion import NODE as FUSION
from placegraph.nodes.hierarchy import NODE as HIERARCHY
from placegraph.nodes.pose.gravity import estimate_up
from placegraph.runtime.messages import Keyframe, LastKeyframe, Segments
from placegraph.runtime.node import Context
from placegraph.runtime.scene_graph import SceneGraph
from placegraph.runtime.vision.geometry import backproject

SIZE, FOCAL = (48, 64), 40.0
INTRINSICS = np.array([FOCAL, FOCAL, 31.5, 23.5])
GROUND = [((0, 0, -0.1), (6, 4, 0))]
WALLS = [
    ((-0.1, 0, 0), (0, 4, 2.6)),
    ((6, 0, 0), (6.1, 4, 2.6)),
    ((0, -0.1, 0), (6, 0, 2.6)),
    ((0, 4, 0), (6, 4.1, 2.6)),
]
CEILING = [((0, 0, 2.6), (6, 4, 2.7))]
STAIRS = [((0.3 * i, 0, 0), (0.3 * i + 0.3, 1, 0.18 * (i + 1))) for i in range(16)]
UPRIGHT, STILL = np.eye(3), np.eye(4)
UPSIDE_DOWN = np.diag([-1.0, -1, 1])


def pose(eye, yaw, pitch=0.35, roll=UPRIGHT):
    """A camera at eye (m) that looks along yaw, down by pitch (rad)."""
    forward = np.array([np.cos(yaw) * np.cos(pitch), np.sin(yaw) * np.cos(pitch), -np.sin(pitch)])
    right = np.array([np.sin(yaw), -np.cos(yaw), 0])
    made = np.eye(4)
    made[:3, :3] = np.stack((right, np.cross(forward, right), forward), axis=1) @ roll
    made[:3, 3] = eye
    return made


def depth_of(boxes, world_from_camera):
    """Depth (H, W) in mm by the slab method: the first of the boxes that each ray meets."""
    v, u = np.indices(SIZE)
    rays = np.stack(((u - 31.5) / FOCAL, (v - 23.5) / FOCAL, np.ones(SIZE)), axis=-1) @ world_from_camera[:3, :3].T
    nearest = np.full(SIZE, np.inf)
    with np.errstate(divide="ignore", invalid="ignore"):
        for low, high in boxes:
            a, b = ((np.array(side) - world_from_camera[:3, 3]) / rays for side in (low, high))
            enter, leave = np.minimum(a, b).max(axis=-1), np.maximum(a, b).min(axis=-1)
            nearest = np.where((enter < leave) & (enter > 0.1), np.minimum(nearest, enter), nearest)
    return np.where(np.isfinite(nearest), nearest * 1000, 0).astype(np.uint16)


def mapped(boxes, poses, turn=STILL, map_every=1000):
    """The last graph of frames of these boxes; `turn` moves the world that the poses are told in."""
    fusion, hierarchy = (
        FUSION(FUSION.config_type(stride=1, map_every_keyframes=map_every), Context()),
        HIERARCHY(HIERARCHY.config_type(), Context()),
    )
    graphs = []

    def feed(message):
        for world in fusion.step(message):
            graphs.extend(hierarchy.step(world))

    for i, at in enumerate(poses):
        stamp = {"frame_id": i, "stamp_ns": i}
        color = np.zeros((*SIZE, 3), np.uint8)
        feed(
            Keyframe(
                **stamp,
                color=color,
                depth=depth_of(boxes, at),
                depth_unit_m=0.001,
                intrinsics=INTRINSICS,
                world_from_camera=turn @ at,
            )
        )
        bits, offsets = Segments.pack([])
        nothing = {"names": (), "scores": np.zeros(0, np.float32), "boxes_px": np.zeros((0, 4), np.int32)}
        feed(Segments(**stamp, **nothing, mask_bits=bits, mask_offsets=offsets))
    feed(LastKeyframe(frame_id=len(poses) - 1, stamp_ns=len(poses), keyframes=len(poses)))
    graph = SceneGraph.from_json(graphs[-1].json)  # checks its invariants
    return graph, [graph.layer(layer) for layer in ("floor", "room")]


def around(height=1.4, roll=UPRIGHT, pitches=(0.35, -0.4)):
    spots = itertools.product(((1.5, 2.0), (4.5, 2.0)), np.arange(0, 2 * np.pi, np.pi / 4), pitches)
    return [pose((*xy, height), yaw, pitch, roll) for xy, yaw, pitch in spots]


def turned(axis, angle):
    made, (c, s) = np.eye(4), (np.cos(angle), np.sin(angle))
    i, j = [k for k in range(3) if k != axis]
    made[i, i], made[j, j], made[i, j], made[j, i] = c, c, -s, s
    return made


def assert_one_room(floors, rooms, low=0.0):
    (floor,), (room,) = floors, rooms
    assert floor.name == "floor 1" and floor.box[0, 2] == pytest.approx(low, abs=0.1)
    assert room.box[:, :2] == pytest.approx(np.array([[0, 0], [6, 4]]), abs=0.35)


def test_one_floor_only():
    _, (floors, rooms) = mapped(GROUND + WALLS + CEILING, around())
    assert_one_room(floors, rooms)
    assert floors[0].box[1, 2] == pytest.approx(2.6, abs=0.1)


def test_no_ceiling_seen():
    _, (floors, rooms) = mapped(GROUND + WALLS, around())
    assert_one_room(floors, rooms)
    assert 1.5 < floors[0].box[1, 2] <= 2.65


def test_one_plane_alone():
    _, (floors, rooms) = mapped(GROUND, around(pitches=(0.7,)))
    assert_one_room(floors, rooms)


@pytest.mark.parametrize("poses", [[], [pose((0, 0, 1.4), 0)]])
def test_no_frame_and_no_depth_at_all(poses):
    graph, _ = mapped([], poses)
    assert list(graph.nodes) == ["B0"]


def test_stairs_only():
    climb = [pose((x - 1, 0.5, 0.6 * max(x, 0) + 1.4), 0.0, 0.5) for x in np.arange(0, 4.8, 0.3)]
    _, (floors, rooms) = mapped(STAIRS, climb)
    assert len(floors) in (1, 2) and floors[0].box[0, 2] == pytest.approx(0.2, abs=0.2)  # one of the first steps
    assert len(rooms) == len(floors)


def test_a_camera_upside_down_whose_poses_say_so_maps_the_same():
    upright, _ = mapped(GROUND + WALLS + CEILING, around())
    turned_over, (floors, rooms) = mapped(GROUND + WALLS + CEILING, around(roll=UPSIDE_DOWN))
    assert_one_room(floors, rooms)
    assert list(turned_over.nodes) == list(upright.nodes)


def test_a_world_that_stands_on_its_head_still_has_its_room():
    turn = turned(0, np.pi)  # what the pose node gives when nothing tells it that the camera hangs
    turn[:3, 3] = (0, 4, 2.6)
    _, (floors, rooms) = mapped(GROUND + WALLS + CEILING, around(), turn)
    assert_one_room(floors, rooms)


@pytest.mark.parametrize("known", [True, False])
def test_which_way_is_up_for_an_upside_down_camera(known):
    camera = pose((1.5, 2, 1.4), 0.0, 0.35, UPSIDE_DOWN)
    cloud = backproject(depth_of(GROUND + WALLS, camera) * np.float32(0.001), INTRINSICS, 1)
    up = camera[:3, :3].T @ (0.0, 0, 1)
    found = estimate_up([(np.eye(4), up if known else np.full(3, np.nan), cloud)], 0)
    # a level plane says which axis is vertical and never which end of it is up: that takes the source or the IMU
    assert abs(float(found.up @ up)) == pytest.approx(1, abs=0.02) and (found.up @ up > 0) == known


@pytest.mark.parametrize(("degrees", "most"), [(3, 1), (8, 1), (20, 2)])
def test_a_slanted_floor_is_one_floor_until_it_climbs_a_storey(degrees, most):
    _, (floors, rooms) = mapped(GROUND + WALLS + CEILING, around(), turned(1, np.deg2rad(degrees)))
    assert 1 <= len(floors) <= most and len(floors) <= len(rooms) <= 3


def test_split_levels_are_one_floor_and_a_storey_is_another():
    steps = [((3, 0, -0.1), (6, 4, 0.6))]
    raised = [pose((4.5, 2, 2.0), yaw) for yaw in np.arange(0, 6, 0.8)]
    _, (floors, _) = mapped(GROUND + WALLS + steps, around()[:8] + raised)
    assert len(floors) == 1
    upstairs = [((low[0], low[1], low[2] + 2.9), (high[0], high[1], high[2] + 2.9)) for low, high in GROUND + WALLS]
    _, (floors, _) = mapped(GROUND + WALLS + upstairs, around() + around(4.3))
    assert [floor.name for floor in floors] == ["floor 1", "floor 2"]


def test_a_floor_found_below_takes_the_lowest_name_and_ids_stay():
    upstairs = [((low[0], low[1], low[2] - 2.9), (high[0], high[1], high[2] - 2.9)) for low, high in GROUND + WALLS]
    _, (floors, rooms) = mapped(GROUND + WALLS + upstairs, around() + around(-1.5), map_every=len(around()))
    assert {floor.id: floor.name for floor in floors} == {"F0": "floor 2", "F1": "floor 1"}
    assert next(room.id for room in rooms if room.parent == "F0") == "R0"
