"""Tags as text for the language model. Source: paper, "Object Grounding" (the textualised graph)."""

from __future__ import annotations

from placegraph.runtime.language.word_forms import tokens

MAX_NAME = 32  # departs: letters of a tag that are shown; a tag may be of any length


def plain(text: str, otherwise: str = "") -> str:
    """A tag as lower-case words of ASCII letters and digits: none can pose as a mark of a prompt."""
    return " ".join(word for word in tokens(text) if word[0].isalnum())[:MAX_NAME].strip() or otherwise
