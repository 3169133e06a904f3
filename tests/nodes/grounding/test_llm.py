import numpy as np
import pytest

from placegraph.nodes.grounding.llm import LanguageModel, default_model_path, prompt
from placegraph.nodes.grounding.program import enum_rule
from placegraph.runtime.errors import QueryError


@pytest.fixture(scope="module")
def model():
    made = LanguageModel(n_ctx=256)
    yield made
    made.close()


def test_the_packaged_model_is_there():
    assert default_model_path().stat().st_size > 50_000_000


def test_prompts_are_filled_in():
    assert "{" not in prompt("tie", objects="O1: cup", question="cup").replace('{"', "")
    assert "O1: cup" in prompt("tie", objects="O1: cup", question="cup")


def test_a_prompt_that_does_not_fit_is_refused_and_the_model_lives_on(model):
    for _ in range(2):
        with pytest.raises(QueryError, match="do not fit the context of 256"):
            model.complete("word " * 300, "root ::= " + enum_rule(["O1"]), 8)
    with pytest.raises(QueryError, match="do not fit"):
        model.log_probabilities("word " * 150, " word" * 150, [" a"])
    assert model.complete("Say O1:", "root ::= " + enum_rule(["O1"]), 8) == "O1"


def test_a_reply_that_is_cut_off_is_refused(model):
    with pytest.raises(QueryError, match="longer than 2 tokens"):
        model.complete("Say:", "root ::= " + enum_rule(["a very long reply that needs many tokens"]), 2)


def test_log_probabilities(model):
    options = [" bedroom", " garage", " dining room"]
    values = model.log_probabilities("A bed is found in the bedroom. A", " pillow is found in the", options)
    assert values.shape == (3,)
    assert (values < 0).all()
    assert int(np.argmax(values)) == 0
    model.complete("Say O1:", "root ::= " + enum_rule(["O1"]), 8)
    again = model.log_probabilities("A bed is found in the bedroom. A", " pillow is found in the", options[::-1])
    np.testing.assert_array_equal(values, again[::-1])
    assert model.log_probabilities("A", " b", []).shape == (0,)
