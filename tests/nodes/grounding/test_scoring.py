import numpy as np
import pytest

from placegraph.nodes.grounding.box_arrays import layout_of
from placegraph.nodes.grounding.scoring import ScoredCandidates
from placegraph.nodes.grounding.settings import ScoreSettings


def words(i):
    return f"thing {i}"


@pytest.fixture
def scored(room_of):
    def make(*names, narrowed=True):
        things = [("cup", (i, 0, 0), (0.1, 0.1, 0.1)) for i in range(len(names))]
        layout = layout_of(room_of(*things, ("end", (9, 0, 0), (1, 1, 1))))
        boxes = layout.all.take(range(len(names)))
        return ScoredCandidates(boxes, layout.nodes[: len(names)], np.array(names), ScoreSettings(), narrowed=narrowed)

    return make


def rank(one, measure, number=1, **kwargs):
    one.apply_rank(np.array(measure, float), number, 0.1, words, trust=1.0, negated=False, **kwargs)


def test_nothing_is_weighed(scored):
    one = scored()
    one.apply_fits(np.ones(0), words)
    rank(one, [])
    assert (len(one), one.relative_scores().tolist(), one.rankable().tolist()) == (0, [], [])


def test_names_as_good_as_the_best_are_peers(scored):
    assert scored(1.0, 0.98, 0.9).peers.tolist() == [True, True, False]
    # one alone is called so, and more is said of it than the name: then the next names are meant too
    assert scored(1.0, 0.9, 0.7).peers.tolist() == [True, True, False]
    assert scored(1.0, 0.9, 0.7, narrowed=False).peers.tolist() == [True, False, False]


def test_what_fails_stays_listed_below(scored):
    one = scored(1.0, 1.0)
    one.apply_fits(np.array([0.0, 0.8]), words)
    assert one.holds.tolist() == [False, True]
    assert 0 < one.scores[0] < 0.1 < one.scores[1]
    assert one.evidence(0) == ["not as said: thing 0"]


def test_negation_turns_a_fit_round_and_trust_softens_it(scored):
    turned, doubted = scored(1.0, 1.0), scored(1.0, 1.0)
    turned.apply_fits(np.array([0.9, 0.1]), words, negated=True)
    assert turned.holds.tolist() == [False, True]
    doubted.apply_fits(np.array([0.25, 1.0]), words, trust=0.5)
    assert doubted.scores.tolist() == [0.5, 1.0]


def test_ranks_are_of_what_holds(scored):
    one = scored(1.0, 1.0, 1.0)
    one.apply_fits(np.array([0.1, 1.0, 1.0]), words)
    rank(one, [9, 1, 2])
    assert (one.scores.argmax(), one.holds.tolist()) == (2, [False, False, True])
    assert one.evidence(2)[-1] == "thing 2, number 1 of 2"


def test_two_ranks_that_disagree_join_softly(scored):
    one = scored(1.0, 1.0, 1.0)
    rank(one, [10, 9.5, 0])
    rank(one, [0, 10, 9.5])
    assert one.scores.argmax() == 1
    assert not one.holds.any()


def test_the_nth_and_one_too_many(scored):
    second, ninth = scored(1.0, 1.0, 1.0), scored(1.0, 1.0, 1.0)
    rank(second, [3, 1, 2], number=2)
    assert second.scores.argmax() == 2
    rank(ninth, [3, 1, 2], number=9)
    assert not ninth.holds.any()
    assert "there are only 3, not 9" in ninth.evidence(0)[0]


def test_what_cannot_be_told_apart_ties(scored):
    one = scored(1.0, 1.0)
    rank(one, [1.0, 0.95])
    assert one.holds.all()
