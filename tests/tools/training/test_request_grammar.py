import re

import pytest

from placegraph.nodes.grounding.program import CONDITIONS
from placegraph.nodes.grounding.program_syntax import format_program, parse_program, program_grammar
from placegraph.runtime.language.word_forms import tokens
from placegraph.tools.training.request_grammar import examples
from placegraph.tools.training.request_grammar.phrase_grammar import PhraseGrammar, is_held_out
from placegraph.tools.training.request_grammar.phrase_tables import WORDS


@pytest.fixture(scope="module")
def coarse_mask():
    return examples(7, 0, 3000)


def test_each_example_is_the_same_whatever_is_drawn_beside_it(coarse_mask):
    assert examples(7, 1234, 3) == coarse_mask[1234:1237]
    assert examples(8, 0, 5) != coarse_mask[:5]
    assert examples(7, 0, 5, held_out=True) != coarse_mask[:5]


def test_programs_are_of_the_requests_own_words(coarse_mask):
    for example in coarse_mask[:300]:
        assert format_program(parse_program(example.program)) == example.program
        said = f" {' '.join(tokens(example.text))} "
        spans = re.split(r"[;,()]+", example.program)
        nouns = [re.sub(r"^(not )?(is )", "", span.strip()) for span in spans]
        for noun in nouns:
            known = noun.removeprefix("not ").split(" ")[0] in CONDITIONS or noun in ("thing", "one", "")
            assert known or f" {noun} " in said, (noun, example)
    assert program_grammar(coarse_mask[0].text)


def test_every_condition_and_every_depth_is_drawn(coarse_mask):
    seen = {name for example in coarse_mask for name in re.findall(r"(?:; |; not )([a-z]+)", example.program)}
    assert seen >= set(CONDITIONS) - {"along", "facing", "end"}
    assert any(example.program.count("(") >= 3 and "((" not in example.program for example in coarse_mask)
    assert any("not " in example.program for example in coarse_mask)


def test_held_out_nouns_are_never_said_in_training(coarse_mask):
    held = [noun for noun in WORDS["furniture"][3:] if is_held_out(noun) and " " in noun]
    assert held
    words = [" ".join(tokens(example.text)) for example in coarse_mask]
    assert not [noun for noun in held for text in words if re.search(rf"\b{noun}\b", text)]
    kept = [" ".join(tokens(example.text)) for example in examples(7, 0, 3000, held_out=True)]
    assert any(noun in text for noun in held for text in kept)


@pytest.mark.parametrize(
    ("noun", "plural"), [("bench", "benches"), ("shelf", "shelves"), ("tray", "trays"), ("berry", "berries")]
)
def test_plurals(noun, plural):
    assert PhraseGrammar.plural(noun) == plural
