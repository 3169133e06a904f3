"""Parse a request into a program with the language model and its adapter, constrained by the request's grammar.

The adapter is trained by tools/training/reader_training.py on exactly the prompts that are written here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

from placegraph.nodes.grounding.program import SAME_KIND, Thing
from placegraph.nodes.grounding.program_syntax import parse_program, program_grammar
from placegraph.runtime.errors import ModelError, QueryError
from placegraph.runtime.language.language_model import CompletionTruncated, LanguageModel
from placegraph.runtime.language.prompts import fill_prompt
from placegraph.runtime.language.word_forms import tokens

ADAPTER_FILE = "reader.gguf"
# What stands before and after a request.
OPENING = "<|im_start|>request\n"
CLOSING = "\nprogram:"
MAX_WORDS = 80  # with punctuation; people need 27 at most (400 requests read), training has up to 60
REPLY_TOKENS = 96  # the longest of 2,000 generated programs has 57; an endless reply costs 2 s


@dataclass(frozen=True)
class ParsedRequest:
    """The program's thing, and the probability that the model gave it (0..1)."""

    thing: Thing | None  # None: the model's output was cut off before its end
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
    """The prompt between OPENING and the model's output: the request's words as the grammar has them."""
    return " ".join(tokens(text)) + CLOSING


def model_output(program: str) -> str:
    """A program's text as the model is trained to write it."""
    return f" {program}\n"


def parse_by_model(model: LanguageModel, text: str, *, use_adapter: bool = True) -> ParsedRequest:
    """Parse a request; a program that does not end has confidence 0.

    Raises QueryError for a request without a word or with more than MAX_WORDS, and when the model has no adapter.
    """
    return _read(model, text, OPENING, use_adapter)


def parse_by_examples(model: LanguageModel, text: str) -> ParsedRequest:
    """Parse a request with examples in the prompt instead of an adapter. Raises QueryError."""
    return _read(model, text, fill_prompt(__package__, "read") + "\n", use_adapter=False)


def _read(model: LanguageModel, text: str, prefix: str, use_adapter: bool) -> ParsedRequest:
    words = len(tokens(text))
    if words > MAX_WORDS:
        raise QueryError(f"the request has {words} words and marks; at most {MAX_WORDS} are read")
    try:
        completion = model.complete(
            model_input(text), program_grammar(text), REPLY_TOKENS, prefix=prefix, use_adapter=use_adapter
        )
    except CompletionTruncated:
        return ParsedRequest(None, 0.0)
    return ParsedRequest(resolve_same_kind(parse_program(completion.text)), math.exp(completion.log_probability))


def resolve_same_kind(thing: Thing) -> Thing:
    """Give a target "one" the noun of what the viewer faces: "facing the lamps, the one on the left"."""
    facing = next(thing.conditions_named("looking"), None)
    if thing.noun != SAME_KIND or facing is None or facing.things[0].noun == SAME_KIND:
        return thing
    return thing.model_copy(update={"noun": facing.things[0].noun})
