"""What checks of data from outside share: limits, and one line for what a pydantic model refuses."""

from __future__ import annotations

from pydantic import ValidationError

MAX_COORDINATE_M = 1e6  # no building is larger, and no sum of squares overflows; chosen by hand


def is_unicode(text: str) -> bool:
    """Whether UTF-8 can encode a text: JSON can also spell half of a surrogate pair, which is no character."""
    return not any("\ud800" <= character <= "\udfff" for character in text)


def first_error(error: ValidationError) -> str:
    """The first error as `objects[3].size: reason`; only the reason where the whole value is wrong."""
    first = error.errors(include_url=False)[0]
    path = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in first["loc"]).lstrip(".")
    reason = first["msg"].removeprefix("Value error, ").replace("Invalid JSON", "not JSON")
    return f"{path}: {reason}" if path else reason
