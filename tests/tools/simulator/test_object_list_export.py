from placegraph.runtime.scene_graph.object_list import parse_object_list
from placegraph.runtime.scene_graph.object_list_import import graph_from_object_list
from placegraph.tools.simulator.house_frames import generate_house
from placegraph.tools.simulator.object_list_export import object_list


def test_a_house_as_a_list_is_that_house() -> None:
    house = generate_house(0, 2)
    scene = graph_from_object_list(parse_object_list(object_list(house), "house"), "house")
    graph = scene.graph
    assert len(graph.layer("object")) == len(house.items) and len(graph.layer("room")) == len(house.rooms)
    for placed in house.items:
        node = graph.nodes[f"O{placed.id}"]
        assert scene.ids[node.id] == placed.id and node.name == placed.item.name
        assert abs(node.box - placed.box).max() < 1e-3
        floor, room = (scene.ids[step.id] for step in graph.path(node.id)[1:3])
        assert (room, floor) == (placed.room, house.rooms[placed.room].floor)
    colored = next(placed for placed in house.items if placed.item.color_name)
    assert colored.item.color_name.split()[-1] in graph.nodes[f"O{colored.id}"].tags[1].name
