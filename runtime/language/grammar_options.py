"""Options that the language model is held to, as a grammar's rule.

Source: METHOD section 10 ("every call is constrained by a grammar whose ids are an enum").
"""

from __future__ import annotations

import re
from collections.abc import Sequence

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
