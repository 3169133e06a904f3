"""The short text form of programs that the language model writes: parsing, formatting, and the grammar for llama.cpp.

    pillow; is blue; on (bed; leftmost); not near (lamp); closest 2 (window); floor (upstairs)

A thing is a noun and its conditions, separated by `;`; the things of one condition are separated by `,`. Nouns and
words are copied from the request, so the grammar is made anew for each request. Not JSON, which takes three times the
tokens, 10 ms each.
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
from placegraph.nodes.grounding.word_lists import word_list
from placegraph.runtime.errors import QueryError
from placegraph.runtime.language.word_forms import tokens

LEXEME = re.compile(r"\s*([;,()]|[a-z0-9'-]+)")
# No noun starts with one of these words; leaving them out halves the grammar's choices.
NEVER_FIRST = frozenset(word_list("never_first_in_a_noun"))


def parse_program(text: str) -> Thing:
    """Parse a program's text. Raises QueryError saying what was expected where."""
    lexemes, position = [], 0
    text = text.strip()
    while position < len(text):
        match = LEXEME.match(text, position)
        if match is None:
            raise QueryError(f"program {text!r}: {text[position:].lstrip()[0]!r} has no place in it")
        lexemes.append(match[1])
        position = match.end()
    parser = _Parser(text, lexemes)
    thing = parser.thing(1)
    if parser.position < len(lexemes):
        raise parser.error("the end")
    return thing


class _Parser:
    """Recursive descent over the lexemes of one program."""

    def __init__(self, text: str, lexemes: Sequence[str]) -> None:
        self.text, self.lexemes, self.position = text, lexemes, 0

    def error(self, expected: str) -> QueryError:
        next_lexemes = " ".join(self.lexemes[self.position : self.position + 3]) or "the end"
        return QueryError(f"program {self.text!r}: expected {expected}, found {next_lexemes!r}")

    def accept(self, mark: str) -> bool:
        if self.lexemes[self.position : self.position + 1] != [mark]:
            return False
        self.position += 1
        return True

    def words(self, expected: str) -> str:
        start = self.position
        while self.position < len(self.lexemes) and self.lexemes[self.position] not in ";,()":
            self.position += 1
        if start == self.position:
            raise self.error(expected)
        return " ".join(self.lexemes[start : self.position])

    def thing(self, depth: int) -> Thing:
        if depth > MAX_DEPTH:
            raise QueryError(f"program {self.text!r}: things within things more than {MAX_DEPTH} deep")
        noun, conditions = self.words("a noun"), []
        while self.accept(";"):
            conditions.append(self.condition(depth))
        return Thing(noun=noun, conditions=tuple(conditions))

    def condition(self, depth: int) -> Condition:
        negated = self.accept("not")
        name = self.lexemes[self.position] if self.position < len(self.lexemes) else ""
        form = CONDITIONS.get(name)
        if form is None:
            raise self.error("a condition")
        self.position += 1
        number, words, things = 0, "", []
        if form.words and name == "is":
            words = self.words("how it looks")
        if (
            form.number != "never"
            and self.lexemes[self.position : self.position + 1]
            and self.lexemes[self.position].isdigit()
        ):
            number = int(self.lexemes[self.position])
            self.position += 1
        if self.accept("("):
            if form.words:
                words = self.words("words")
            else:
                things.append(self.thing(depth + 1))
                while self.accept(","):
                    things.append(self.thing(depth + 1))
            if not self.accept(")"):
                raise self.error(")")
        try:
            return Condition(name=name, things=tuple(things), words=words, number=number, negated=negated)
        except ValidationError as error:
            raise QueryError(f"program {self.text!r}: {error.errors()[0]['msg']}") from None


def format_program(thing: Thing) -> str:
    """A thing as program text."""
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
    """GBNF grammar of all programs of a request: " ", a thing, a newline. Raises QueryError for a wordless text."""
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
    """The optional rest of a span: words may be copied up to the next punctuation mark."""
    following = i + 1 < len(words) and words[i + 1][0].isalnum()
    return f' (" " s{i + 1})?' if following else ""


def _rule(name: str, form: ConditionForm, depth: int) -> str:
    """GBNF of one condition at a depth; "" when its things would exceed MAX_DEPTH."""
    if name == "is":
        return '"is " said'
    if form.words:
        return f'"{name} (" said ")"'
    number = {"never": "", "may": '(" " number)?', "must": '" " number'}[form.number]
    min_things, max_things = form.things
    inner = f'" (" t{depth + 1}' + (f' (", " t{depth + 1})?' if max_things == 2 else "") + ' ")"'
    if max_things and depth == MAX_DEPTH:
        return "" if min_things else f'"{name}" {number}'
    things = "" if not max_things else inner if min_things else f"({inner})?"
    return " ".join(part for part in (f'"{name}"', number, things) if part)


def _literal(text: str) -> str:
    return f'"{text}"'
