"""Question to program by rules: the pieces of the question put together, without a language model.

Source: METHOD section 10, step 1. Departs: a 135 M model parses one request in five, so the order of the pieces
(the target precedes its relation, the anchor follows) decides, and of several targets the last one said is meant.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from placegraph.nodes.grounding.phrase_segmentation import WHOLE_MAP, Piece, cut
from placegraph.nodes.grounding.program import ANYTHING, CONDITIONS, MAX_DEPTH, Condition, Program, Thing
from placegraph.runtime.errors import QueryError
from placegraph.runtime.language.word_forms import normal_form, tokens

MAX_CHARS = 500  # departs: a spoken request is far shorter; longer text is no question and would not fit the model
MAX_CLAUSES = 4  # departs: relations of one request; people say no more in one breath
ON_SPOT = ("corner", "center")  # said of the room, or "of" a thing
PURPOSE_STARTS = (
    "where can i", "where could i", "where do i", "where should i", "where may i", "where can we", "where do you",
    "something to", "somewhere to", "something for", "place to", "something i can", "anything to", "i want to",
    "i need to", "i would like to", "i'd like to", "i am", "i'm", "something that", "help me", "used to", "used for",
    "what can i use", "object to", "thing to", "furniture to", "want to",
)  # fmt: skip


@dataclass(frozen=True)
class _Clause:
    """One relation as it is said; `of` 0: of the target, i: of the anchor of clause i."""

    relation: str
    anchors: tuple[Piece, ...] = ()
    of: int = 0
    ordinal: int = 1
    negated: bool = False


@dataclass
class _Build:
    target: Piece | None = None
    clauses: list[_Clause] = field(default_factory=list)
    room: str = ""
    room_with: list[Piece] = field(default_factory=list)  # what tells the room: "the bedroom with the desk"
    outside: bool = False
    floor: str = ""


def check_text(text: str) -> None:
    """Raise QueryError for what is no question: empty, too long, or without an English word."""
    if not text.strip():
        raise QueryError("the question is empty")
    if len(text) > MAX_CHARS:
        raise QueryError(f"the question has {len(text)} characters; at most {MAX_CHARS} are read")
    if not any(word[0].isalpha() for word in tokens(text)):
        raise QueryError("the question holds no word in Latin letters; questions are read in English")


def draft(text: str, is_place: Callable[[str], bool], is_known: Callable[[str], bool]) -> Program:
    """Put the pieces of a question together.

    is_place: whether a phrase names a room or location; is_known: whether something in the map is called so.
    Raises QueryError when the text is no question or names nothing to look for.
    """
    check_text(text)
    pieces = [part for piece in cut(text) for part in _split_place(piece, is_place, is_known)]
    leads = _without_places(pieces, is_place)
    purpose = _purpose(text)
    options = tuple(dict.fromkeys(piece.text for piece in leads if piece.text))
    known = tuple(option for option in options if is_known(option))
    if purpose and not known:
        program = _assemble(pieces, None, is_place)
        places = tuple(one for one in program.target.conditions if one.kind == "place")
        use = Condition(name="for", words=purpose)
        return Program(target=Thing(noun=ANYTHING, conditions=(use, *places)))
    options = known or options
    by_noun = {option: next(piece for piece in leads if piece.text == option) for option in options}
    chosen = by_noun[options[-1]] if options else (leads[0] if leads else None)
    program = _assemble(pieces, chosen, is_place)
    if chosen is None and not program.target.conditions:
        raise QueryError("the question names nothing to look for")
    return program


def _without_places(pieces: list[Piece], is_place: Callable[[str], bool]) -> list[Piece]:
    """The things among which the target is; a place beside other things is where to look, not what to look for."""
    leads = _leading_things(pieces)
    colored = [piece for piece in leads if not piece.text and piece.color]
    named = [piece for piece in leads if piece.text]
    if colored and len(named) == 1:  # "the mug on the table, the blue one"
        named[0].color = named[0].color or colored[0].color
    others = [piece for piece in leads if not is_place(piece.text) and piece not in colored]
    if not others or len(others) == len(leads):
        return leads
    for piece in leads:
        if piece.text and is_place(piece.text):
            piece.kind = "place"
    return others


def _purpose(text: str) -> str:
    words = " ".join(word for word in tokens(text) if word[0].isalnum())
    return words if any(f" {start} " in f" {words} " for start in PURPOSE_STARTS) else ""


def _split_place(piece: Piece, is_place: Callable[[str], bool], is_known: Callable[[str], bool]) -> list[Piece]:
    """Take a place name off the front of a noun phrase: "kitchen table" is a table in the kitchen."""
    words = piece.text.split()
    if piece.kind != "thing" or len(words) < 2 or is_place(piece.text):
        return [piece]
    for n in range(len(words) - 1, 0, -1):
        front, noun = " ".join(words[:n]), " ".join(words[n:])
        if is_place(front) and is_known(noun):
            thing = Piece("thing", noun, piece.color, piece.size, piece.plural, words=words[n:])
            return [Piece("place", normal_form(front)), thing]
    return [piece]


def _takes(piece: Piece) -> tuple[int, int]:
    if piece.text in ON_SPOT:
        return (1, 1) if piece.words[-1:] == ["of"] else (0, 0)
    return CONDITIONS[piece.text].things


def _leading_things(pieces: list[Piece]) -> list[Piece]:
    """The things that are not the anchor of a relation: those among which the target is."""
    leads, awaited, later = [], 0, False
    for i, piece in enumerate(pieces):
        if piece.kind == "relation":
            later = _takes(piece) == (0, 1) and not _anchor_follows(pieces, i)
            awaited = 0 if later else _takes(piece)[1]
        elif piece.kind == "break" and awaited != 2:
            awaited = 0
        elif piece.kind == "thing" and awaited:
            awaited -= 1
        elif piece.kind == "thing":
            leads.append(piece)
            # "the closest cup to the red chair": the anchor stands behind the noun and "to"
            awaited = int(later and pieces[i + 1 : i + 2] != [] and pieces[i + 1].kind == "to")
            later = False
    return leads


def _anchor_follows(pieces: list[Piece], i: int) -> bool:
    """Whether the thing after a "closest" is its anchor ("closest to the bed"), not its noun ("the closest chair")."""
    before = any(piece.kind == "thing" for piece in pieces[:i])
    after = pieces[i + 1 : i + 2]
    return before and bool(after) and after[0].kind in ("thing", "place")


def _assemble(pieces: list[Piece], target: Piece | None, is_place: Callable[[str], bool]) -> Program:
    """One program from the pieces, given which thing is the target."""
    build = _Build(target=target)
    ordinal, negated, joined = 1, False, True
    i = 0
    while i < len(pieces):
        piece = pieces[i]
        i += 1
        if piece.kind == "ordinal":
            ordinal = piece.number
        elif piece.kind == "not":
            negated = True
        elif piece.kind in ("and", "break"):
            joined = True
        elif piece.kind == "floor":
            build.floor = build.floor or piece.text
        elif piece.kind == "place":
            build.room = build.room or piece.text
        elif piece.kind == "relation":
            i = _add_clause(build, pieces, i, is_place, (ordinal, negated, joined))
            ordinal, negated, joined = 1, False, False
    if ordinal > 1:
        build.clauses.append(_Clause("nth", ordinal=ordinal))  # "the second chair"
    thing = _thing(target, build.clauses, 0, 1)
    places = []
    if build.room:
        told = tuple(Condition(name="with", things=(_thing(one, [], 0, 1),)) for one in build.room_with)
        places.append(Condition(name="room", things=(Thing(noun=build.room, conditions=told),), negated=build.outside))
    if build.floor:
        places.append(Condition(name="floor", words=build.floor))
    thing = thing.model_copy(update={"conditions": (*thing.conditions, *places)})
    return Program(target=thing)


def _thing(piece: Piece | None, clauses: list[_Clause], index: int, depth: int) -> Thing:
    """A piece with its looks and the clauses said of it: those of the target (index 0) or of a clause's anchor."""
    looks = [] if piece is None else [Condition(name="is", words=word) for word in (piece.size, piece.color) if word]
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
    noun = piece.text if piece is not None and piece.text else ANYTHING
    return Thing(noun=noun, conditions=(*looks, *relations))


def _add_clause(
    build: _Build, pieces: list[Piece], i: int, is_place: Callable[[str], bool], said: tuple[int, bool, bool]
) -> int:
    """Add the relation before piece i with the anchors that follow it; returns the index after them."""
    ordinal, negated, joined = said
    relation = pieces[i - 1]
    least, most = _takes(relation)
    at_target = i < len(pieces) and pieces[i] is build.target
    if (least, most) == (0, 1) and at_target:
        anchors, after = [], i  # "the closest chair to the window": the anchor stands behind the target and "to"
        if i + 2 < len(pieces) and pieces[i + 1].kind == "to" and pieces[i + 2].kind == "thing":
            anchors = [pieces[i + 2]]
            del pieces[i + 1 : i + 3]
    else:
        anchors, after = _anchors(build, pieces, i, most)
    if len(anchors) == 1 and relation.text in ("in", "near") and anchors[0].text in WHOLE_MAP:
        return after
    if len(anchors) == 1 and relation.text in ("in", "on", "near") and is_place(anchors[0].text):
        build.room, build.outside = build.room or anchors[0].text, negated
        return after
    if len(anchors) < least and relation.text not in ON_SPOT:
        return after  # a preposition that leads nowhere: "something to sit on", "over there"
    # without "and" or a comma, a relation belongs to the noun before it: the last anchor
    if relation.text == "with" and i >= 2 and pieces[i - 2].kind in ("place", "thing") and build.room and not joined:
        before = pieces[i - 2]
        if before.kind == "place" or is_place(before.text):
            build.room_with += anchors
            return after
    if CONDITIONS[relation.text].kind == "view":
        joined = True
    of = 0 if joined or not build.clauses or not build.clauses[-1].anchors else len(build.clauses)
    if ordinal == 1 and most == 0 and not joined:
        of = 0
    build.clauses.append(_Clause(relation.text, tuple(anchors), of, ordinal, negated))
    return after


def _anchors(build: _Build, pieces: list[Piece], i: int, most: int) -> tuple[list[Piece], int]:
    """The things that follow a relation directly, at most so many, and the index after them."""
    found: list[Piece] = []
    while i < len(pieces) and len(found) < most:
        piece = pieces[i]
        if piece.kind == "thing" and piece is not build.target:
            found.append(piece)
        elif piece.kind == "place":
            build.room = build.room or piece.text
        elif not (piece.kind == "to" or (piece.kind == "and" and found)):
            break
        i += 1
    return found, i
