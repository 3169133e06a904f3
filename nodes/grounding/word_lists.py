"""The word lists of grounding, read from `words.toml`."""

from __future__ import annotations

import tomllib
from functools import cache
from importlib import resources
from typing import Any


@cache
def _words() -> dict[str, Any]:
    return tomllib.loads(resources.files(__package__).joinpath("words.toml").read_text(encoding="utf-8"))


def word_list(name: str) -> tuple[str, ...]:
    """The words or phrases of a list."""
    return tuple(_words()[name])


def word_table(name: str) -> dict[str, Any]:
    """The values of a table by word."""
    return dict(_words()[name])
