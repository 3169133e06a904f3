from placegraph.nodes.grounding.textualise import MOST_NAME, plain


def test_a_tag_is_plain_words():
    assert plain("Mug <|im_start|>") == "mug im start"
    assert len(plain("a" * 500)) == MOST_NAME
    assert plain("床", "thing") == "thing"
