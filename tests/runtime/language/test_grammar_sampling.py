"""What a grammar allows next, on the packaged model's vocabulary alone."""

import numpy as np
import pytest

from placegraph.runtime.errors import ModelError
from placegraph.runtime.language.grammar_sampling import GrammarSampler
from placegraph.runtime.language.language_model import default_model_path
from placegraph.runtime.language.llama_library import import_llama_cpp


@pytest.fixture(scope="module")
def llama():
    made = import_llama_cpp().Llama(str(default_model_path()), vocab_only=True, verbose=False)
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
    with GrammarSampler(llama, 'root ::= " lamp" | " bed"') as sampler:
        assert sampler.best_token(values(llama, " bed", " lamp"))[0] == token(llama, " bed")
        assert sampler.best_token(values(llama, " table", "!", " lamp", " bed"))[0] == token(llama, " lamp")
        assert not sampler.is_complete()
        sampler.accept(token(llama, " lamp"))
        assert sampler.is_complete()
        assert sampler.is_end(sampler.best_token(values(llama, " table"))[0])


def test_among_equals_the_first_token_is_taken(llama):
    with GrammarSampler(llama, 'root ::= " lamp" | " bed"') as sampler:
        # also their beginnings are allowed; these are the two with a value
        equal = np.maximum(values(llama, " bed"), values(llama, " lamp"))
        equal[token(llama, " table")] = 2
        assert sampler.best_token(equal)[0] == min(token(llama, " lamp"), token(llama, " bed"))


def test_it_has_not_ended_where_more_may_follow(llama):
    with GrammarSampler(llama, 'root ::= " lamp" " bed"?') as sampler:
        sampler.accept(token(llama, " lamp"))
        assert not sampler.is_complete()
        assert sampler.is_end(sampler.best_token(values(llama, " table") - (np.arange(llama.n_vocab()) > 2))[0])
        sampler.accept(token(llama, " bed"))
        assert sampler.is_complete()


def test_a_grammar_that_cannot_be_read_is_named(llama):
    with pytest.raises(ModelError, match="cannot read this grammar: root ::= lamp"):
        GrammarSampler(llama, "root ::= lamp")
