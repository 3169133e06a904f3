from placegraph.nodes.grounding.llm import LanguageModel
from placegraph.nodes.grounding.naming import LOCATION_TYPES, ROOM_TYPES, Namer, evidence_of
from placegraph.runtime.scene_graph import SceneGraph


def test_an_empty_room_gets_no_name_and_asks_nothing(node_of, thing_of):
    graph = SceneGraph.of([
        node_of("B0", "", "building", (0, 0, 0), (1, 1, 1)),
        node_of("F0", "B0", "floor 1", (0, 0, 0), (1, 1, 1)),
        node_of("R0", "F0", "", (0, 0, 0), (1, 1, 1)),
        node_of("R1", "F0", "", (0, 0, 0), (1, 1, 1)),
        thing_of(0, "R1", "", (0, 0, 0), (1, 1, 1)),
    ])  # fmt: skip
    model = LanguageModel()
    assert Namer(model, ROOM_TYPES, LOCATION_TYPES).name_places(graph) == []
    assert model.calls == 0


def test_evidence_counts_strongest_tags_below_the_room_and_its_locations(house):
    assert evidence_of(house, house.nodes["R0"]) == (
        ("chair", 4),
        ("cup", 2),
        ("fridge", 1),
        ("table", 1),
        ("window", 1),
    )


def test_equal_evidence_is_asked_once():
    model = LanguageModel()
    namer = Namer(model, ("kitchen", "bedroom"), LOCATION_TYPES)
    first = namer.names("room", (("bed", 1), ("lamp", 2)))
    asked = model.calls
    assert namer.names("room", (("bed", 1), ("lamp", 2))) == first
    assert model.calls == asked
    assert first[0][0] == "bedroom"
    model.close()
