from placegraph.nodes.grounding.ranking import Candidate, Ranking


def test_nothing_is_tied_with_nothing():
    assert Ranking().tied(0.03) == []


def test_tied_are_those_that_hold_alike_and_score_alike(house):
    nodes = [house.nodes[f"O{i}"] for i in range(4)]
    scores = ((0.9, True), (0.88, True), (0.88, False), (0.8, True))
    ranking = Ranking([Candidate(node, s, holds=h) for node, (s, h) in zip(nodes, scores, strict=True)])
    assert [one.node.id for one in ranking.tied(0.03)] == ["O0", "O1"]


def test_a_doubt_is_said_once():
    ranking = Ranking()
    ranking.note("no such thing")
    ranking.note("no such thing")
    assert (ranking.notes, ranking.sure) == (["no such thing"], False)
