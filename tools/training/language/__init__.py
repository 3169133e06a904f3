"""Generated requests with their programs, to train the reader: a grammar that says each program in many ways.

Whole phrasings and nouns are held out for validation (speaker.is_held). What is said follows the conventions of
nodes/grounding/program.py. Source: METHOD section 10; 400 requests of people were read for it, none is in it.
"""

from __future__ import annotations

from dataclasses import dataclass
from random import Random

from placegraph.nodes.grounding.program import Thing
from placegraph.nodes.grounding.program_syntax import format_program
from placegraph.runtime.language.word_forms import tokens
from placegraph.tools.training.language.sentences import Sentences
from placegraph.tools.training.language.speaker import Speaker

MAX_WORDS = 60


@dataclass(frozen=True)
class Example:
    """A request and its program in the notation."""

    text: str
    program: str


def examples(seed: int, start: int, count: int, *, held_out: bool = False) -> list[Example]:
    """Examples number start to start + count of a seed, each the same whatever is asked for beside it.

    held_out: half of what is drawn from a list is of the nouns and phrasings that no other example has.
    """
    return [_example(seed, number, held_out) for number in range(start, start + count)]


def _example(seed: int, number: int, held_out: bool) -> Example:
    attempt = 0
    while True:
        random = Random(f"{seed}/{number}/{held_out}/{attempt}")
        text, thing = Sentences(Speaker(random, held_out)).request()
        words = tokens(text)
        if len(words) <= MAX_WORDS and _is_said(thing, f" {' '.join(words)} "):
            return Example(
                text[0].upper() + text[1:] if random.random() < 0.5 else text, format_program(_copied(thing))
            )
        attempt += 1


def _copied(thing: Thing) -> Thing:
    """The thing with nouns and words as the tokens of the request spell them, which is all that the reader can copy."""
    conditions = tuple(
        condition.model_copy(
            update={"words": " ".join(tokens(condition.words)), "things": tuple(map(_copied, condition.things))}
        )
        for condition in thing.conditions
    )
    return Thing(noun=" ".join(tokens(thing.noun)), conditions=conditions)


def _is_said(thing: Thing, text: str) -> bool:
    """Whether all nouns and words of a program can be copied from the text."""
    spans = [thing.noun, *(condition.words for condition in thing.conditions if condition.words)]
    inner = [each for condition in thing.conditions for each in condition.things]
    own = all(f" {' '.join(tokens(span))} " in text or span in ("thing", "one") for span in spans)
    return own and all(_is_said(each, text) for each in inner)
