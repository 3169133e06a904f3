"""A grammar's rule that allows only the given options, so that the language model cannot answer anything else."""

from __future__ import annotations

import re
from collections.abc import Sequence

from placegraph.runtime.errors import QueryError

# What may be put into a grammar: llama.cpp ends the whole process when a grammar is malformed.
SAFE_OPTION = re.compile(r"[a-zA-Z0-9][a-zA-Z0-9 '-]*")


def enum_rule(options: Sequence[str]) -> str:
    """GBNF alternatives for the quoted options; raises QueryError when one holds more than letters, digits, ` ' -`."""
    for option in options:
        if not SAFE_OPTION.fullmatch(option):
            raise QueryError(f"{option!r} cannot enter a grammar: only letters, digits, spaces, ' and - may")
    if not options:
        raise QueryError("a grammar needs at least one option")
    return " | ".join(f'"{option}"' for option in options)
