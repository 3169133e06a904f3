import numpy as np

from placegraph.nodes.grounding.box_arrays import RoomPart, concatenate, layout_of
from placegraph.runtime.scene_graph import SceneGraph


def test_a_building_alone_has_no_things_and_is_the_room_of_all(node_of):
    layout = layout_of(SceneGraph.of([node_of("B0", "", "", (0, 0, 0), (4, 2, 3))]))
    assert (len(layout.all), layout.rooms, layout.room_center(np.array([-1])).tolist()) == (0, (), [[2.0, 1.0]])
    assert [str(label) for label in layout.room_parts(RoomPart.WALL).labels] == ["a wall of room B0"] * 4


def test_rows_are_objects_then_places(house):
    layout = layout_of(house)
    assert layout.all.ids[:2] == ("O0", "O1")
    assert str(layout.all.labels[layout.row["O9"]]) == "sofa O9"
    assert layout.all.room[layout.row["O9"]] == layout.all.room[layout.row["R1"]]
    assert [layout.all.ids[i] for i in layout.places] == ["F0", "F1", "R0", "R1", "R2", "L0"]
    assert layout.all.is_place.sum() == 6
    assert layout.all.room[layout.row["F0"]] == -1


def test_what_rooms_consist_of(house):
    layout = layout_of(house)
    assert [len(layout.room_parts(kind)) for kind in RoomPart] == [3, 3, 3, 12, 12, 3]
    floor, wall, corner = map(layout.room_parts, (RoomPart.FLOOR, RoomPart.WALL, RoomPart.CORNER))
    assert floor.high[2].tolist() == [4, 4, 2.8]
    assert wall.high[0, 0] == 0 and wall.low[1, 0] == 4
    assert corner.size[0].tolist() == [0.01, 0.01, 2.5]
    assert not any(wall.ids)


def test_some_and_all_of_several(house):
    things = layout_of(house).all
    both = concatenate([things.take([1]), things.take([0, 2])])
    assert both.ids == ("O1", "O0", "O2")
    assert np.array_equal(both.center, things.center[[1, 0, 2]])
    assert len(things.take([])) == 0
