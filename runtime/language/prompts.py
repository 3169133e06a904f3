"""Prompts for the language model: text files with fields to fill in, and tags made safe to stand in them."""

from __future__ import annotations

from importlib import resources

from placegraph.runtime.language.word_forms import tokens

MAX_NAME_LENGTH = 32  # characters of a tag that a prompt shows; chosen by hand, since a tag may be of any length


def fill_prompt(package: str | None, name: str, **values: str) -> str:
    """The text of `prompts/<name>.txt` of a package with each {field} replaced by its value."""
    text = resources.files(package or "").joinpath("prompts", f"{name}.txt").read_text(encoding="utf-8").rstrip("\n")
    for field, value in values.items():
        text = text.replace("{" + field + "}", value)
    return text


def safe_name(tag: str, default: str = "") -> str:
    """A tag as lower-case words of ASCII letters and digits, so that it cannot imitate a special token of a prompt."""
    words = " ".join(word for word in tokens(tag) if word[0].isalnum())
    return words[:MAX_NAME_LENGTH].strip() or default
