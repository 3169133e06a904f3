from itertools import pairwise

import numpy as np
import pytest

from placegraph.nodes.hierarchy.graph_builder import GraphBuilder, LayerConfig
from placegraph.nodes.hierarchy.traversability import TraversabilityConfig
from placegraph.runtime.scene_graph.route import find_route

STEP = 0.05
TOP = 2.6


def plane(x, y, z):
    axes = [np.arange(v[0] + STEP / 2, v[1], STEP) if isinstance(v, tuple) else np.array([v]) for v in (x, y, z)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def free_in(x, y, base=0.0):
    """Centres of the cells of .1 x .1 x .5 m that rays would cross in a box of plan."""
    axes = [np.arange(low + 0.1, high - 0.09, 0.1) for low, high in (x, y)]
    heights = base + np.array([0.25, 0.75, 1.25, 1.75])
    return np.stack(np.meshgrid(*axes, heights, indexing="ij"), axis=-1).reshape(-1, 3)


def row(rooms, doors, base=0.0):
    """A row of rooms of 4 x 4 m; doors[i] = (y0, y1) in the wall between rooms i and i + 1, 2 m high, None: closed."""
    long, top = 4.0 * rooms, base + TOP
    parts = [plane((0, long), (0, 4), base), plane((0, long), (0, 4), top)]
    parts += [plane((0, long), y, (base, top)) for y in (0.0, 4.0)] + [
        plane(x, (0, 4), (base, top)) for x in (0.0, long)
    ]
    free = [free_in((4.0 * i, 4.0 * i + 4), (0, 4), base) for i in range(rooms)]
    for i, door in enumerate(doors):
        x = 4.0 * (i + 1)
        if door is None:
            parts.append(plane(x, (0, 4), (base, top)))
            continue
        parts += [plane(x, (0, door[0]), (base, top)), plane(x, (door[1], 4), (base, top))]
        parts.append(plane(x, door, (base + 2.0, top)))
        free.append(free_in((x - 0.2, x + 0.2), door, base))
    return np.concatenate(parts), np.concatenate(free)


def build(*maps, traversability=None):
    builder = GraphBuilder(LayerConfig(traversability=traversability or TraversabilityConfig()))
    return [builder.build(world) for world in maps][-1]


WEST = np.array([(x, 2.0, 1.4) for x in np.linspace(1, 3, 9)])  # a walk that stays in the first room
DOOR = (1.5, 2.4)


def room_at_x(graph, x):
    return next(room.id for room in graph.layer("room") if room.box[0, 0] < x < room.box[1, 0])


def test_two_rooms_that_were_seen_and_not_entered_have_their_door(make_map):
    points, free = row(2, [DOOR])
    graph = build(make_map(points, WEST, free=free))
    (door,) = graph.connections.values()
    assert door.id == "C0" and door.kind == "door" and set(door.rooms) == {room_at_x(graph, 1), room_at_x(graph, 7)}
    np.testing.assert_allclose(door.ends, [[4, 1.95, 0]] * 2, atol=0.16)
    assert door.width_m == pytest.approx(0.9, abs=0.15) and door.length_m == 0


def test_a_wide_passage_is_an_opening(make_map):
    points, free = row(2, [(1.0, 3.0)])
    (opening,) = build(make_map(points, WEST, free=free)).connections.values()
    assert opening.kind == "opening" and opening.width_m == pytest.approx(2.0, abs=0.2)


@pytest.mark.parametrize("door", [None, (1.8, 2.2)])
def test_a_closed_door_and_one_too_narrow_for_the_robot_join_nothing(make_map, door):
    points, free = row(2, [door])
    graph = build(make_map(points, WEST, free=free))
    assert len(graph.layer("room")) == 2 and not graph.connections
    assert find_route(graph, *(room.id for room in graph.layer("room"))) is None


def test_a_small_robot_passes_where_a_large_one_does_not(make_map):
    points, free = row(2, [(1.7, 2.3)])
    world = make_map(points, WEST, free=free)
    assert len(build(world, traversability=TraversabilityConfig(robot_radius_m=0.15)).connections) == 1
    assert not build(world, traversability=TraversabilityConfig(robot_radius_m=0.4)).connections


def test_what_was_not_seen_to_be_free_is_not_passable(make_map):
    points, _ = row(2, [DOOR])
    graph = build(make_map(points, WEST))
    assert not graph.connections and all(segment.room == room_at_x(graph, 1) for segment in graph.route_segments)


def test_what_the_camera_crossed_is_passable(make_map, walk):
    points, _ = row(2, [DOOR])
    graph = build(make_map(points, walk(1)))
    (door,) = graph.connections.values()
    assert door.kind == "door" and door.width_m >= 0.5
    np.testing.assert_allclose(door.ends[0], [4, 2, 0], atol=0.16)


def test_a_jump_of_the_camera_is_no_path(make_map):
    points, _ = row(2, [DOOR])
    assert not build(make_map(points, [(1, 2, 1.4), (2, 2, 1.4), (6, 2, 1.4), (7, 2, 1.4)])).connections


def test_a_route_through_three_rooms_cuts_no_wall(make_map):
    points, free = row(3, [(0.5, 1.4), (2.6, 3.5)])
    graph = build(make_map(points, WEST, free=free))
    west, middle, east = (room_at_x(graph, x) for x in (2, 6, 10))
    route = find_route(graph, west, east)
    assert [one for one in route.ids if one[0] == "R"] == [west, middle, east] and len(route.ids) == 5
    (segment,) = [segment for segment in graph.route_segments if segment.room == middle and middle not in segment.ends]
    straight = np.hypot(4.0, 2.1)  # from door to door, all of it free
    assert straight - 0.15 < segment.length_m < straight + 0.3
    for a, b in pairwise(route.points):
        line = a + (b - a) * np.linspace(0, 1, 200)[:, None]
        for x, (low, high) in ((4, (0.5, 1.4)), (8, (2.6, 3.5))):
            through = line[np.abs(line[:, 0] - x) < 0.05, 1]
            assert ((through > low + 0.2) & (through < high - 0.2)).all()
    steps = np.linalg.norm(np.diff(route.points, axis=0), axis=1).sum()
    assert route.length_m == pytest.approx(steps, abs=1e-6) and not route.straight


def test_furniture_makes_the_way_longer_and_a_barrier_parts_a_room(make_map):
    points, free = row(1, [])
    for length, reachable in ((3.0, True), (4.0, False)):
        barrier = np.concatenate([plane(2.0, (0, length), (0, 1.0)), plane(2.05, (0, length), (0, 1.0))])
        objects = {1: ("ball", (3.0, 0.6, 0.0), (3.3, 0.9, 0.3))}
        world = make_map(np.concatenate([points, barrier]), [(1, 0.8, 1.4), (1.1, 0.8, 1.4)], objects, free=free)
        thing = build(world).nodes["O1"]
        assert thing.approach is not None and len(thing.approach.travel_m) == reachable
        if reachable:
            assert thing.approach.position[0] > 2.2


def test_stairs_join_the_floors_where_the_camera_climbed(make_map):
    lower, free_lower = row(1, [])
    upper, free_upper = row(1, [], base=3.0)
    climb = [(1 + 0.25 * i, 2.0, 1.4 + 0.3 * i) for i in range(11)]
    path = [*[(x, 1.0, 1.4) for x in np.linspace(3, 1, 9)], (1, 1.5, 1.4), *climb, (3.5, 2.5, 4.4), (3.5, 3, 4.4)]
    world = make_map(np.concatenate([lower, upper]), path, free=np.concatenate([free_lower, free_upper]))
    graph = build(world)
    (stairs,) = graph.connections.values()
    assert stairs.kind == "stairs"
    assert [graph.nodes[room].parent for room in stairs.rooms] == [floor.id for floor in graph.layer("floor")]
    np.testing.assert_allclose(stairs.ends, [[1, 2, 0], [3.5, 2, 3]], atol=0.4)
    assert stairs.length_m == pytest.approx(np.hypot(2.5, 3.0), abs=0.6) and stairs.width_m >= 0.5
    route = find_route(graph, *stairs.rooms[::-1])
    assert route.ids == (stairs.rooms[1], stairs.id, stairs.rooms[0]) and route.length_m > stairs.length_m


def test_a_fall_of_the_ground_is_no_floor(make_map):
    """A hole beside the camera, through which the treads below are seen, is not filled as its blind spot is."""
    points, free = row(1, [])
    hole = (np.abs(points[:, 0] - 2.5) < 0.8) & (np.abs(points[:, 1] - 2) < 0.8) & (points[:, 2] == 0)
    blind = (np.abs(points[:, 0] - 0.8) < 0.5) & (np.abs(points[:, 1] - 2) < 0.5) & (points[:, 2] == 0)
    treads = np.concatenate([plane((1.7, 3.3), (1.2, 2.8), z) for z in (-0.4, -0.6)])
    things = {1: ("ball", (2.4, 1.9, 0.0), (2.6, 2.1, 0.2)), 2: ("cup", (0.7, 1.9, 0.0), (0.9, 2.1, 0.2))}
    standing = [(0.9, y, 1.4) for y in (1.0, 1.5, 2.0, 2.5)]
    cloud = np.concatenate([points[~hole & ~blind], treads])
    graph = build(make_map(cloud, standing, things, free=free))
    ball, cup = graph.nodes["O1"].approach, graph.nodes["O2"].approach
    assert cup is not None and np.hypot(cup.position[0] - 0.8, cup.position[1] - 2) < 0.6
    assert ball is None or max(abs(ball.position[0] - 2.5), abs(ball.position[1] - 2)) > 0.8


def test_ids_stay_and_unchanged_rooms_are_not_computed_again(make_map, monkeypatch):
    points, free = row(3, [(0.5, 1.4), (2.6, 3.5)])
    first = make_map(points[points[:, 0] < 8.02], WEST, free=free[free[:, 0] < 8])
    whole = make_map(points, WEST, free=free, revision=1)
    graph = build(first, whole)
    east = [one.id for one in graph.connections.values() if one.ends[0, 0] > 6]
    assert list(graph.connections) == ["C0", "C1"] and east == ["C1"]
    builder = GraphBuilder(LayerConfig())
    whole = make_map(points, WEST, {1: ("ball", (6, 2, 0), (6.3, 2.3, 0.3))}, free=free)
    before = builder.build(whole).to_json()
    for name in ("shortest_paths", "compute_traversability", "find_openings", "find_approach"):
        monkeypatch.setattr(f"placegraph.nodes.hierarchy.place_graph_builder.{name}", None)  # calling it would fail
    assert builder.build(whole).to_json() == before


def test_the_same_maps_give_the_same_bytes(make_map):
    points, free = row(3, [(0.5, 1.4), (2.6, 3.5)])
    world = make_map(points, WEST, {1: ("ball", (6, 2, 0), (6.3, 2.3, 0.3))}, free=free)
    assert build(world).to_json() == build(world).to_json()
