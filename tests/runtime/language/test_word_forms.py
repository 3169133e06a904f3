import pytest

from placegraph.runtime.language.word_forms import is_plural, normal_form, singular, synonyms, tokens


def test_tokens_of_nothing():
    assert tokens("") == ()
    assert tokens("где кружка") == ()


def test_tokens_keep_words_and_marks():
    assert tokens("Where's the CAFÉ table, Bob?") == ("where", "the", "cafe", "table", ",", "bob", "?")


def test_tokens_leave_out_what_could_break_a_grammar():
    assert tokens('a "b" \\ ::= | {c}\n') == ("a", "b", ":", ":", "c")


@pytest.mark.parametrize(
    ("word", "one"),
    [("chairs", "chair"), ("boxes", "box"), ("shelves", "shelf"), ("glass", "glass"), ("glasses", "glass"),
     ("berries", "berry"), ("bus", "bus"), ("dishes", "dish"), ("scissors", "scissors"), ("", "")],
)  # fmt: skip
def test_singular(word, one):
    assert singular(word) == one


def test_normal_form_and_plural():
    assert normal_form("") == ""
    assert normal_form("Coffee-Tables") == "coffee table"
    assert is_plural("red chairs")
    assert not is_plural("red chair")


def test_synonyms_hold_both_ways():
    assert "sofa" in synonyms()["couch"]
    assert "couch" in synonyms()["sofa"]
    for name, group in synonyms().items():
        assert name in group
