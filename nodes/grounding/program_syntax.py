"""The short text form of a program that the language model writes: read, written, and the grammar that allows no other.

    pillow; is blue; on (bed; leftmost); not near (lamp); closest 2 (window); floor (upstairs)

A thing is its noun and its conditions with `;` between them; things of one condition have `,` between them. Nouns and
words are copied from the request, so the grammar is made for each request from its own words.
Departs: JSON says the same in three times the tokens, and each costs 10 ms and some of a small model's attention.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from pydantic import ValidationError

from placegraph.nodes.grounding.program import (
    ANYTHING,
    CONDITIONS,
    MAX_CONDITIONS,
    MAX_DEPTH,
    SAME_KIND,
    Condition,
    ConditionForm,
    Thing,
)
from placegraph.runtime.errors import QueryError
from placegraph.runtime.language.word_forms import tokens

LEXEME = re.compile(r"\s*([;,()]|[a-z0-9'-]+)")
# No noun starts with these; without them the grammar's choices are half as many.
NEVER_FIRST = frozenset(
    ("the", "a", "an", "is", "are", "was", "be", "of", "to", "and", "or", "in", "on", "at", "it", "its", "this", "that",
     "these", "those", "which", "who", "with", "by", "for", "from", "as", "your", "you", "i", "my", "me", "we", "our",
     "they", "their", "them", "than", "then", "so", "if", "when", "there")
)  # fmt: skip


def parse_program(text: str) -> Thing:
    """A program's text as a thing; raises QueryError saying what was expected where."""
    lexemes, at = [], 0
    text = text.strip()
    while at < len(text):
        match = LEXEME.match(text, at)
        if match is None:
            raise QueryError(f"program {text!r}: {text[at:].lstrip()[0]!r} has no place in it")
        lexemes.append(match[1])
        at = match.end()
    reader = _Reader(text, lexemes)
    thing = reader.thing(1)
    if reader.at < len(lexemes):
        raise reader.error("the end")
    return thing


class _Reader:
    """Recursive descent over the lexemes of one program."""

    def __init__(self, text: str, lexemes: Sequence[str]) -> None:
        self.text, self.lexemes, self.at = text, lexemes, 0

    def error(self, expected: str) -> QueryError:
        found = " ".join(self.lexemes[self.at : self.at + 3]) or "the end"
        return QueryError(f"program {self.text!r}: expected {expected}, found {found!r}")

    def accept(self, mark: str) -> bool:
        if self.lexemes[self.at : self.at + 1] != [mark]:
            return False
        self.at += 1
        return True

    def words(self, expected: str) -> str:
        start = self.at
        while self.at < len(self.lexemes) and self.lexemes[self.at] not in ";,()":
            self.at += 1
        if start == self.at:
            raise self.error(expected)
        return " ".join(self.lexemes[start : self.at])

    def thing(self, depth: int) -> Thing:
        if depth > MAX_DEPTH:
            raise QueryError(f"program {self.text!r}: things within things more than {MAX_DEPTH} deep")
        noun, conditions = self.words("a noun"), []
        while self.accept(";"):
            conditions.append(self.condition(depth))
        return Thing(noun=noun, conditions=tuple(conditions))

    def condition(self, depth: int) -> Condition:
        negated = self.accept("not")
        name = self.lexemes[self.at] if self.at < len(self.lexemes) else ""
        form = CONDITIONS.get(name)
        if form is None:
            raise self.error("a condition")
        self.at += 1
        number, said, things = 0, "", []
        if form.words and name == "is":
            said = self.words("how it looks")
        if form.number != "never" and self.lexemes[self.at : self.at + 1] and self.lexemes[self.at].isdigit():
            number = int(self.lexemes[self.at])
            self.at += 1
        if self.accept("("):
            if form.words:
                said = self.words("words")
            else:
                things.append(self.thing(depth + 1))
                while self.accept(","):
                    things.append(self.thing(depth + 1))
            if not self.accept(")"):
                raise self.error(")")
        try:
            return Condition(name=name, things=tuple(things), words=said, number=number, negated=negated)
        except ValidationError as error:
            raise QueryError(f"program {self.text!r}: {error.errors()[0]['msg']}") from None


def format_program(thing: Thing) -> str:
    """A thing as a program's text."""
    return "; ".join([thing.noun or ANYTHING, *map(_condition, thing.conditions)])


def _condition(condition: Condition) -> str:
    parts = ["not"] if condition.negated else []
    parts.append(condition.name)
    if condition.name == "is":
        parts.append(condition.words)
    elif condition.words:
        parts.append(f"({condition.words})")
    if condition.number and not (condition.number == 1 and CONDITIONS[condition.name].number == "may"):
        parts.append(str(condition.number))
    if condition.things:
        parts.append(f"({', '.join(map(format_program, condition.things))})")
    return " ".join(parts)


def program_grammar(text: str) -> str:
    """GBNF of all programs of a request: " ", a thing, a newline. Raises QueryError when the request has no word."""
    words = tokens(text)
    spans = [f's{i} ::= "{word}"' + _onward(words, i) for i, word in enumerate(words) if word[0].isalnum()]
    if not spans:
        raise QueryError("the request holds no word in Latin letters; requests are read in English")
    starts = [i for i, word in enumerate(words) if word[0].isalnum() and word not in NEVER_FIRST]
    anywhere = [i for i, word in enumerate(words) if word[0].isalnum()]
    rules = [
        'root ::= " " t1 "\\n"',
        f"noun ::= {' | '.join([f's{i}' for i in starts] + [_literal(ANYTHING), _literal(SAME_KIND)])}",
        f"said ::= {' | '.join(f's{i}' for i in starts or anywhere)}",
        "number ::= [1-9]",
        *spans,
    ]
    for depth in range(1, MAX_DEPTH + 1):
        rules.append(f't{depth} ::= noun ("; " ("not ")? c{depth}){{0,{MAX_CONDITIONS}}}')
        names = [name for name in CONDITIONS if depth == 1 or CONDITIONS[name].kind not in ("view", "purpose")]
        options = [_rule(name, CONDITIONS[name], depth) for name in names]
        rules.append(f"c{depth} ::= {' | '.join(option for option in options if option)}")
    return "\n".join(rules)


def _onward(words: Sequence[str], i: int) -> str:
    """The rest of a span: what is between two marks may be copied as far as one likes."""
    following = i + 1 < len(words) and words[i + 1][0].isalnum()
    return f' (" " s{i + 1})?' if following else ""


def _rule(name: str, form: ConditionForm, depth: int) -> str:
    """GBNF of one condition at a depth; "" where its things would lie too deep."""
    if name == "is":
        return '"is " said'
    if form.words:
        return f'"{name} (" said ")"'
    number = {"never": "", "may": '(" " number)?', "must": '" " number'}[form.number]
    least, most = form.things
    inner = f'" (" t{depth + 1}' + (f' (", " t{depth + 1})?' if most == 2 else "") + ' ")"'
    if most and depth == MAX_DEPTH:
        return "" if least else f'"{name}" {number}'
    things = "" if not most else inner if least else f"({inner})?"
    return " ".join(part for part in (f'"{name}"', number, things) if part)


def _literal(text: str) -> str:
    return f'"{text}"'
