"""The wording of a question: opener, choice of words, politeness, order of the clauses."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from placegraph.tools.simulator.question_generation import WORDS
from placegraph.tools.simulator.question_generation.class_synonyms import NameGroup
from placegraph.tools.simulator.question_generation.question_spec import QuestionSpec
from placegraph.tools.simulator.question_generation.search_scopes import ScopePhrase

HELD_OUT_TARGET_SHARE, HELD_OUT_ANCHOR_SHARE = 0.25, 0.06  # share of held-out words


def phrase_question(spec: QuestionSpec, random: np.random.Generator) -> tuple[str, tuple[int, ...], str]:
    """A question as one sentence, the ids of the items it mentions, and its meaning as program text."""
    noun = _word(spec.target.name_group, random, HELD_OUT_TARGET_SHARE)
    words_of_scope = usable_scope_phrases(spec)
    scope = words_of_scope[int(random.integers(len(words_of_scope)))]
    words = [_word(anchor.name_group, random, HELD_OUT_ANCHOR_SHARE) for anchor in spec.anchors]
    phrase = _vary_relation(" ".join(spec.phrases), random).format(*words)
    adjective = spec.adjective
    conditions = ["; ".join(spec.conditions).format(*words)] if spec.conditions else []
    if adjective:
        adjective = str(random.choice(WORDS["adjective_variants"].get(adjective, (adjective,))))
        conditions = [*_adjective_conditions(adjective), *conditions]
        adjective += " "
    place, ids, location_membership = scope.text, [anchor.id for anchor in spec.anchors], scope.conditions
    if scope.landmark is not None:
        landmark = _word(scope.landmark.name_group, random, 0.0)
        place, location_membership = (
            place.format(landmark),
            tuple(condition.format(landmark) for condition in location_membership),
        )
        ids.append(scope.landmark.id)
    program = "; ".join([noun, *conditions, *location_membership])
    return _sentence(adjective, noun, phrase, place, random), tuple(dict.fromkeys(ids)), program


def _adjective_conditions(adjective: str) -> tuple[str, ...]:
    """The program condition of an adjective: a rank or a property; none for a place in a row."""
    if adjective in WORDS["row_adjectives"]:
        return ()
    return (WORDS["adjective_ranks"].get(adjective, f"is {adjective}"),)


def usable_scope_phrases(spec: QuestionSpec) -> tuple[ScopePhrase, ...]:
    """The phrases for a question's scope that do not repeat an item or its words."""
    mentioned = (spec.target, *spec.anchors)
    return tuple(
        scope_phrase
        for scope_phrase in spec.scope.words
        if scope_phrase.landmark is None
        or all(
            scope_phrase.landmark.id != mention.id
            and scope_phrase.landmark.name_group.classes != mention.name_group.classes
            for mention in mentioned
        )
    )


def _word(name_group: NameGroup, random: np.random.Generator, held_out_words: float) -> str:
    rare = bool(random.random() < held_out_words)
    words: Sequence[str] = (
        (name_group.held_out_words if rare else name_group.training_words)
        or name_group.training_words
        or name_group.held_out_words
    )
    if len(words) > 1 and random.random() < 0.4:
        return words[0]  # the plain name is the most common
    return words[int(random.integers(len(words)))]


def _vary_relation(phrase: str, random: np.random.Generator) -> str:
    """The phrase with its leading relation said in another way."""
    for known, variants in WORDS["relation_variants"].items():
        if phrase.startswith(known):
            return str(random.choice(variants)) + phrase[len(known) :]
    return phrase


def _sentence(adjective: str, noun: str, phrase: str, place: str, random: np.random.Generator) -> str:
    which = bool(not adjective and (phrase or place) and random.random() < 0.15)
    fronted = bool(place and (phrase or not which) and random.random() < 0.2)
    details = " ".join(part for part in (phrase, "" if fronted else place) if part)
    if which:
        text = f"which {noun} {'are' if noun in WORDS['plural'] else 'is'} {details.removeprefix('that is ')}?"
    else:
        text = _add_opener(f"the {adjective}{noun} {details}".strip(), noun in WORDS["plural"], random)
    if fronted:
        text = f"{place}, {text}"
    elif random.random() < 0.12:
        text = str(random.choice(WORDS["greetings"])) + text
    if random.random() < 0.15:
        text = f"{text[:-1]}, please{text[-1]}"
    return text[0].upper() + text[1:] if random.random() < 0.75 else text.rstrip(".?")


def _add_opener(phrase: str, plural: bool, random: np.random.Generator) -> str:
    """A noun phrase as a question, a command or a statement, with its punctuation."""
    roll = random.random()
    if roll < 0.45:
        text = str(random.choice(WORDS["questions"]))
        if plural:
            text = text.replace("where is", "where are").replace("{} is", "{} are")
        return text.format(phrase) + "?"
    return str(random.choice(WORDS["commands" if roll < 0.75 else "statements"])).format(phrase) + "."
