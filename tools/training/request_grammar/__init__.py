"""Generated requests with their programs for training the reader: a grammar with many phrasings of each program.

Whole phrasings and nouns are held out for validation (phrase_grammar.is_held_out). Meanings follow the conventions of
nodes/grounding/program.py. The grammar was written after reading 400 human-written requests; none of them is in it.
"""

from __future__ import annotations

from dataclasses import dataclass
from random import Random

from placegraph.nodes.grounding.program import Thing
from placegraph.nodes.grounding.program_syntax import format_program
from placegraph.runtime.language.word_forms import tokens
from placegraph.tools.training.request_grammar.phrase_grammar import PhraseGrammar
from placegraph.tools.training.request_grammar.sentence_grammar import SentenceGrammar

MAX_WORDS = 60


@dataclass(frozen=True)
class Example:
    """A request and its program as text."""

    text: str
    program: str


def examples(seed: int, start: int, count: int, *, held_out: bool = False) -> list[Example]:
    """Examples number start to start + count of a seed; an example does not depend on the range.

    held_out: half of the draws from a list come from nouns and phrasings that no other example has.
    """
    return [_example(seed, number, held_out) for number in range(start, start + count)]


def _example(seed: int, number: int, held_out: bool) -> Example:
    attempt = 0
    while True:
        random = Random(f"{seed}/{number}/{held_out}/{attempt}")
        text, thing = SentenceGrammar(PhraseGrammar(random, held_out)).request()
        words = tokens(text)
        if len(words) <= MAX_WORDS and _can_be_copied(thing, f" {' '.join(words)} "):
            return Example(
                text[0].upper() + text[1:] if random.random() < 0.5 else text, format_program(_as_tokens(thing))
            )
        attempt += 1


def _as_tokens(thing: Thing) -> Thing:
    """The thing with nouns and words as the tokens of the request, which is all that the reader can copy."""
    conditions = tuple(
        condition.model_copy(
            update={"words": " ".join(tokens(condition.words)), "things": tuple(map(_as_tokens, condition.things))}
        )
        for condition in thing.conditions
    )
    return Thing(noun=" ".join(tokens(thing.noun)), conditions=conditions)


def _can_be_copied(thing: Thing, text: str) -> bool:
    """Whether all nouns and words of a program can be copied from the text."""
    spans = [thing.noun, *(condition.words for condition in thing.conditions if condition.words)]
    inner = [each for condition in thing.conditions for each in condition.things]
    own = all(f" {' '.join(tokens(span))} " in text or span in ("thing", "one") for span in spans)
    return own and all(_can_be_copied(each, text) for each in inner)
