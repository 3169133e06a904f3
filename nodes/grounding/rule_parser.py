"""Parse a question into a program by rules, without a language model.

The order of the phrases decides: the target precedes its relation, the anchor follows it. Of several possible targets
the last one is meant.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from placegraph.nodes.grounding.phrase_segmentation import WHOLE_MAP, Phrase, segment
from placegraph.nodes.grounding.program import ANYTHING, CONDITIONS, MAX_DEPTH, Condition, Program, Thing
from placegraph.nodes.grounding.word_lists import word_list
from placegraph.runtime.errors import QueryError
from placegraph.runtime.language.word_forms import normal_form, tokens

MAX_CHARS = 500  # a spoken request is far shorter, and more would not fit the model's context
MAX_CLAUSES = 4  # relations of one request; people say no more
ON_SPOT = ("corner", "center")  # said of the room, or "of" a thing
PURPOSE_STARTS = word_list("purpose_starts")


@dataclass(frozen=True)
class _Clause:
    """One relation as said. `of`: 0 when it belongs to the target, i when it belongs to the anchor of clause i."""

    relation: str
    anchors: tuple[Phrase, ...] = ()
    of: int = 0
    ordinal: int = 1
    negated: bool = False


@dataclass
class _ProgramDraft:
    target: Phrase | None = None
    clauses: list[_Clause] = field(default_factory=list)
    room: str = ""
    room_with: list[Phrase] = field(default_factory=list)  # "desk" in "the bedroom with the desk"
    outside: bool = False
    floor: str = ""


def check_text(text: str) -> None:
    """Raise QueryError for a text that is empty, too long, or has no word in Latin letters."""
    if not text.strip():
        raise QueryError("the question is empty")
    if len(text) > MAX_CHARS:
        raise QueryError(f"the question has {len(text)} characters; at most {MAX_CHARS} are read")
    if not any(word[0].isalpha() for word in tokens(text)):
        raise QueryError("the question holds no word in Latin letters; questions are read in English")


def parse_by_rules(text: str, is_place: Callable[[str], bool], is_known: Callable[[str], bool]) -> Program:
    """Parse a question.

    is_place: whether a phrase names a room or location; is_known: whether it names anything in the map.
    Raises QueryError when the text is no question or names nothing to look for.
    """
    check_text(text)
    phrases = [part for phrase in segment(text) for part in _split_place(phrase, is_place, is_known)]
    candidates = _without_places(phrases, is_place)
    purpose = _purpose(text)
    options = tuple(dict.fromkeys(phrase.text for phrase in candidates if phrase.text))
    known = tuple(option for option in options if is_known(option))
    if purpose and not known:
        program = _assemble(phrases, None, is_place)
        places = tuple(condition for condition in program.target.conditions if condition.kind == "place")
        use = Condition(name="for", words=purpose)
        return Program(target=Thing(noun=ANYTHING, conditions=(use, *places)))
    options = known or options
    by_noun = {option: next(phrase for phrase in candidates if phrase.text == option) for option in options}
    chosen = by_noun[options[-1]] if options else (candidates[0] if candidates else None)
    program = _assemble(phrases, chosen, is_place)
    if chosen is None and not program.target.conditions:
        raise QueryError("the question names nothing to look for")
    return program


def _without_places(phrases: list[Phrase], is_place: Callable[[str], bool]) -> list[Phrase]:
    """The phrases that may be the target. A place among other things is where to look, not what to look for."""
    candidates = _target_candidates(phrases)
    colored = [phrase for phrase in candidates if not phrase.text and phrase.color]
    named = [phrase for phrase in candidates if phrase.text]
    if colored and len(named) == 1:  # "the mug on the table, the blue one"
        named[0].color = named[0].color or colored[0].color
    others = [phrase for phrase in candidates if not is_place(phrase.text) and phrase not in colored]
    if not others or len(others) == len(candidates):
        return candidates
    for phrase in candidates:
        if phrase.text and is_place(phrase.text):
            phrase.kind = "place"
    return others


def _purpose(text: str) -> str:
    words = " ".join(word for word in tokens(text) if word[0].isalnum())
    return words if any(f" {start} " in f" {words} " for start in PURPOSE_STARTS) else ""


def _split_place(phrase: Phrase, is_place: Callable[[str], bool], is_known: Callable[[str], bool]) -> list[Phrase]:
    """Split a leading place name off a noun phrase: "kitchen table" is a table in the kitchen."""
    words = phrase.text.split()
    if phrase.kind != "thing" or len(words) < 2 or is_place(phrase.text):
        return [phrase]
    for n in range(len(words) - 1, 0, -1):
        front, noun = " ".join(words[:n]), " ".join(words[n:])
        if is_place(front) and is_known(noun):
            thing = Phrase("thing", noun, phrase.color, phrase.size, phrase.plural, words=words[n:])
            return [Phrase("place", normal_form(front)), thing]
    return [phrase]


def _anchor_counts(phrase: Phrase) -> tuple[int, int]:
    if phrase.text in ON_SPOT:
        return (1, 1) if phrase.words[-1:] == ["of"] else (0, 0)
    return CONDITIONS[phrase.text].things


def _target_candidates(phrases: list[Phrase]) -> list[Phrase]:
    """The things that are not the anchor of a relation."""
    candidates, anchors_due, is_deferred = [], 0, False
    for i, phrase in enumerate(phrases):
        if phrase.kind == "relation":
            is_deferred = _anchor_counts(phrase) == (0, 1) and not _anchor_follows(phrases, i)
            anchors_due = 0 if is_deferred else _anchor_counts(phrase)[1]
        elif phrase.kind == "break" and anchors_due != 2:
            anchors_due = 0
        elif phrase.kind == "thing" and anchors_due:
            anchors_due -= 1
        elif phrase.kind == "thing":
            candidates.append(phrase)
            # "the closest cup to the red chair": the anchor follows the noun and "to"
            anchors_due = int(is_deferred and phrases[i + 1 : i + 2] != [] and phrases[i + 1].kind == "to")
            is_deferred = False
    return candidates


def _anchor_follows(phrases: list[Phrase], i: int) -> bool:
    """Whether the thing after a "closest" is its anchor ("closest to the bed"), not its noun ("the closest chair")."""
    before = any(phrase.kind == "thing" for phrase in phrases[:i])
    after = phrases[i + 1 : i + 2]
    return before and bool(after) and after[0].kind in ("thing", "place")


def _assemble(phrases: list[Phrase], target: Phrase | None, is_place: Callable[[str], bool]) -> Program:
    """The program of the phrases, given which phrase is the target."""
    draft = _ProgramDraft(target=target)
    ordinal, negated, joined = 1, False, True
    i = 0
    while i < len(phrases):
        phrase = phrases[i]
        i += 1
        if phrase.kind == "ordinal":
            ordinal = phrase.number
        elif phrase.kind == "not":
            negated = True
        elif phrase.kind in ("and", "break"):
            joined = True
        elif phrase.kind == "floor":
            draft.floor = draft.floor or phrase.text
        elif phrase.kind == "place":
            draft.room = draft.room or phrase.text
        elif phrase.kind == "relation":
            i = _add_clause(draft, phrases, i, is_place, (ordinal, negated, joined))
            ordinal, negated, joined = 1, False, False
    if ordinal > 1:
        draft.clauses.append(_Clause("nth", ordinal=ordinal))  # "the second chair"
    thing = _thing(target, draft.clauses, 0, 1)
    places = []
    if draft.room:
        details = tuple(Condition(name="with", things=(_thing(phrase, [], 0, 1),)) for phrase in draft.room_with)
        room = Thing(noun=draft.room, conditions=details)
        places.append(Condition(name="room", things=(room,), negated=draft.outside))
    if draft.floor:
        places.append(Condition(name="floor", words=draft.floor))
    thing = thing.model_copy(update={"conditions": (*thing.conditions, *places)})
    return Program(target=thing)


def _thing(phrase: Phrase | None, clauses: list[_Clause], index: int, depth: int) -> Thing:
    """The thing of a phrase with its clauses: those of the target (index 0) or those of a clause's anchor."""
    appearance = (
        [] if phrase is None else [Condition(name="is", words=word) for word in (phrase.size, phrase.color) if word]
    )
    relations = []
    for i, clause in enumerate(clauses[:MAX_CLAUSES], 1):
        if clause.of != index or (clause.anchors and depth == MAX_DEPTH):
            continue
        things = tuple(
            _thing(anchor, clauses if k == 0 else [], i, depth + 1) for k, anchor in enumerate(clause.anchors)
        )
        counts = CONDITIONS[clause.relation].number
        number = clause.ordinal if counts == "must" or (counts == "may" and clause.ordinal > 1) else 0
        relations.append(Condition(name=clause.relation, things=things, number=number, negated=clause.negated))
    noun = phrase.text if phrase is not None and phrase.text else ANYTHING
    return Thing(noun=noun, conditions=(*appearance, *relations))


def _add_clause(
    draft: _ProgramDraft,
    phrases: list[Phrase],
    i: int,
    is_place: Callable[[str], bool],
    modifiers: tuple[int, bool, bool],
) -> int:
    """Add the relation before phrase i with the anchors that follow it; returns the index after them."""
    ordinal, negated, joined = modifiers
    relation = phrases[i - 1]
    min_anchors, max_anchors = _anchor_counts(relation)
    at_target = i < len(phrases) and phrases[i] is draft.target
    if (min_anchors, max_anchors) == (0, 1) and at_target:
        anchors, after = [], i  # "the closest chair to the window": the anchor follows the target and "to"
        if i + 2 < len(phrases) and phrases[i + 1].kind == "to" and phrases[i + 2].kind == "thing":
            anchors = [phrases[i + 2]]
            del phrases[i + 1 : i + 3]
    else:
        anchors, after = _anchors(draft, phrases, i, max_anchors)
    if len(anchors) == 1 and relation.text in ("in", "near") and anchors[0].text in WHOLE_MAP:
        return after
    if len(anchors) == 1 and relation.text in ("in", "on", "near") and is_place(anchors[0].text):
        draft.room, draft.outside = draft.room or anchors[0].text, negated
        return after
    if len(anchors) < min_anchors and relation.text not in ON_SPOT:
        return after  # a preposition that candidates nowhere: "something to sit on", "over there"
    # without "and" or a comma, a relation belongs to the noun just before it, which is the last anchor
    if relation.text == "with" and i >= 2 and phrases[i - 2].kind in ("place", "thing") and draft.room and not joined:
        before = phrases[i - 2]
        if before.kind == "place" or is_place(before.text):
            draft.room_with += anchors
            return after
    if CONDITIONS[relation.text].kind == "view":
        joined = True
    of = 0 if joined or not draft.clauses or not draft.clauses[-1].anchors else len(draft.clauses)
    if ordinal == 1 and max_anchors == 0 and not joined:
        of = 0
    draft.clauses.append(_Clause(relation.text, tuple(anchors), of, ordinal, negated))
    return after


def _anchors(draft: _ProgramDraft, phrases: list[Phrase], i: int, max_count: int) -> tuple[list[Phrase], int]:
    """The things that follow a relation directly, at most max_count, and the index after them."""
    anchors: list[Phrase] = []
    while i < len(phrases) and len(anchors) < max_count:
        phrase = phrases[i]
        if phrase.kind == "thing" and phrase is not draft.target:
            anchors.append(phrase)
        elif phrase.kind == "place":
            draft.room = draft.room or phrase.text
        elif not (phrase.kind == "to" or (phrase.kind == "and" and anchors)):
            break
        i += 1
    return anchors, i
