"""The typed query a question is parsed into, and the grammar that constrains what is left open in it.

Source: METHOD section 10, step 1 (target, anchors, relations, ordinals, attributes, room, floor).
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence

from pydantic import BaseModel, ConfigDict, ValidationError

from placegraph.runtime.errors import QueryError

SAFE = re.compile(r"[a-zA-Z0-9][a-zA-Z0-9 '-]*")  # all that may enter a grammar: a malformed one kills the process


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, strict=True, extra="forbid")


class Thing(_Part):
    """A noun phrase: what to look for. An empty noun stands for anything."""

    noun: str = ""
    color: str = ""
    size: str = ""  # "large" or "small"
    plural: bool = False


class Clause(_Part):
    """One condition: a thing stands in `relation` to the anchors; `of` 0: the target, i: anchor of clause i."""

    relation: str
    anchors: tuple[Thing, ...] = ()
    of: int = 0
    ordinal: int = 1
    negated: bool = False


class Program(_Part):
    """A question as conditions on one target."""

    target: Thing
    clauses: tuple[Clause, ...] = ()
    room: str = ""  # a room or location by its words or id
    outside: bool = False  # everywhere but in that room
    floor: str = ""  # "upstairs", "second floor", "floor 1", "F2", ...
    purpose: str = ""  # what the thing is for, where the question names no thing ("something to sit on")
    rest: tuple[str, ...] = ()  # content words that found no place in the program


def enum_rule(options: Sequence[str]) -> str:
    """GBNF alternatives for the quoted options; raises QueryError when one holds more than letters, digits, ` ' -`."""
    for option in options:
        if not SAFE.fullmatch(option):
            raise QueryError(f"{option!r} cannot enter a grammar: only letters, digits, spaces, ' and - may")
    if not options:
        raise QueryError("a grammar needs at least one option")
    return " | ".join(f'"{option}"' for option in options)


def object_grammar(fields: Mapping[str, Sequence[str]]) -> str:
    """GBNF of a JSON object whose fields, in order, each hold one string of their options. Raises QueryError."""
    parts, rules = [], []
    for i, (name, options) in enumerate(fields.items()):
        opening = "{" if i == 0 else ", "
        parts.append(f'"{opening}\\"{name}\\": \\"" f{i} "\\""')
        rules.append(f"f{i} ::= {enum_rule(options)}")
    return "\n".join([f'root ::= {" ".join(parts)} "}}"', *rules])


def read_choice(reply: str, fields: Mapping[str, Sequence[str]]) -> dict[str, str]:
    """The chosen option of each field from the model's JSON; raises QueryError when it is not one of those offered."""
    try:
        choice = _Choice.model_validate({"fields": json.loads(reply)}).fields
    except (json.JSONDecodeError, ValidationError):
        raise QueryError(f"the language model's reply is no JSON object of strings: {reply[:80]!r}") from None
    for name, options in fields.items():
        if choice.get(name) not in options:
            raise QueryError(f"the language model chose {choice.get(name)!r} for {name}; offered: {', '.join(options)}")
    return choice


class _Choice(_Part):
    fields: dict[str, str]
