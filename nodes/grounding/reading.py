"""A request read into a program by the language model, held to the grammar of the request's own programs."""

from __future__ import annotations

from dataclasses import dataclass

from placegraph.nodes.grounding.llm import LanguageModel
from placegraph.nodes.grounding.notation import grammar, read
from placegraph.nodes.grounding.schema import Thing
from placegraph.nodes.grounding.words import tokens

OPENING = "<|im_start|>request\n"
CLOSING = "\nprogram:"
REPLY_TOKENS = 160  # departs: the longest program of people read so far has 70


@dataclass(frozen=True)
class Reading:
    """What the model read, and its confidence 0..1."""

    thing: Thing
    confidence: float


def read_request(model: LanguageModel, text: str) -> Reading:
    """The thing that a request asks for. Raises QueryError when it is no request or its program is too long."""
    asked = " ".join(tokens(text)) + CLOSING
    reply = model.complete(asked, grammar(text), REPLY_TOKENS, opening=OPENING)
    return Reading(read(reply), 0.0)
