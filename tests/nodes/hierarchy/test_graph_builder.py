import dataclasses

import numpy as np
import pytest

from placegraph.nodes.hierarchy import graph_builder as build_module
from placegraph.nodes.hierarchy.graph_builder import GraphBuilder, LayerConfig
from placegraph.runtime.errors import SchemaError

OBJECTS = {
    3: ("table", (1.0, 1.0, 0.0), (2.2, 1.8, 0.75)),
    7: ("chair", (2.4, 1.0, 0.0), (2.9, 1.5, 0.9)),
    4: ("bed", (5.0, 0.5, 3.0), (7.0, 2.0, 3.5)),
    9: ("lamp", (1.0, 3.2, 3.0), (1.3, 3.5, 4.5)),
}
EMPTY = np.zeros((0, 3))


def build(*maps):
    builder = GraphBuilder(LayerConfig())
    return [builder.build(world) for world in maps][-1]


def test_an_empty_map_is_a_building_alone(make_map):
    assert list(build(make_map(EMPTY, EMPTY)).nodes) == ["B0"]


def test_one_point_is_a_floor_with_a_room(make_map):
    graph = build(make_map(np.array([[1.0, 2, 3]]), EMPTY))
    assert list(graph.nodes) == ["B0", "F0", "R0"]
    assert graph.nodes["R0"].parent == "F0" and graph.nodes["F0"].name == "floor 1" and graph.nodes["R0"].tags == ()


def test_points_that_are_not_finite_are_refused(make_map):
    world = make_map(np.zeros((4, 3)), EMPTY)
    points = world.points_world.copy()
    points[2, 1] = np.nan
    with pytest.raises(SchemaError, match=r"Map 0: points_world\[2\] is not finite"):
        build(dataclasses.replace(world, points_world=points))


def test_an_object_without_points_is_refused(make_map):
    world = make_map(np.zeros((4, 3)), EMPTY, {5: ("cup", (0, 0, 0), (0.1, 0.1, 0.1))})
    empty = dataclasses.replace(
        world, object_points_world=np.zeros((0, 3), np.float32), object_point_offsets=np.zeros(2, np.int64)
    )
    with pytest.raises(SchemaError, match="object 5 has no points"):
        build(empty)


def test_two_floors_of_two_rooms_with_their_objects(make_map, house_points, walk):
    graph = build(make_map(house_points(2), walk(2), OBJECTS))
    assert [node.name for node in graph.layer("floor")] == ["floor 1", "floor 2"]
    assert [room.parent for room in graph.layer("room")] == ["F0", "F0", "F1", "F1"]
    assert [node.id for node in graph.descendants("F0", "object")] == ["O3", "O7"]
    assert [node.id for node in graph.descendants("F1", "object")] == ["O4", "O9"]
    rooms = {node.id: graph.nodes[[p.id for p in graph.path(node.id)][2]] for node in graph.layer("object")}
    assert rooms["O3"] is rooms["O7"] and rooms["O4"] is not rooms["O9"]
    assert rooms["O4"].center[0] > 4 > rooms["O9"].center[0]
    for node_id, room in rooms.items():
        assert (room.box[0, :2] <= graph.nodes[node_id].center[:2]).all()
        assert (graph.nodes[node_id].center[:2] <= room.box[1, :2]).all()


def test_table_and_chair_are_a_location_and_the_bed_hangs_from_its_room(make_map, house_points, walk):
    graph = build(make_map(house_points(2), walk(2), OBJECTS))
    (location,) = graph.layer("location")
    assert [node.id for node in graph.children(location.id)] == ["O3", "O7"]
    assert graph.nodes[graph.nodes["O4"].parent].layer == "room"
    assert np.allclose(location.box, [[1, 1, 0], [2.9, 1.8, 0.9]], atol=0.06)
    assert (location.first_frame, location.last_frame) == (0, 11)
    assert graph.building.first_frame == 0 and graph.building.last_frame == 13


def test_an_object_outside_every_room_hangs_from_the_nearest(make_map, house_points, walk):
    near_east = {1: ("car", (8.6, 1.0, 0.0), (9.4, 2.0, 0.5))}
    world = make_map(house_points(1), walk(1), near_east)
    world = dataclasses.replace(
        world,
        points_world=house_points(1).astype(np.float32),
        point_colors=np.zeros((len(house_points(1)), 3), np.uint8),
    )
    graph = build(world)
    assert graph.nodes[graph.nodes["O1"].parent].center[0] > 4


def test_object_nodes_carry_what_fusion_knows(make_map, house_points, walk):
    bed = build(make_map(house_points(2), walk(2), OBJECTS)).nodes["O4"]
    assert bed.name == "bed" and bed.tags[0].weight == 2.0 and bed.observations == 4
    assert (bed.first_frame, bed.last_frame) == (2, 12) and bed.color == (9, 9, 9)
    assert len(bed.oriented_box) == 7 and len(bed.footprint) >= 4


def test_a_lower_floor_found_later_takes_the_name_and_not_the_id(make_map, house_points, walk):
    upper = house_points(2)
    upper = upper[upper[:, 2] > 2.8]
    path = walk(2)
    first = make_map(upper, path[path[:, 2] > 4])
    graph = build(first, make_map(house_points(2), path, revision=1))
    assert {node.id: node.name for node in graph.layer("floor")} == {"F0": "floor 2", "F1": "floor 1"}
    assert graph.nodes["F1"].center[2] < graph.nodes["F0"].center[2]


def test_ids_stay_while_a_floor_is_explored(make_map, house_points, walk):
    points = house_points(1)
    west = make_map(points[points[:, 0] < 4.02], walk(1)[:7])
    graph = build(west, make_map(points, walk(1), revision=1))
    assert graph.nodes["R0"].center[0] < 4 < graph.nodes["R1"].center[0]


def test_the_same_maps_give_the_same_bytes(make_map, house_points, walk):
    maps = [make_map(house_points(n), walk(n), OBJECTS if n == 2 else {}) for n in (1, 2)]
    assert build(*maps).to_json() == build(*maps).to_json()


def test_a_floor_without_any_wall_still_has_a_room(make_map):
    x, y = np.meshgrid(np.arange(0, 3, 0.05), np.arange(0, 3, 0.05))
    lawn = np.stack((x.ravel(), y.ravel(), 0 * x.ravel()), axis=1)
    graph = build(make_map(lawn, [[1, 1, 1.5]]))
    assert len(graph.layer("room")) == 1


def growing_maps(make_map, house_points, walk):
    """A house that is explored: upper floor added, an object added, an object moved, nothing, a wall point added."""
    late = OBJECTS | {11: ("chair", (5.0, 2.2, 3.0), (5.5, 2.7, 3.9))}
    moved = late | {7: ("chair", (6.4, 1.0, 0.0), (6.9, 1.5, 0.9))}
    low, both = house_points(1), house_points(2)
    more = np.concatenate((both, [[4.0, 1.0, 1.0]]))
    below = {number: OBJECTS[number] for number in (3, 7)}
    parts = [(low, walk(1), below), (both, walk(2), OBJECTS), (both, walk(2), late), (both, walk(2), moved)]
    parts += [(both, walk(2), moved), (more, walk(2), moved)]
    return [make_map(*part, revision=i) for i, part in enumerate(parts)]


def test_what_is_remembered_makes_no_difference(make_map, house_points, walk):
    maps = growing_maps(make_map, house_points, walk)
    remembering, forgetting = GraphBuilder(LayerConfig()), GraphBuilder(LayerConfig())
    for world in maps:
        for memo in (forgetting._room_memo, forgetting._location_memo, forgetting._footprint_memo):
            memo.end_build()
            memo.end_build()
        assert remembering.build(world).to_json() == forgetting.build(world).to_json()


def test_only_what_changed_is_made_again(make_map, house_points, walk, monkeypatch):
    made = []
    for name in ("find_rooms", "find_locations"):
        real = getattr(build_module, name)
        monkeypatch.setattr(build_module, name, lambda *a, name=name, real=real: made.append(name) or real(*a))
    builder, counts = GraphBuilder(LayerConfig()), []
    for world in growing_maps(make_map, house_points, walk):
        made.clear()
        builder.build(world)
        counts.append((made.count("find_rooms"), made.count("find_locations")))
    # a move empties one room's place and fills another's; the boxes of objects are points of the cloud here
    assert counts[3:] == [(1, 2), (0, 0), (1, 0)]
