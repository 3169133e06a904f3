"""Question to program by the language model: one greedy call whose grammar is the program, made for this question.

The grammar offers the question's own noun phrases, the map's own places and the relations there are, and nothing else,
so that every reply is a program. Source: METHOD section 10, step 1 ("one grammar-constrained call").
Measured with SmolLM2-135M (tests/nodes/grounding/measure.py, 106 questions): this parse and the model's choice 53,
this parse and the ranking by evidence 56, the parse by rules and the model's choice 58, the default mode 105 right.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from placegraph.nodes.grounding.llm import LanguageModel, prompt
from placegraph.nodes.grounding.parse import check_text
from placegraph.nodes.grounding.phrases import Piece, cut
from placegraph.nodes.grounding.program import SAFE, Clause, Program, Thing, enum_rule
from placegraph.nodes.grounding.relations import families, is_rank
from placegraph.nodes.grounding.words import is_plural, normal_form, tokens
from placegraph.runtime.errors import QueryError
from placegraph.runtime.scene_graph import SceneGraph

NONE, ANYTHING, FOR_A_USE = "none", "anything", "something to use"
MOST_THINGS = 24  # departs: noun phrases offered; a long question repeats itself before it names so many things
MOST_WORDS, MOST_LETTERS = 3, 32  # departs: of one noun phrase; bounds the reply
MOST_PLACES = 24  # departs: names of rooms and locations offered; a home has a dozen
MOST_CONDITIONS = 3  # departs: more in one request are rare, and each may cost the model a second
REPLY_TOKENS = 448  # the longest reply that the grammar allows is shorter (tests/nodes/grounding/test_dictate.py)
NEGATIONS = frozenset(("not", "no", "never", "without", "except", "outside", "but"))


@dataclass(frozen=True)
class Offer:
    """What a program for one question can hold: all that the grammar lets the model choose from."""

    things: dict[str, Thing] = field(default_factory=dict)  # by their words in the question
    rooms: tuple[str, ...] = ()
    floors: tuple[str, ...] = ()
    ordinals: tuple[int, ...] = ()
    negation: bool = False


def offered(text: str, graph: SceneGraph, is_place: Callable[[str], bool]) -> Offer:
    """What a program for this question in this map can hold. Raises QueryError when the text is no question."""
    check_text(text)
    pieces, words = cut(text), tokens(text)
    things = _things(pieces)
    places = [*graph.layer("room"), *graph.layer("location")]
    named = sorted({normal_form(place.tags[0].name) for place in places if place.tags})
    said = [noun for noun in dict.fromkeys(thing.noun for thing in things.values()) if is_place(noun)]
    floors = [piece.text for piece in pieces if piece.kind == "floor"]
    floors += [normal_form(floor.tags[0].name) for floor in graph.layer("floor") if floor.tags]
    return Offer(
        things=things,
        rooms=_choices([*said, *named])[:MOST_PLACES],
        floors=_choices(floors)[:MOST_PLACES],
        ordinals=tuple(sorted({piece.number for piece in pieces if piece.kind == "ordinal"})),
        negation=any(word in NEGATIONS or word.endswith("n't") for word in words),
    )


def _choices(names: Sequence[str]) -> tuple[str, ...]:
    """The names that may enter a grammar, each once, in order."""
    return tuple(name for name in dict.fromkeys(names) if SAFE.fullmatch(name) and len(name) <= MOST_LETTERS)


def _things(pieces: Sequence[Piece]) -> dict[str, Thing]:
    """Every noun phrase that the question can be read to hold, with and without its colour and size, as said."""
    found: dict[str, Thing] = {}
    things = [piece for piece in pieces if piece.kind == "thing"]
    for piece in things:
        words = piece.text.split()
        spans = [words[i : i + n] for n in range(len(words), 0, -1) for i in range(len(words) - n + 1)]
        for span in spans:
            noun = " ".join(span)
            plural = piece.plural if span[-1] == words[-1] else is_plural(noun)
            looks = [(color, size) for color in _said(piece, things, "color") for size in _said(piece, things, "size")]
            for color, size in looks:
                phrase = " ".join(word for word in (size, color, noun) if word)
                if len(span) <= MOST_WORDS and _choices([phrase]):
                    found.setdefault(phrase, Thing(noun=noun, color=color, size=size, plural=plural))
    return dict(list(found.items())[:MOST_THINGS])


def _said(piece: Piece, things: Sequence[Piece], look: str) -> list[str]:
    """A piece's own colour or size first, then none, then those said by themselves ("the mug, the blue one")."""
    alone = [getattr(thing, look) for thing in things if not thing.text]
    return list(dict.fromkeys([getattr(piece, look), "", *alone]))


def program_grammar(offer: Offer) -> str:
    """GBNF of the programs that an offer allows, as JSON. Raises QueryError when an option could break a grammar."""
    rules = [
        *([f"thing ::= {enum_rule(list(offer.things))}"] if offer.things else []),
        f"target ::= {enum_rule([*offer.things, ANYTHING, FOR_A_USE])}",
        f"room ::= {enum_rule([NONE, *offer.rooms])}",
        f"floor ::= {enum_rule([NONE, *offer.floors])}",
        *(f"{kind.rule} ::= {enum_rule(kind.relations)}" for kind in _kinds(offer)),
    ]
    root = [
        _literal(' {"target": "'), "target", _literal('", "conditions": ['),
        "(", _literal('{"relation": "none"}'), "| c )",
        _literal('], "room": "'), "room", _literal('"'), _maybe(', "outside": true') if offer.negation else "",
        _literal(', "floor": "'), "floor", _literal('"}'),
    ]  # fmt: skip
    return "\n".join([f"root ::= {' '.join(root)}", *rules, *_conditions(offer, ())])


@dataclass(frozen=True)
class _Kind:
    """Relations that are said in the same form."""

    rule: str
    relations: tuple[str, ...]
    most: int  # anchors; 1 up to so many, 0: none
    ordinal: bool


def _kinds(offer: Offer) -> list[_Kind]:
    takes = {name: family.anchors[name] for name, family in sorted(families().items())}
    forms = (
        ("rank", lambda name: takes[name][0] == 0 and is_rank(name), 0, True),
        ("stand", lambda name: takes[name] == (0, 0) and not is_rank(name), 0, False),
        ("compare", lambda name: takes[name] == (0, 1), 1, True),
        ("relate", lambda name: takes[name] == (1, 1), 1, False),
        ("join", lambda name: takes[name] == (2, 2), 2, False),
    )
    kinds = [_Kind(rule, tuple(filter(fits, takes)), most, ordinal) for rule, fits, most, ordinal in forms]
    return [kind for kind in kinds if kind.relations and (offer.things or not kind.most)]


def _conditions(offer: Offer, anchored: tuple[bool, ...]) -> list[str]:
    """Rules of one more condition, and of those after it; anchored: which of the conditions before have an anchor."""
    owners = [f"anchor {i}" for i, has in enumerate(anchored, 1) if has]
    of = _maybe(', "of": "', f"({enum_rule(owners)})", '"') if owners else ""
    ordinals = " | ".join(f'"{number}"' for number in offer.ordinals)
    negated = _maybe(', "not": true') if offer.negation else ""
    alternatives: list[str] = []
    later: dict[tuple[bool, ...], list[str]] = {}
    for kind in _kinds(offer):
        after = (*anchored, kind.most > 0)
        more = _maybe(", ", _rule(after)) if len(after) < MOST_CONDITIONS else ""
        if more and after not in later:
            later[after] = _conditions(offer, after)
        second = _maybe(', "', "thing", '"') if kind.most == 2 else ""
        anchors = [_literal(', "anchors": ["'), "thing", _literal('"'), second, _literal("]")] if kind.most else []
        ordinal = _maybe(', "ordinal": ', f"({ordinals})") if kind.ordinal and ordinals else ""
        head = [_literal('{"relation": "'), kind.rule, _literal('"')]
        alternatives.append(" ".join(filter(None, [*head, *anchors, ordinal, negated, of, _literal("}"), more])))
    return [f"{_rule(anchored)} ::= {' | '.join(alternatives)}", *(rule for rules in later.values() for rule in rules)]


def _rule(anchored: tuple[bool, ...]) -> str:
    return "c" + "".join("a" if has else "u" for has in anchored)


def _maybe(opening: str, rule: str = "", closing: str = "") -> str:
    """GBNF of a part that may be left out: two literals with a rule between them."""
    return f"( {_literal(opening)} {rule} {_literal(closing) if closing else ''} )?"


def _literal(text: str) -> str:
    return '"' + text.replace('"', '\\"') + '"'


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, strict=True, extra="forbid")


class _Condition(_Part):
    relation: str
    anchors: list[str] = []
    ordinal: int = 1
    negated: bool = Field(False, alias="not")
    of: str = ""


class _Reply(_Part):
    target: str
    conditions: list[_Condition]
    room: str
    outside: bool = False
    floor: str


def read_program(reply: str, offer: Offer, text: str) -> Program:
    """The program in a reply; text: the question. Raises QueryError for what was not offered."""
    try:
        said = _Reply.model_validate(json.loads(reply))
    except (json.JSONDecodeError, ValidationError):
        raise QueryError(f"the language model's reply is no program: {reply[:80]!r}") from None
    _expect("target", said.target, [*offer.things, ANYTHING, FOR_A_USE])
    _expect("room", said.room, [NONE, *offer.rooms])
    _expect("floor", said.floor, [NONE, *offer.floors])
    program = Program(
        target=offer.things.get(said.target, Thing()),
        clauses=tuple(_clause(said, i, offer) for i, one in enumerate(said.conditions) if one.relation != NONE),
        room="" if said.room == NONE else said.room,
        outside=said.outside and said.room != NONE,
        floor="" if said.floor == NONE else said.floor,
    )
    nothing = said.target == ANYTHING and not (program.clauses or program.room or program.floor)
    if said.target == FOR_A_USE or nothing:  # it names no thing: what it is for decides
        purpose = " ".join(word for word in tokens(text) if word[0].isalnum())
        return program.model_copy(update={"purpose": purpose})
    return program


def _clause(said: _Reply, index: int, offer: Offer) -> Clause:
    condition = said.conditions[index]
    _expect("relation", condition.relation, list(families()))
    for anchor in condition.anchors:
        _expect("anchor", anchor, list(offer.things))
    owners = [f"anchor {i}" for i, earlier in enumerate(said.conditions[:index], 1) if earlier.anchors]
    _expect("of", condition.of, ["", *owners])
    return Clause(
        relation=condition.relation,
        anchors=tuple(offer.things[anchor] for anchor in condition.anchors),
        of=int(condition.of.removeprefix("anchor ") or 0),
        ordinal=condition.ordinal,
        negated=condition.negated,
    )


def _expect(name: str, value: str, options: Sequence[str]) -> None:
    if value not in options:
        raise QueryError(f"the language model chose {value!r} for {name}; offered: {', '.join(options)}")


def dictated(model: LanguageModel, text: str, graph: SceneGraph, is_place: Callable[[str], bool]) -> Program:
    """The program of a question in this map as the model reads it. Raises QueryError."""
    offer = offered(text, graph, is_place)
    opening, rest = prompt("program", question=" ".join(tokens(text))).split("|", 1)
    reply = model.complete(rest, program_grammar(offer), REPLY_TOKENS, opening=opening).text
    return read_program(reply, offer, text)
