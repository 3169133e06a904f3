from placegraph.nodes.naming.place_contents import PlaceContents, place_contents


def test_an_empty_room_contains_nothing(graph_of):
    graph = graph_of({"B0": "", "F0": "B0", "R0": "F0"}, {"R0": [""]})
    assert place_contents(graph, graph.nodes["R0"]) == PlaceContents(())


def test_the_objects_of_a_rooms_locations_are_in_the_room(house):
    objects = (("chair", 4), ("cup", 2), ("fridge", 1), ("table", 1), ("window", 1))
    assert place_contents(house, house.nodes["R0"]) == PlaceContents(objects)
    assert place_contents(house, house.nodes["L0"]).objects == (("chair", 4), ("cup", 2), ("table", 1))


def test_names_are_in_their_normal_form(graph_of):
    graph = graph_of({"B0": "", "F0": "B0", "R0": "F0"}, {"R0": ["Coffee Tables", "coffee-table"]})
    assert place_contents(graph, graph.nodes["R0"]).objects == (("coffee table", 2),)
