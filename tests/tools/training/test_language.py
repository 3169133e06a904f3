import re

import pytest

from placegraph.nodes.grounding.program import CONDITIONS
from placegraph.nodes.grounding.program_syntax import format_program, parse_program, program_grammar
from placegraph.runtime.language.word_forms import tokens
from placegraph.tools.training.language import examples
from placegraph.tools.training.language.speaker import Speaker, is_held
from placegraph.tools.training.language.words import FURNITURE


@pytest.fixture(scope="module")
def drawn():
    return examples(7, 0, 3000)


def test_each_example_is_the_same_whatever_is_drawn_beside_it(drawn):
    assert examples(7, 1234, 3) == drawn[1234:1237]
    assert examples(8, 0, 5) != drawn[:5]
    assert examples(7, 0, 5, held_out=True) != drawn[:5]


def test_programs_are_of_the_requests_own_words(drawn):
    for example in drawn[:300]:
        assert format_program(parse_program(example.program)) == example.program
        said = f" {' '.join(tokens(example.text))} "
        spans = re.split(r"[;,()]+", example.program)
        nouns = [re.sub(r"^(not )?(is )", "", span.strip()) for span in spans]
        for noun in nouns:
            known = noun.removeprefix("not ").split(" ")[0] in CONDITIONS or noun in ("thing", "one", "")
            assert known or f" {noun} " in said, (noun, example)
    assert program_grammar(drawn[0].text)


def test_every_condition_and_every_depth_is_drawn(drawn):
    seen = {name for example in drawn for name in re.findall(r"(?:; |; not )([a-z]+)", example.program)}
    assert seen >= set(CONDITIONS) - {"along", "facing", "end"}
    assert any(example.program.count("(") >= 3 and "((" not in example.program for example in drawn)
    assert any("not " in example.program for example in drawn)


def test_held_out_nouns_are_never_said_in_training(drawn):
    held = [noun for noun in FURNITURE[3:] if is_held(noun) and " " in noun]
    assert held
    words = [" ".join(tokens(example.text)) for example in drawn]
    assert not [noun for noun in held for text in words if re.search(rf"\b{noun}\b", text)]
    kept = [" ".join(tokens(example.text)) for example in examples(7, 0, 3000, held_out=True)]
    assert any(noun in text for noun in held for text in kept)


@pytest.mark.parametrize(
    ("noun", "plural"), [("bench", "benches"), ("shelf", "shelves"), ("tray", "trays"), ("berry", "berries")]
)
def test_plurals(noun, plural):
    assert Speaker.plural(noun) == plural
