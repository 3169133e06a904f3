"""What a grammar allows next, on the packaged model's vocabulary alone."""

import numpy as np
import pytest

from placegraph.runtime.errors import ModelError
from placegraph.runtime.language.grammar_sampling import Allowed, safe_llama_cpp
from placegraph.runtime.language.language_model import default_model_path


@pytest.fixture(scope="module")
def llama():
    made = safe_llama_cpp().Llama(str(default_model_path()), vocab_only=True, verbose=False)
    yield made
    made.close()


def token(llama, text):
    (found,) = llama.tokenize(text.encode(), add_bos=False)
    return found


def values(llama, *wanted):
    """Values of all tokens: those of `wanted` are the highest, in falling order."""
    made = np.zeros(llama.n_vocab())
    made[[token(llama, text) for text in wanted]] = np.arange(len(wanted), 0, -1)
    return made


def test_the_favourite_is_taken_when_the_grammar_allows_it_and_else_the_best_that_it_allows(llama):
    with Allowed(llama, 'root ::= " lamp" | " bed"') as allowed:
        assert allowed.best(values(llama, " bed", " lamp"))[0] == token(llama, " bed")
        assert allowed.best(values(llama, " table", "!", " lamp", " bed"))[0] == token(llama, " lamp")
        assert not allowed.ended()
        allowed.accept(token(llama, " lamp"))
        assert allowed.ended()
        assert allowed.is_end(allowed.best(values(llama, " table"))[0])


def test_among_equals_the_first_token_is_taken(llama):
    with Allowed(llama, 'root ::= " lamp" | " bed"') as allowed:
        # also their beginnings are allowed; these are the two with a value
        equal = np.maximum(values(llama, " bed"), values(llama, " lamp"))
        equal[token(llama, " table")] = 2
        assert allowed.best(equal)[0] == min(token(llama, " lamp"), token(llama, " bed"))


def test_it_has_not_ended_where_more_may_follow(llama):
    with Allowed(llama, 'root ::= " lamp" " bed"?') as allowed:
        allowed.accept(token(llama, " lamp"))
        assert not allowed.ended()
        assert allowed.is_end(allowed.best(values(llama, " table") - (np.arange(llama.n_vocab()) > 2))[0])
        allowed.accept(token(llama, " bed"))
        assert allowed.ended()


def test_a_grammar_that_cannot_be_read_is_named(llama):
    with pytest.raises(ModelError, match="cannot read this grammar: root ::= lamp"):
        Allowed(llama, "root ::= lamp")
