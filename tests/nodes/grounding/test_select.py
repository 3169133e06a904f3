import pytest

from placegraph.nodes.grounding.program import Program, Thing
from placegraph.nodes.grounding.select import floors_called, narrow
from placegraph.runtime.scene_graph import SceneGraph


def ids(nodes):
    return [node.id for node in nodes]


def test_a_map_with_nothing_in_it(names, node_of):
    graph = SceneGraph.of([node_of("B0", "", "building", (0, 0, 0), (1, 1, 1))])
    scope = narrow(graph, Program(target=Thing(noun="cup"), room="kitchen", floor="upstairs"), names)
    assert (scope.objects, scope.sure) == ([], False)
    assert floors_called(graph, "first floor") == []


@pytest.mark.parametrize(
    ("words", "expected"),
    [("upstairs", ["F1"]), ("downstairs", ["F0"]), ("first floor", ["F0"]), ("second floor", ["F1"]),
     ("top floor", ["F1"]),     ("ground floor", ["F0"]), ("floor 2", ["F1"]), ("third floor", []), ("floor 7", [])],
)  # fmt: skip
def test_floors(house, words, expected):
    assert ids(floors_called(house, words)) == expected


def test_rooms_locations_and_outside(names, house):
    def found(**place):
        return ids(narrow(house, Program(target=Thing(), **place), names).objects)

    assert found(room="bedroom") == ["O15", "O16", "O17", "O18", "O19", "O20"]
    assert found(room="dining area") == ["O0", "O1", "O2", "O3", "O4", "O5", "O6"]
    assert found(room="bedroom", floor="second floor") == found(floor="second floor")
    assert found(room="bathroom") == found()
    assert "O15" not in found(room="bedroom", outside=True)
    assert found(room="lounge") == found(room="living room")


def test_an_unknown_place_is_said_and_leaves_doubt(names, house):
    scope = narrow(house, Program(target=Thing(), room="stable"), names)
    assert not scope.sure
    assert len(scope.objects) == 25
    assert "stable" in scope.notes[0]


def test_a_floor_that_is_not_there_is_said_in_words(names, house, node_of):
    building, floor = node_of("B0", "", "building", (0, 0, 0), (1, 1, 1)), node_of("F0", "B0", "", (0, 0, 0), (1, 1, 1))
    looked = [
        narrow(graph, Program(target=Thing(), floor="third floor"), names).notes[0].split("; ")[1]
        for graph in (SceneGraph.of([building]), SceneGraph.of([building, floor]), house)
    ]
    assert looked == ["looked everywhere", "looked on its only floor", "looked on all 2 floors"]
