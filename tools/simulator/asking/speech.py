"""A request as a person says it: openers, word choice, politeness, order of the clauses."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from placegraph.tools.simulator.asking.names import PLURAL, Naming
from placegraph.tools.simulator.asking.request import Request
from placegraph.tools.simulator.asking.scopes import ScopeWords

UNSAID_TARGET, UNSAID_ANCHOR = 0.25, 0.06  # how often a word is one that training never says
ORDERS = (
    "find {}", "show me {}", "take me to {}", "go to {}", "lead me to {}", "guide me to {}", "point out {}",
    "look for {}", "bring me to {}", "locate {}",
)  # fmt: skip
QUESTIONS = (
    "where is {}", "can you show me {}", "could you find {}", "do you know where {} is", "can you tell me where {} is",
    "could you take me to {}", "where can I find {}", "can you find {} for me", "would you show me {}",
)  # fmt: skip
STATEMENTS = ("I'm looking for {}", "I need {}", "I want to see {}", "I can't find {}", "I'd like to go to {}", "{}")
GREETINGS = ("hey, ", "excuse me, ", "hi, ", "hello, ", "robot, ")
# Other ways to say a tail; the first words of each are those of the forms.
OTHER_WORDS: dict[str, tuple[str, ...]] = {
    "next to the": ("next to the", "beside the", "right by the", "right next to the"),
    "near the": ("near the", "close to the", "not far from the"),
    "on the": ("on the", "on the", "that is on the"),
    "under the": ("under the", "underneath the"),
    "below the": ("below the", "under the", "underneath the"),
    "above the": ("above the", "over the"),
    "closest to the": ("closest to the", "nearest to the", "nearest the"),
    "farthest from the": ("farthest from the", "furthest away from the", "furthest from the"),
    "to the left of the": ("to the left of the", "left of the", "on the left of the"),
    "to the right of the": ("to the right of the", "right of the", "on the right of the"),
    "in front of the": ("in front of the",),
    "behind the": ("behind the",),
}
OTHER_ADJECTIVES: dict[str, tuple[str, ...]] = {
    "largest": ("largest", "biggest"), "big": ("big", "larger", "bigger", "large"),
    "small": ("small", "smaller", "little"), "highest": ("highest",), "gray": ("gray", "grey"),
}  # fmt: skip

RANKS = {
    "largest": "largest", "biggest": "largest", "larger": "largest", "bigger": "largest", "smallest": "smallest",
    "smaller": "smallest", "tallest": "tallest", "highest": "highest", "lowest": "lowest",
}  # fmt: skip
ROW_ADJECTIVES = ("leftmost", "rightmost", "middle", "first", "second", "third", "fourth")


def spoken(request: Request, random: np.random.Generator) -> tuple[str, tuple[int, ...], str]:
    """A request as one sentence, the ids of all items that it is told by, and what it means as a program's text."""
    noun = _word(request.target.naming, random, UNSAID_TARGET)
    words_of_scope = fitting_words(request)
    scope = words_of_scope[int(random.integers(len(words_of_scope)))]
    words = [_word(anchor.naming, random, UNSAID_ANCHOR) for anchor in request.anchors]
    tail = _reworded(" ".join(request.tails), random).format(*words)
    adjective = request.adjective
    means = ["; ".join(request.means).format(*words)] if request.means else []
    if adjective:
        adjective = str(random.choice(OTHER_ADJECTIVES.get(adjective, (adjective,))))
        means = [*_meant(adjective), *means]
        adjective += " "
    place, ids, located = scope.text, [anchor.id for anchor in request.anchors], scope.means
    if scope.inside is not None:
        inside = _word(scope.inside.naming, random, 0.0)
        place, located = place.format(inside), tuple(one.format(inside) for one in located)
        ids.append(scope.inside.id)
    program = "; ".join([noun, *means, *located])
    return _sentence(adjective, noun, tail, place, random), tuple(dict.fromkeys(ids)), program


def _meant(adjective: str) -> tuple[str, ...]:
    """What an adjective means: a rank, or how the thing looks; places in a row say themselves what they mean."""
    if adjective in ROW_ADJECTIVES:
        return ()
    return (RANKS.get(adjective, f"is {adjective}"),)


def fitting_words(request: Request) -> tuple[ScopeWords, ...]:
    """The ways to say a request's scope that do not name an item, or a word's item, a second time."""
    told = (request.target, *request.anchors)
    return tuple(
        one
        for one in request.scope.words
        if one.inside is None
        or all(one.inside.id != other.id and one.inside.naming.kin != other.naming.kin for other in told)
    )


def _word(naming: Naming, random: np.random.Generator, unsaid: float) -> str:
    rare = bool(random.random() < unsaid)
    words: Sequence[str] = (naming.unsaid if rare else naming.said) or naming.said or naming.unsaid
    if len(words) > 1 and random.random() < 0.4:
        return words[0]  # the plain name is what people say most
    return words[int(random.integers(len(words)))]


def _reworded(tail: str, random: np.random.Generator) -> str:
    """The tail with its relation said in another way; only its first one, which begins it."""
    for known, others in OTHER_WORDS.items():
        if tail.startswith(known):
            return str(random.choice(others)) + tail[len(known) :]
    return tail


def _sentence(adjective: str, noun: str, tail: str, place: str, random: np.random.Generator) -> str:
    which = bool(not adjective and (tail or place) and random.random() < 0.15)
    fronted = bool(place and (tail or not which) and random.random() < 0.2)
    details = " ".join(part for part in (tail, "" if fronted else place) if part)
    if which:
        text = f"which {noun} {'are' if noun in PLURAL else 'is'} {details.removeprefix('that is ')}?"
    else:
        text = _opened(f"the {adjective}{noun} {details}".strip(), noun in PLURAL, random)
    if fronted:
        text = f"{place}, {text}"
    elif random.random() < 0.12:
        text = str(random.choice(GREETINGS)) + text
    if random.random() < 0.15:
        text = f"{text[:-1]}, please{text[-1]}"
    return text[0].upper() + text[1:] if random.random() < 0.75 else text.rstrip(".?")


def _opened(phrase: str, plural: bool, random: np.random.Generator) -> str:
    """A noun phrase as a question, an order or a statement, with its full stop or question mark."""
    luck = random.random()
    if luck < 0.45:
        text = str(random.choice(QUESTIONS))
        if plural:
            text = text.replace("where is", "where are").replace("{} is", "{} are")
        return text.format(phrase) + "?"
    return str(random.choice(ORDERS if luck < 0.75 else STATEMENTS)).format(phrase) + "."
