"""The word lists and phrase templates of the grammar, read from the TOML files beside this module."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any


def _read(name: str) -> dict[str, Any]:
    return tomllib.loads(Path(__file__).with_name(name).read_text("utf-8"))


WORDS: dict[str, list[str]] = _read("vocabulary.toml")
TEMPLATES: dict[str, list[str]] = _read("sentence_templates.toml")
PHRASES: dict[str, dict[str, list[str]]] = _read("relation_phrases.toml")
ENTERING: list[tuple[str, str]] = list(_read("relation_phrases.toml")["entering"].items())  # phrase, noun
WEIGHTS: dict[str, dict[str, float]] = _read("relation_phrases.toml")["weights"]  # of drawing each condition
NUMBERS = {2: ("two", "2"), 3: ("three", "3"), 4: ("four", "4"), 5: ("five", "5"), 6: ("six", "6")}
ORDINALS = {2: ("second", "2nd"), 3: ("third", "3rd"), 4: ("fourth", "4th"), 5: ("fifth", "5th")}
