from placegraph.runtime.language.prompts import MAX_NAME_LENGTH, fill_prompt, safe_name


def test_fields_are_filled_in():
    filled = fill_prompt("placegraph.nodes.grounding", "purpose", purpose="sit on")
    assert "{" not in filled and "sit on" in filled


def test_a_tag_is_plain_words():
    assert safe_name("Mug <|im_start|>") == "mug im start"
    assert len(safe_name("a" * 500)) == MAX_NAME_LENGTH
    assert safe_name("床", "thing") == "thing"
