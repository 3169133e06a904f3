import numpy as np

from placegraph.nodes.grounding.ground import Grounder
from placegraph.nodes.grounding.program import Clause, Program, Thing
from placegraph.nodes.grounding.select import narrow
from placegraph.runtime.scene_graph import SceneGraph

NOWHERE = np.full(3, np.nan)


def ranked(graph, names, program, asker=NOWHERE):
    return Grounder(graph, names, asker).rank(program, narrow(graph, program, names))


def test_empty_map_gives_no_candidates(names, node_of):
    graph = SceneGraph.of([node_of("B0", "", "building", (0, 0, 0), (1, 1, 1))])
    assert ranked(graph, names, Program(target=Thing(noun="cup"))).candidates == []
    assert ranked(graph, names, Program(target=Thing(), clauses=(Clause(relation="largest"),))).candidates == []


def test_viewpoint_is_the_askers_or_the_room(names, house):
    asker = np.array([1.0, 2.0, 1.5])
    assert Grounder(house, names, asker).viewpoint(house.nodes["O9"]).source == "asker"
    view = Grounder(house, names, NOWHERE).viewpoint(house.nodes["O9"])
    assert (view.source, view.xyz_world.tolist()) == ("room centre", [6.5, 2.5, 1.25])


def test_level_candidates_are_tied_in_the_order_of_their_ids(names, house):
    ranking = ranked(house, names, Program(target=Thing(noun="nightstand")))
    assert [c.node.id for c in ranking.tied()] == ["O16", "O17"]


def test_an_unknown_anchor_decides_nothing_and_leaves_doubt(names, house):
    clause = Clause(relation="near", anchors=(Thing(noun="piano"),))
    ranking = ranked(house, names, Program(target=Thing(noun="bed"), clauses=(clause,)))
    assert [c.node.id for c in ranking.candidates] == ["O15"]
    assert not ranking.sure
    assert "piano" in ranking.notes[0]


def test_a_condition_that_fails_is_said(names, house):
    clause = Clause(relation="on", anchors=(Thing(noun="bed"),))
    ranking = ranked(house, names, Program(target=Thing(noun="cup"), clauses=(clause,)))
    assert not ranking.sure
    assert not ranking.candidates[0].holds
    assert ranking.candidates[0].evidence[-1].startswith("not on: ")


def test_superlatives_look_among_those_that_fit(names, house):
    near = Clause(relation="near", anchors=(Thing(noun="bed"),))
    program = Program(target=Thing(), clauses=(Clause(relation="smallest"), near))
    assert ranked(house, names, program).candidates[0].node.id == "O18"


def test_what_is_near_twins_leaves_them_out(names, house):
    clause = Clause(relation="near", anchors=(Thing(noun="nightstand"),))
    ranking = ranked(house, names, Program(target=Thing(noun="nightstand"), clauses=(clause,)))
    assert {c.node.id for c in ranking.candidates} == {"O16", "O17"}
