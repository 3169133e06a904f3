"""Tags as text for the language model. Source: paper, "Object Grounding" (the textualised graph)."""

from __future__ import annotations

from placegraph.nodes.grounding.words import tokens

MOST_NAME = 32  # departs: letters of a tag that are shown; a tag may be of any length


def plain(text: str, otherwise: str = "") -> str:
    """A tag as lower-case words of ASCII letters and digits: none can pose as a mark of a prompt."""
    return " ".join(word for word in tokens(text) if word[0].isalnum())[:MOST_NAME].strip() or otherwise
