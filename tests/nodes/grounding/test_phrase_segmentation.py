from placegraph.nodes.grounding.phrase_segmentation import FILLER, cut, turned
from placegraph.nodes.grounding.relations import triggers


def test_nothing_and_filler_give_no_pieces():
    assert cut("") == []
    assert cut("where is the") == []


def test_the_longest_phrase_wins():
    assert [piece.text for piece in cut("cup in front of the sofa")] == ["cup", "front", "sofa"]
    assert [(piece.kind, piece.text) for piece in cut("on the second floor")] == [("floor", "second floor")]


def test_turned():
    assert turned("the shelf that has the vase on it") == "the shelf holding the vase"
    assert turned("the nightstand without the lamp?") == "the nightstand not holding the lamp?"
    assert turned("the cup on the shelf") == "the cup on the shelf"


def test_no_trigger_is_made_of_filler_alone():
    assert not [phrase for phrase in triggers() if len(phrase) == 1 and phrase[0] in FILLER]
