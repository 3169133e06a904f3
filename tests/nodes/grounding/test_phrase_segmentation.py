from placegraph.nodes.grounding.phrase_segmentation import FILLER, rewrite_inverse_phrases, segment
from placegraph.nodes.grounding.relations import trigger_phrases


def test_nothing_and_filler_give_no_pieces():
    assert segment("") == []
    assert segment("where is the") == []


def test_the_longest_phrase_wins():
    assert [phrase.text for phrase in segment("cup in front of the sofa")] == ["cup", "front", "sofa"]
    assert [(phrase.kind, phrase.text) for phrase in segment("on the second floor")] == [("floor", "second floor")]


def test_turned():
    assert rewrite_inverse_phrases("the shelf that has the vase on it") == "the shelf holding the vase"
    assert rewrite_inverse_phrases("the nightstand without the lamp?") == "the nightstand not holding the lamp?"
    assert rewrite_inverse_phrases("the cup on the shelf") == "the cup on the shelf"


def test_no_trigger_is_made_of_filler_alone():
    assert not [phrase for phrase in trigger_phrases() if len(phrase) == 1 and phrase[0] in FILLER]
