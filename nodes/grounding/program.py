"""Grammars that hold the language model to options that exist, and what is read from its replies.

Source: METHOD section 10 ("every call is constrained by a grammar whose ids are an enum").
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence

from pydantic import BaseModel, ConfigDict, ValidationError

from placegraph.runtime.errors import QueryError

SAFE = re.compile(r"[a-zA-Z0-9][a-zA-Z0-9 '-]*")  # all that may enter a grammar: a malformed one kills the process


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


class _Choice(BaseModel):
    model_config = ConfigDict(frozen=True, strict=True, extra="forbid")

    fields: dict[str, str]
