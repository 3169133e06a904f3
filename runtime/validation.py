"""One line for data from outside that a pydantic model refuses."""

from __future__ import annotations

from pydantic import ValidationError


def first_error(error: ValidationError) -> str:
    """The first error as `objects[3].size: reason`; only the reason where the whole value is wrong."""
    first = error.errors(include_url=False)[0]
    path = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in first["loc"]).lstrip(".")
    reason = first["msg"].removeprefix("Value error, ")
    return f"{path}: {reason}" if path else reason
