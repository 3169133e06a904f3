"""The hand-made programs of human-written requests can be written by the model: valid, of each request's own words."""

import json
from itertools import chain
from pathlib import Path

import pytest

from placegraph.nodes.grounding.llm_parser import default_adapter_path, parse_by_model
from placegraph.nodes.grounding.program import ANYTHING, SAME_KIND, Thing, normalized
from placegraph.nodes.grounding.program_syntax import NEVER_FIRST, format_program, parse_program
from placegraph.runtime.language.language_model import LanguageModel
from placegraph.runtime.language.word_forms import tokens

LABELS = [json.loads(line) for line in Path(__file__).with_name("human_programs.jsonl").read_text().splitlines()]
PROGRAMS = [(label["line"], program) for label in LABELS for program in label["programs"]]
# The sentences are not ours to give away, so they stay beside the checkout.
REQUESTS = Path(__file__).parents[4] / "shared/data/language/human_requests.jsonl"


def things(thing: Thing) -> list[Thing]:
    inner = (things(other) for condition in thing.conditions for other in condition.things)
    return [thing, *chain.from_iterable(inner)]


def follow_each_other(span: str, words: tuple[str, ...]) -> bool:
    """Whether the span's words stand in the request in one piece; a mark between them is a token that breaks it."""
    wanted = tuple(span.split(" "))
    return any(words[i : i + len(wanted)] == wanted for i in range(len(words)))


def test_every_fourth_request_is_labeled_once():
    assert [label["line"] for label in LABELS] == list(range(0, 400, 4))


@pytest.mark.parametrize(("line", "program"), PROGRAMS)
def test_each_is_a_program_that_the_grammar_allows(line, program):
    target = parse_program(program)
    assert format_program(target) == program
    for thing in things(target):
        for condition in thing.conditions:
            assert condition.number <= 9
            assert thing is target or condition.kind not in ("view", "purpose")


@pytest.mark.parametrize("label", LABELS, ids=lambda label: str(label["line"]))
def test_alternatives_are_different_programs(label):
    forms = [normalized(parse_program(program)) for program in label["programs"]]
    assert forms and len(set(forms)) == len(forms)


@pytest.mark.weights
@pytest.mark.skipif(not REQUESTS.exists(), reason="human-written requests lie beside a development checkout")
def test_nouns_and_words_are_the_requests_own():
    sentences = [json.loads(line)["text"] for line in REQUESTS.read_text().splitlines()]
    strange = []
    for line, program in PROGRAMS:
        words = tokens(sentences[line])
        for thing in things(parse_program(program)):
            nouns = [] if thing.noun in (ANYTHING, SAME_KIND) else [thing.noun]
            spans = nouns + [condition.words for condition in thing.conditions if condition.words]
            strange += [(line, span) for span in spans if not follow_each_other(span, words)]
            # A span that starts with such a word is not in the grammar at all.
            strange += [(line, span) for span in spans if span.split(" ")[0] in NEVER_FIRST]
    assert strange == []


@pytest.mark.weights
@pytest.mark.skipif(not REQUESTS.exists(), reason="human-written requests lie beside a development checkout")
def test_the_packaged_reader_reads_people():
    sentences = [json.loads(line)["text"] for line in REQUESTS.read_text().splitlines()]
    model = LanguageModel(adapter_path=default_adapter_path())
    exact = noun = 0
    for label in LABELS:
        found = normalized(parse_by_model(model, sentences[label["line"]]).thing)
        right = [normalized(parse_program(program)) for program in label["programs"]]
        exact += found in right
        noun += found.noun in {one.noun for one in right}
    model.close()
    assert exact >= 55 and noun >= 95, (exact, noun)  # of 100; README has what they are
