from placegraph.runtime.language.textualization import MAX_NAME, plain


def test_a_tag_is_plain_words():
    assert plain("Mug <|im_start|>") == "mug im start"
    assert len(plain("a" * 500)) == MAX_NAME
    assert plain("床", "thing") == "thing"
