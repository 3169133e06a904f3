import numpy as np
import pytest

from placegraph.nodes.grounding.program import Program
from placegraph.nodes.grounding.program_executor import ProgramExecutor
from placegraph.nodes.grounding.program_syntax import parse_program
from placegraph.runtime.scene_graph import SceneGraph

NOWHERE = np.full(3, np.nan)


def ranking_of(graph, names, text, asker=NOWHERE, heading=np.nan):
    return ProgramExecutor(graph, names, asker, heading).rank(Program(target=parse_program(text)))


def best(graph, names, text, **kwargs):
    candidates = ranking_of(graph, names, text, **kwargs).candidates
    return candidates[0].node.id if candidates else None


@pytest.fixture(scope="module")
def office(request):
    """A room of 6 x 4 m as data sets of boxes give it: names and boxes, no colours, no rooms, no viewer.

    x to the east, y to the north; three windows in the north wall, the door in the south wall.
    """
    made = request.getfixturevalue("room_of")
    return made(
        ("door", (0.6, 0.0, 1.0), (0.9, 0.1, 2.0)),
        ("window", (1.0, 4.0, 1.5), (1.0, 0.1, 1.0)),
        ("window", (3.0, 4.0, 1.5), (1.0, 0.1, 1.0)),
        ("window", (5.0, 4.0, 1.5), (1.0, 0.1, 1.0)),
        ("desk", (1.0, 3.4, 0.4), (1.6, 0.8, 0.8)),  # O4
        ("desk", (5.0, 3.4, 0.4), (1.6, 0.8, 0.8)),  # O5
        ("monitor", (0.7, 3.5, 1.0), (0.5, 0.2, 0.4)),  # O6
        ("monitor", (4.8, 3.5, 1.0), (0.5, 0.2, 0.4)),  # O7
        ("monitor", (5.4, 3.5, 1.0), (0.5, 0.2, 0.4)),  # O8
        ("trash can", (1.2, 3.4, 0.2), (0.3, 0.3, 0.4)),  # O9: under the desk
        ("trash can", (5.8, 0.2, 0.3), (0.4, 0.4, 0.6)),  # O10: in the corner
        ("office chair", (1.0, 2.7, 0.5), (0.6, 0.6, 1.0)),  # O11
        ("office chair", (5.0, 2.7, 0.5), (0.6, 0.6, 1.0)),  # O12
        ("whiteboard", (6.0, 2.0, 1.5), (0.1, 1.8, 1.2)),  # O13: east wall
        ("bookshelf", (0.2, 2.0, 1.0), (0.3, 1.0, 2.0)),  # O14: west wall
        ("telephone", (5.6, 3.2, 0.85), (0.2, 0.2, 0.1)),  # O15
    )


@pytest.mark.parametrize(
    ("program", "expected"),
    [
        ("trash can; under (desk)", "O9"), ("trash can; not under (desk)", "O10"), ("trash can; corner", "O10"),
        ("trash can; largest", "O10"), ("trash can; is small", "O9"), ("trash can; farthest (window)", "O10"),
        ("trash can; closest (corner)", "O10"),
        ("desk; holds (monitor; count 2)", "O5"), ("desk; with (monitor; count 1)", "O4"),
        ("desk; holds (telephone)", "O5"),
        ("desk; not with (telephone)", "O4"), ("desk; above (trash can)", "O4"), ("desk; closest (door)", "O4"),
        ("monitor; near (telephone)", "O8"), ("monitor; on (desk; not with (telephone))", "O6"),
        ("monitor; alone", "O6"),
        ("monitor; on (desk; rightmost); leftmost; looking (windows)", "O7"), ("monitor; closest (door)", "O6"),
        ("window; leftmost; looking (windows)", "O1"), ("window; rightmost; looking (one)", "O3"),
        ("window; count 3; leftmost 2", "O2"), ("window; middle", "O2"), ("window; above (desk; leftmost)", "O1"),
        ("window; farthest (whiteboard)", "O1"), ("window; rightmost; from (door)", "O3"),
        ("window; left (whiteboard); closest (whiteboard)", "O3"), ("window; back (door); rightmost", "O3"),
        ("office chair; front (desk; with (telephone))", "O12"), ("chair; near (bookshelf)", "O11"),
        ("chair; left (chair); looking (window)", "O11"), ("chair; closest (one; rightmost)", "O11"),
        ("thing; between (window; leftmost, window; rightmost); is large", "O2"),
        ("whiteboard; on (wall)", "O13"), ("trash can; on (floor)", "O9"), ("bookshelf; against (wall)", "O14"),
        ("telephone; near (window; rightmost)", "O15"), ("desk; along (bookshelf)", "O4"),
        ("trash can; across (desk); right (door)", "O10"), ("window; center", "O2"),
        ("monitor; is burnt; near (phone)", "O8"),
    ],
)  # fmt: skip
def test_a_room_without_rooms_colors_and_viewer(office, names, program, expected):
    assert best(office, names, program) == expected


@pytest.mark.parametrize(
    ("program", "doubt"),
    [("desk; is red; with (telephone)", "red"), ("desk; near (piano); with (telephone)", "piano"),
     ("desk; floor (upstairs); with (telephone)", "upstairs"), ("desk; room (garage); with (telephone)", "garage"),
     ("desk; is open; with (telephone)", "open"), ("desk; with (telephone); looking (piano)", "piano")],
)  # fmt: skip
def test_what_the_map_has_no_evidence_for_decides_nothing_and_is_said(office, names, program, doubt):
    ranking = ranking_of(office, names, program)
    assert ranking.candidates[0].node.id == "O5"
    assert not ranking.sure
    assert any(doubt in note for note in ranking.notes)


def test_a_wrong_inner_condition_does_not_kill_the_right_answer(office, names):
    # the telephone is on no bookshelf: yet a monitor of its desk is the answer
    assert best(office, names, "monitor; on (desk; with (telephone; on (bookshelf))); closest (telephone)") == "O8"


def test_empty_map_gives_no_candidates(names, node_of):
    graph = SceneGraph.of([node_of("B0", "", "building", (0, 0, 0), (1, 1, 1))])
    for text in ("cup", "thing; largest", "cup; leftmost", "cup; near (wall)", "cup; alone; count 2; middle"):
        assert ranking_of(graph, names, text).candidates == []


def test_an_object_in_no_room_has_the_building_for_one(names, node_of, room_of):
    graph = room_of(("cup", (1, 1, 1), (0.1, 0.1, 0.1)))
    assert best(graph, names, "cup; corner; center; along (cup); against (wall); on (floor); between (cups)") == "O0"


def test_viewpoint_is_said_or_the_askers_or_the_room(names, house):
    asker = np.array([1.0, 2.0, 1.5])
    assert str(ProgramExecutor(house, names, asker).viewpoint(house.nodes["O9"]).source) == "asker"
    viewpoint = ProgramExecutor(house, names, NOWHERE).viewpoint(house.nodes["O9"])
    assert (str(viewpoint.source), viewpoint.xyz_world.tolist()) == ("room centre", [6.5, 2.5, 1.25])
    executor = ProgramExecutor(house, names, asker)
    executor.rank(Program(target=parse_program("vase; leftmost; from (tv)")))
    assert str(executor.viewpoint(house.nodes["O9"]).source) == "tv O10"


def test_of_several_doors_the_one_that_the_asker_stands_at_is_meant(names, room_of):
    doors = ("door", (0, 2, 1), (0.1, 0.9, 2)), ("door", (6, 2, 1), (0.1, 0.9, 2))
    graph = room_of(*doors, ("box", (3, 1, 0.2), (0.4, 0.4, 0.4)), ("box", (3, 3, 0.2), (0.4, 0.4, 0.4)))
    for x, expected in ((0.3, "O3"), (5.7, "O2")):
        assert best(graph, names, "box; leftmost; from (door)", asker=np.array([x, 2.0, 1.5])) == expected


def test_the_first_as_one_comes_in_is_the_nearest(names, house):
    assert best(house, names, "vase; nth 1; from (tv); floor (downstairs)") == "O24"
    assert best(house, names, "vase; nth 2; from (tv); floor (downstairs)") == "O13"


def test_the_askers_heading_turns_a_row(names, house):
    asker = np.array([2.0, 2.0, 1.5])
    for heading, expected in ((np.pi / 2, "O3"), (-np.pi / 2, "O4")):
        assert best(house, names, "chair; leftmost; room (kitchen)", asker=asker, heading=heading) == expected


def test_a_front_gives_left_and_right_of_who_faces_it(names, room_of):
    things = ("sofa", (3, 0.5, 0.4), (2, 0.9, 0.8)), ("lamp", (1.2, 0.5, 0.5), (0.3, 0.3, 1.0))
    graph = room_of(*things, ("lamp", (4.8, 0.5, 0.5), (0.3, 0.3, 1.0)), fronts={0: (0.0, 1.0)})
    assert best(graph, names, "lamp; left (sofa)") == "O2"  # it faces north, so who faces it looks south
    assert ranking_of(graph, names, "lamp; left (sofa)").candidates[0].evidence[-1].endswith("front of sofa O0")
    assert best(graph, names, "lamp; left (sofa)", asker=np.array([3.0, -3.0, 1.5])) == "O1"


def test_level_candidates_are_tied_in_the_order_of_their_ids(names, house):
    assert [c.node.id for c in ranking_of(house, names, "nightstand").tied(0.03)] == ["O16", "O17"]


def test_a_condition_that_fails_is_said(names, house):
    ranking = ranking_of(house, names, "cup; on (bed)")
    assert not ranking.sure
    assert not ranking.candidates[0].holds
    assert ranking.candidates[0].evidence[-1].startswith("not as said: ")


def test_superlatives_look_among_those_that_fit(names, house):
    assert best(house, names, "thing; smallest; near (bed)") == "O18"


def test_of_anything_only_what_is_there_is_an_answer(names, house):
    assert best(house, names, "thing; under (cup; is white)") == "O0"
    assert ranking_of(house, names, "thing; on (vase)").candidates == []


def test_a_name_that_one_bears_is_not_all_when_more_is_said(names, house):
    assert best(house, names, "table") == "O0"  # and not the coffee table
    assert best(house, names, "table; in front; room (living room)".replace("in front; ", "")) == "O22"
    assert best(house, names, "table; smallest") == "O22"


def test_the_nearest_name_is_an_answer_with_doubt(names, room_of):
    graph = room_of(("refrigerator", (1, 1, 1), (0.7, 0.7, 1.8)), ("towel", (3, 1, 1), (0.3, 0.1, 0.5)))
    for noun in ("refridgerator", "fridge", "towell"):  # slips of spelling and other words
        assert ranking_of(graph, names, noun).sure
    assert ranking_of(graph, names, "submarine").candidates == []
