import ctypes

import llama_cpp
import pytest

from placegraph.nodes.grounding.program import MAX_DEPTH
from placegraph.nodes.grounding.program_syntax import format_program, parse_program, program_grammar
from placegraph.runtime.errors import QueryError

PROGRAMS = (
    "pillow; is blue; on (bed; leftmost); not near (lamp); closest 2 (window); floor (second floor)",
    "window; middle; count 3; looking (wall; with (desk; count 1))",
    "thing; for (sit on)",
    "chair; between (desk, table; is round); not is red; nth 2",
    "trash can; room (bathroom); farthest; corner; center (table)",
)


@pytest.mark.parametrize("text", PROGRAMS)
def test_what_is_read_is_written_alike(text):
    assert format_program(parse_program(text)) == text


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "a noun"),
        ("chair; beneath (bed)", "a condition"),
        ("chair; near", "near takes 1 to 1 things"),
        ("chair; near (bed", "expected )"),
        ("chair; leftmost (bed)", "leftmost takes 0 to 0 things"),
        ("chair; nth", "nth takes a number"),
        ("chair) near", "expected the end"),
        ("chair; is {red}", "'{' has no place"),
        ("chair" + "; near (bed" * MAX_DEPTH + ")" * MAX_DEPTH, "deep"),
    ],
)
def test_a_damaged_program_is_named_with_what_was_expected(text, says):
    with pytest.raises(QueryError, match="program") as error:
        parse_program(text)
    assert says in str(error.value)


def _allows(rules, text):
    """Whether llama.cpp's own grammar lets every character of a text pass, and the end after it."""
    low = llama_cpp.llama_cpp
    model = llama_cpp.Llama(str(_packaged()), vocab_only=True, verbose=False)
    vocab = low.llama_model_get_vocab(model.model)
    sampler = low.llama_sampler_init_grammar(vocab, rules.encode(), b"root")
    try:
        for token in [*model.tokenize(text.encode(), add_bos=False), model.token_eos()]:
            one = (low.llama_token_data * 1)(low.llama_token_data(id=token, logit=1.0, p=0.0))
            array = low.llama_token_data_array(data=one, size=1, selected=-1, sorted=False)
            low.llama_sampler_apply(sampler, ctypes.byref(array))
            if one[0].logit == float("-inf"):
                return False
            if token != model.token_eos():
                low.llama_sampler_accept(sampler, token)
        return True
    finally:
        low.llama_sampler_free(sampler)
        model.close()


def _packaged():
    from placegraph.runtime.language.language_model import default_model_path

    return default_model_path()


def test_the_grammar_allows_programs_of_the_requests_own_words_and_no_others():
    rules = program_grammar("Facing the wall with 2 desks: the big trash can to the left of the lamp, upstairs")
    assert _allows(rules, " trash can; is big; left (lamp); looking (wall; with (desks; count 2)); floor (upstairs)\n")
    assert not _allows(rules, " chair; is big\n")
    assert not _allows(rules, " trash can; is red\n")
    assert not _allows(rules, " trash can; near (wall with 2 desks the big)\n")  # across a mark
    assert not _allows(rules, " trash can; leftmost (lamp)\n")
    assert not _allows(rules, " trash can; near (wall; looking (lamp))\n")  # views are the target's
    assert not _allows(rules, " trash can")


def test_a_request_without_a_word_has_no_grammar():
    with pytest.raises(QueryError, match="Latin"):
        program_grammar("床の上 ... ?!")
