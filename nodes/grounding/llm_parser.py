"""A request read into a program by the language model with its adapter, held to the grammar of that request's programs.

Source: METHOD section 10, step 1. The adapter is trained by tools/training/reader.py on the very prompts written here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

from placegraph.nodes.grounding.program import SAME_KIND, Thing
from placegraph.nodes.grounding.program_syntax import parse_program, program_grammar
from placegraph.runtime.errors import ModelError, QueryError
from placegraph.runtime.language.language_model import LanguageModel, ReplyCut, prompt
from placegraph.runtime.language.word_forms import tokens

ADAPTER_FILE = "reader.gguf"
# What stands before and after a request.
OPENING = "<|im_start|>request\n"
CLOSING = "\nprogram:"
MAX_WORDS = 80  # departs: with punctuation; people need 27 at most (400 requests read), training has up to 60
REPLY_TOKENS = 96  # departs: 57 are the most of 2,000 generated programs; a reply that does not end costs 2 s at most


@dataclass(frozen=True)
class ParsedRequest:
    """What was read, and how likely the model found just this program (0 to 1)."""

    thing: Thing | None  # None: what the model wrote did not end
    confidence: float


def default_adapter_path() -> Path:
    """The packaged adapter for the packaged language model; raises ModelError when the installation lacks it."""
    path = Path(str(resources.files(__package__))) / "embedded" / ADAPTER_FILE
    if not path.is_file():
        raise ModelError(
            f"{path}: the adapter that reads requests is not installed (`placegraph train reader` makes one)"
        )
    return path


def model_input(text: str) -> str:
    """What stands between OPENING and the reply: the request's words as the grammar knows them."""
    return " ".join(tokens(text)) + CLOSING


def model_output(program: str) -> str:
    """A program's text as the model writes it."""
    return f" {program}\n"


def parse_by_model(model: LanguageModel, text: str, *, adapted: bool = True) -> ParsedRequest:
    """The thing that a request describes.

    A program that does not end has no confidence at all. Raises QueryError for a request without a word or of over
    MAX_WORDS words, and when the model has no adapter.
    """
    return _read(model, text, OPENING, adapted)


def parse_by_examples(model: LanguageModel, text: str) -> ParsedRequest:
    """The same by the model as it comes, with examples in the prompt instead of an adapter. Raises QueryError."""
    return _read(model, text, prompt(__package__, "read") + "\n", adapted=False)


def _read(model: LanguageModel, text: str, opening: str, adapted: bool) -> ParsedRequest:
    words = len(tokens(text))
    if words > MAX_WORDS:
        raise QueryError(f"the request has {words} words and marks; at most {MAX_WORDS} are read")
    try:
        said = model.complete(model_input(text), program_grammar(text), REPLY_TOKENS, opening=opening, adapted=adapted)
    except ReplyCut:
        return ParsedRequest(None, 0.0)
    return ParsedRequest(resolve_same_kind(parse_program(said.text)), math.exp(said.log_probability))


def resolve_same_kind(thing: Thing) -> Thing:
    """A target that is called "one" gets the noun of what is looked at: "facing the lamps, the one on the left"."""
    faced = next(thing.conditions_named("looking"), None)
    if thing.noun != SAME_KIND or faced is None or faced.things[0].noun == SAME_KIND:
        return thing
    return thing.model_copy(update={"noun": faced.things[0].noun})
