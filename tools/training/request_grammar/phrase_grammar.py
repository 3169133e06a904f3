"""Noun phrases with their meaning: what is said of a thing before and after its noun.

Each phrase carries its conditions in the order in which they are said. A condition that directly follows an anchor
belongs to the anchor; so one of the target after an anchor gets a comma or an "and" (sentence_grammar.py).
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from random import Random

from placegraph.nodes.grounding.program import CONDITIONS, SAME_KIND, Condition, Thing
from placegraph.tools.training.request_grammar.phrase_tables import (
    NUMBERS,
    ORDINALS,
    PHRASES,
    TEMPLATES,
    WEIGHTS,
    WORDS,
)

HELD_SHARE = 8  # one in this many phrasings and nouns is kept for validation,
COMMON = 3  # but for the first ones of each list, which are what most people say
MAX_DEPTH = 3


@dataclass
class Phrase:
    """Words after a noun and their conditions; `predicate`: the same after the noun and a verb."""

    text: str
    predicate: str
    conditions: list[Condition]
    ends_in_anchor: bool = False


@dataclass
class NounPhrase:
    """A noun with the words around it; `text` has no article."""

    before: list[str] = field(default_factory=list)
    noun: str = ""
    behind: list[Phrase] = field(default_factory=list)
    conditions: list[Condition] = field(default_factory=list)

    @property
    def head(self) -> str:
        """The noun with what stands before it."""
        return " ".join([*self.before, self.noun])


def is_held_out(option: str) -> bool:
    """Whether a phrasing or noun is kept for validation."""
    return zlib.crc32(option.encode()) % HELD_SHARE == 0


class PhraseGrammar:
    """Draws phrases. held_out: mostly from the phrasings and nouns that training never uses."""

    def __init__(self, random: Random, held_out: bool) -> None:
        self.random, self.held_out = random, held_out
        self.target_noun = ""

    def chance(self, share: float) -> bool:
        """True in so many of the cases."""
        return self.random.random() < share

    def pick(self, options: Sequence[str]) -> str:
        """One of the options that may be used."""
        if len(options) < 4:
            return self.random.choice(options)
        held = [option for option in options[COMMON:] if is_held_out(option)]
        if self.held_out and held and self.chance(0.5):
            return self.random.choice(held)
        return self.random.choice([option for option in options if option not in held])

    def weighted(self, weights: Mapping[str, float]) -> str:
        """One of the names by weight."""
        return self.random.choices(list(weights), list(weights.values()))[0]

    # nouns ----------------------------------------------------------------------------------------------------------

    def noun(self) -> str:
        """A noun, now and then misspelt, as it will stand in the text and in the program."""
        lists = (WORDS["furniture"], WORDS["fixtures"], WORDS["things"], WORDS["rare"])
        return self.misspell(self.pick(self.random.choices(lists, (4, 4, 5, 1.5))[0]))

    def misspell(self, noun: str) -> str:
        """A letter lost, doubled or swapped in one of 40 longer nouns; a space lost or put in now and then."""
        if " " in noun and self.chance(0.03):
            return noun.replace(" ", self.random.choice(("", "-")), 1)
        if len(noun) < 6 or not self.chance(0.025):
            return noun
        i = self.random.randrange(1, len(noun) - 2)
        if not noun[i : i + 2].isalpha():
            return noun
        return self.random.choice((
            noun[:i] + noun[i + 1 :],
            noun[:i] + noun[i] * 2 + noun[i + 1 :],
            noun[:i] + noun[i + 1] + noun[i] + noun[i + 2 :],
        ))  # fmt: skip

    @staticmethod
    def plural(noun: str) -> str:
        """More than one of it."""
        if noun.endswith(("ss", "sh", "ch", "x")):
            return noun + "es"
        if noun.endswith("s"):
            return noun
        if noun.endswith("shelf"):
            return noun[:-1] + "ves"
        return noun[:-1] + "ies" if noun.endswith("y") and noun[-2] not in "aeiou" else noun + "s"

    def adjectives(self, most: int) -> tuple[list[str], list[Condition]]:
        """Up to `most` adjectives before a noun, no two of one kind."""
        sorts = [WORDS["sizes"], WORDS["states"], WORDS["shapes"], WORDS["colors"], WORDS["materials"]]
        shares = self.random.choices(range(5), (5, 2.5, 1.5, 7, 2.5), k=most)
        said = [self.pick(sorts[i]) for i in sorted(set(shares))]
        if self.chance(0.15):
            self.random.shuffle(said)
        return said, [Condition(name="is", words=word) for word in said]

    def article(self, indefinite: float = 0.1) -> str:
        """An article, sometimes omitted, as people do."""
        luck = self.random.random()
        return (
            "" if luck < 0.06 else self.random.choice(("a ", "that ", "some ")) if luck < indefinite + 0.06 else "the "
        )

    # things that something else is told by ----------------------------------------------------------------------------

    def anchor(self, depth: int, *, simple: bool = False, noun: str = "") -> tuple[str, Thing]:
        """A noun phrase with its article, and its meaning. simple: nothing after its noun."""
        luck = self.random.random() if not noun else 0.5
        if luck < 0.04 and self.target_noun and not simple:
            return self._same_kind_anchor()
        if luck < 0.10:
            return self._counted_anchor()
        noun = noun or (self.plural(self.target_noun) if luck < 0.13 and self.target_noun else self.noun())
        if luck > 0.97:
            noun = self.random.choice(("wall", "floor", "ceiling", "corner", "ground"))
        phrase = self.noun_phrase(noun, depth, simple=simple)
        indefinite = 0.6 if simple else 0.12
        text = " ".join([self.article(indefinite) + phrase.head, *(part.text for part in phrase.behind)])
        return fitting_article(text), thing_of(phrase)

    def _same_kind_anchor(self) -> tuple[str, Thing]:
        """The other one, the red one, the others: of the target's own kind."""
        if self.chance(0.4):
            text = self.random.choice(("the others", "the other ones", "the other one", "the rest", "any other one"))
            return text, Thing(noun=SAME_KIND)
        said, conditions = self.adjectives(self.random.choice((1, 1, 2)))
        return f"the {' '.join(said)} one", Thing(noun=SAME_KIND, conditions=tuple(conditions))

    def _counted_anchor(self) -> tuple[str, Thing]:
        """Two beds, the 3 monitors, only one lamp."""
        if self.chance(0.3):
            noun = self.noun()
            text = self.random.choice(("only one {}", "just one {}", "a single {}", "only a single {}")).format(noun)
            return text, Thing(noun=noun, conditions=(Condition(name="count", number=1),))
        number = self.random.choice((2, 2, 2, 3, 3, 4, 5, 6))
        noun = self.plural(self.noun())
        said = "both" if number == 2 and self.chance(0.1) else self.random.choice(NUMBERS[number])
        said = self.random.choice(("dual", "pair of")) if number == 2 and self.chance(0.12) else said
        adjectives, conditions = self.adjectives(1) if self.chance(0.25) else ([], [])
        text = " ".join([f"{'the ' if self.chance(0.5) and said != 'both' else ''}{said}", *adjectives, noun])
        return text, Thing(noun=noun, conditions=(Condition(name="count", number=number), *conditions))

    def noun_phrase(self, noun: str, depth: int, *, simple: bool = False) -> NounPhrase:
        """A noun with adjectives, a rank and a condition after it; fewer with depth."""
        phrase = NounPhrase(noun=noun)
        if self.chance(0.09):
            name = self.weighted(WEIGHTS["rank"])
            phrase.before.append(self.pick(PHRASES["rank"][name]))
            phrase.conditions.append(Condition(name=name))
        if self.chance(0.3):
            said, conditions = self.adjectives(self.random.choice((1, 1, 1, 2)))
            phrase.before += said
            phrase.conditions += conditions
        if not simple and depth < MAX_DEPTH and self.chance(0.2 if depth == 1 else 0.1):
            behind = (
                self.position()
                if self.chance(0.25)
                else self.possession()
                if self.chance(0.3)
                else self.relation(depth)
            )
            phrase.behind.append(behind)
            phrase.conditions += behind.conditions
        return phrase

    # what stands behind a noun ----------------------------------------------------------------------------------------

    def relation(self, depth: int) -> Phrase:
        """A relation to an anchor: near the door; closest to the window; between the desk and the bed."""
        if self.chance(0.04):
            return self._between(depth)
        name = self.weighted(WEIGHTS["relation"])
        if self.chance(0.05) and name in ("near", "on", "under", "above", "front", "behind", "closest"):
            return self._shared_relation(name)
        built = name in PHRASES["building_anchor"] and self.chance(0.15)
        text, thing = self.anchor(depth + 1, noun=self.random.choice(PHRASES["building_anchor"][name]) if built else "")
        ordinal = 0
        said = self.pick(PHRASES["relation"][name]).format(text)
        if CONDITIONS[name].number == "may" and self.chance(0.05):
            ordinal = self.random.choice((2, 2, 3))
            said = f"{self.random.choice(ORDINALS[ordinal])} {said.removeprefix('the ').removeprefix('that is ')}"
        negated = self.chance(0.05 if CONDITIONS[name].kind == "rank" else 0.09)
        return self._phrase(said, Condition(name=name, things=(thing,), number=ordinal, negated=negated), anchored=True)

    def _shared_relation(self, name: str) -> Phrase:
        """One relation to two things: near the sofa and the window."""
        first, one = self.anchor(MAX_DEPTH, simple=True)
        second, other = self.anchor(MAX_DEPTH, simple=True)
        joined = self.random.choice(("{} and {}", "{} and {}", "both {} and {}", "{} and also {}")).format(
            first, second
        )
        said = self.pick(PHRASES["relation"][name]).format(joined)
        phrase = self._phrase(said, Condition(name=name, things=(one,)), anchored=True)
        phrase.conditions.append(Condition(name=name, things=(other,)))
        return phrase

    def _between(self, depth: int) -> Phrase:
        opening = self.random.choice(("between", "between", "in between", "right between", "that is between"))
        if self.chance(0.3):
            noun = self.plural(self.noun())
            number = self.random.choice((0, 2, 2))
            said = f"{self.random.choice(NUMBERS[2])} " if number else ""
            counted = (Condition(name="count", number=2),) if number else ()
            things: tuple[Thing, ...] = (Thing(noun=noun, conditions=counted),)
            return self._phrase(f"{opening} the {said}{noun}", Condition(name="between", things=things), anchored=True)
        first, one = self.anchor(depth + 2, simple=True)
        second, other = self.anchor(depth + 2, simple=True)
        return self._phrase(
            f"{opening} {first} and {second}", Condition(name="between", things=(one, other)), anchored=True
        )

    def position(self) -> Phrase:
        """In the corner, on the left, second from the right, by itself."""
        if self.chance(0.14):
            name = self.random.choice(("leftmost", "leftmost", "rightmost", "rightmost", "backmost", "frontmost"))
            number = self.random.choice((1, 2, 2, 2, 3, 3, 4))
            ordinal = self.pick(ORDINALS[number]) if number > 1 else self.random.choice(("first", "1st"))
            said = f"{ordinal} {self.pick(PHRASES['row_side'][name])}"
            return self._phrase(said, Condition(name=name, number=number if number > 1 else 0))
        name = self.weighted(WEIGHTS["position"])
        return self._phrase(self.pick(PHRASES["position"][name]), Condition(name=name, negated=self.chance(0.05)))

    def _phrase(self, said: str, condition: Condition, anchored: bool = False) -> Phrase:
        """The phrase after a noun with or without "that is", and after a verb."""
        relative = said.startswith("that ")
        no = self.random.choice(("not ", "not ", "NOT ")) if condition.negated else ""
        if relative:
            behind = f"that is {no}{said.removeprefix('that ').removeprefix('is ')}" if no else said
            verb = f"one {behind}" if not said.startswith("that is ") else f"{no}{said.removeprefix('that is ')}"
            return Phrase(behind, verb, [condition], anchored)
        opening = "" if self.chance(0.72) else self.random.choice(TEMPLATES["relative_clauses"])
        if said.startswith(("the ", "first", "second", "third", "fourth", "fifth", "1st", "2nd", "3rd")):
            opening = opening if opening.startswith(("that", "which")) else ""
        return Phrase(f"{opening}{no}{said}", f"{no}{said}", [condition], anchored)

    def possession(self) -> Phrase:
        """What a thing has on, in, under or beside it: with a lamp on it; that does not have a printer."""
        negated = self.chance(0.15)
        if self.chance(0.08) and not negated:
            text, thing = self.anchor(MAX_DEPTH, simple=True)
            said = self.pick(TEMPLATES["holding"]).format(text)
            return Phrase(said, f"one {said}", [Condition(name="holds", things=(thing,))])
        name = self.weighted(WEIGHTS["possession"])
        template = self.pick(PHRASES["possession"][name])
        texts, things = zip(
            *(self.anchor(MAX_DEPTH, simple=True) for _ in range(2 if self.chance(0.15) else 1)), strict=True
        )
        joined = self.random.choice((" and ", " and ", " or ") if negated else (" and ", ", and ")).join(texts)
        said = template.format(joined)
        conditions = [Condition(name=name, things=(thing,), negated=negated) for thing in things]
        without_article = said.removeprefix("the ").removeprefix("a ").removeprefix("an ")
        form = "has_not" if negated else "has"
        text = self.random.choice(TEMPLATES[form]).format(said, without_article)
        verb = self.random.choice(TEMPLATES[f"{form}_verb"]).format(said, without_article)
        return Phrase(text, "|" + verb, conditions)  # nothing stands behind its things: what follows is the target's


def thing_of(phrase: NounPhrase) -> Thing:
    """The thing that a noun phrase means."""
    return Thing(noun=phrase.noun, conditions=tuple(phrase.conditions))


def fitting_article(text: str) -> str:
    """An "a" before a vowel becomes "an"."""
    return f"an {text[2:]}" if text.startswith("a ") and text[2:3] in "aeio" else text
