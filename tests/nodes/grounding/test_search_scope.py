import numpy as np
import pytest

from placegraph.nodes.grounding.program import Thing
from placegraph.nodes.grounding.program_executor import ProgramExecutor
from placegraph.nodes.grounding.program_syntax import format_program, parse_program
from placegraph.nodes.grounding.search_scope import match_floors
from placegraph.runtime.scene_graph import SceneGraph


def ids(nodes):
    return [node.id for node in nodes]


def narrowed(graph, names, text):
    return ProgramExecutor(graph, names, np.full(3, np.nan)).scope(parse_program(text))


def test_a_map_with_nothing_in_it(names, node_of):
    graph = SceneGraph.of([node_of("B0", "", "building", (0, 0, 0), (1, 1, 1))])
    scope = narrowed(graph, names, "cup; room (kitchen); floor (upstairs)")
    assert (scope.objects, scope.sure) == ([], False)
    assert match_floors(graph, "first floor") == []


@pytest.mark.parametrize(
    ("words", "expected"),
    [("upstairs", ["F1"]), ("downstairs", ["F0"]), ("first floor", ["F0"]), ("second floor", ["F1"]),
     ("top floor", ["F1"]),
     ("on the upper level", ["F1"]), ("f1", ["F1"]), ("basement", ["F0"]),
     ("ground floor", ["F0"]), ("floor 2", ["F1"]), ("third floor", []), ("floor 7", [])],
)  # fmt: skip
def test_floors(house, words, expected):
    assert ids(match_floors(house, words)) == expected


def test_rooms_locations_and_outside(names, house):
    def found(text):
        return ids(narrowed(house, names, f"thing; {text}").objects)

    assert found("room (bedroom)") == ["O15", "O16", "O17", "O18", "O19", "O20"]
    assert found("room (dining area)") == ["O0", "O1", "O2", "O3", "O4", "O5", "O6"]
    assert found("room (bedroom); floor (second floor)") == found("floor (second floor)")
    assert found("room (garage)") == found("near (bed)")
    assert "O15" not in found("not room (bedroom)")
    assert found("room (lounge)") == found("room (living room)") == found("in (living room)")
    assert found("room (r2)") == found("room (bedroom)")


def test_a_room_is_told_by_what_it_holds_its_floor_and_its_order(names, node_of, thing_of):
    rooms = [node_of(f"R{i}", f"F{i // 2}", "bedroom", (5 * i, 0, 0), (5 * i + 4 + i, 4, 2.5)) for i in range(4)]
    floors = [node_of("F0", "B0", "floor 1", (0, 0, 0), (20, 4, 2.5)), node_of("F1", "B0", "", (0, 0, 3), (20, 4, 5))]
    things = [thing_of(i, f"R{i}", "bed", (5 * i + 2, 2, 0.3), (1, 2, 0.5)) for i in range(4)]
    things += [thing_of(4, "R2", "desk", (11, 1, 0.4), (1, 0.5, 0.8))]
    graph = SceneGraph.of([node_of("B0", "", "", (0, 0, 0), (25, 4, 5)), *floors, *rooms, *things])

    def beds(room):
        return [i for i in ids(narrowed(graph, names, f"bed; {room}").objects) if i != "O4"]

    assert beds("room (bedroom)") == ["O0", "O1", "O2", "O3"]
    assert beds("room (bedroom; with (desk))") == ["O2"]
    assert beds("room (bedroom; nth 2)") == ["O1"]
    assert beds("room (bedroom; floor (upstairs); nth 2)") == ["O3"]
    assert beds("room (bedroom; largest)") == ["O3"]
    assert beds("room (bedroom; smallest); floor (second floor)") == ["O2"]


def test_a_thing_that_one_can_be_in_is_left_to_geometry(names, house):
    for text in ("cup; room (fridge)", "cup; in (fridge)"):
        assert format_program(narrowed(house, names, text).thing) == "cup; in (fridge)"


def test_a_room_without_a_node_is_where_its_typical_things_are(names, room_of):
    graph = room_of(("toilet", (1, 1, 0.4), (0.4, 0.6, 0.8)), ("bed", (5, 4, 0.3), (2, 2, 0.6)))
    scope = narrowed(graph, names, "mirror; not room (bathroom)")
    assert format_program(Thing(noun="mirror", conditions=tuple(scope.hints))) == "mirror; not near (toilet)"
    assert format_program(scope.thing) == "mirror"
    assert (scope.sure, len(scope.objects)) == (False, 2)
    assert "toilet" in scope.notes[0]


def test_an_unknown_place_is_said_and_leaves_doubt(names, house):
    scope = narrowed(house, names, "cup; room (stable)")
    assert not scope.sure
    assert len(scope.objects) == 25
    assert "stable" in scope.notes[0]


def test_a_floor_that_is_not_there_is_said_in_words(names, house, node_of):
    building, floor = node_of("B0", "", "building", (0, 0, 0), (1, 1, 1)), node_of("F0", "B0", "", (0, 0, 0), (1, 1, 1))
    looked = [
        narrowed(graph, names, "cup; floor (third floor)").notes[0].split("; ")[1]
        for graph in (SceneGraph.of([building]), SceneGraph.of([building, floor]), house)
    ]
    assert looked == ["looked everywhere", "looked on its only floor", "looked on all 2 floors"]
