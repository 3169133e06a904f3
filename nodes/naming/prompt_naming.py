"""Naming by prompt, as in the paper: the language model is asked with the list of objects of a room or location.

Source: paper, "Room Layer" ("we prompt LLM with a list of object and location tags it contains") and "Location Layer".
For larger models than the packaged SmolLM2-135M, which mostly gives the first type that it is offered: by the true
lists of objects of houses 400 to 409 it names 18 of 110 rooms and 10 of 215 locations right, the evidence table 103 and
210 (tests/measurements/place_names.py).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import lru_cache

from placegraph.nodes.naming.place_contents import PlaceContents
from placegraph.runtime.language.grammar_options import enum_rule
from placegraph.runtime.language.language_model import CompletionTruncated, LanguageModel
from placegraph.runtime.language.prompts import fill_prompt, safe_name
from placegraph.runtime.scene_graph import Tag

MAX_NAME_TOKENS = 16  # of a place; a configured type that is longer is cut off and gives no name
FREE_NAME = 'root ::= word (" " word)? (" " word)?\nword ::= [a-z] [a-z]+'
MAX_CACHED_PLACES = 1024  # contents whose name is kept: the graph is rebuilt at each map, and few places have changed


class PromptNaming:
    """Names places; the same contents give the same name, and are put to the model once."""

    def __init__(
        self, model: LanguageModel, place_types: Mapping[str, Sequence[str]], *, free_names: bool = False
    ) -> None:
        """place_types: the types of each layer, room and location. free_names: the model may say other words too."""
        self._model, self._types, self._free_names = model, place_types, free_names
        self._prompt_parts: dict[str, tuple[str, str, str]] = {}  # by layer: prefix, text with open fields, suffix
        self._cached_names = lru_cache(MAX_CACHED_PLACES)(self._ask)

    def names(self, layer: str, contents: PlaceContents) -> tuple[Tag, ...]:
        """The one name that the model gives, with its probability; none for a place without a named object.

        Raises ModelError when there is no model, QueryError when its context is too small for the prompt itself.
        """
        return self._cached_names(layer, contents) if contents.objects else ()

    def _ask(self, layer: str, contents: PlaceContents) -> tuple[Tag, ...]:
        prefix, template, suffix = self._parts(layer)
        objects = sorted(contents.objects, key=lambda item: (-item[1], item[0]))
        locations = ", ".join(dict.fromkeys(map(safe_name, contents.locations)))
        while True:  # the rarest objects are left out where the context is too small for all
            listed = ", ".join(f"{count} {safe_name(name, 'object')}" for name, count in objects)
            text = template.replace("{objects}", listed)
            text = text.replace("{locations}", f"Parts of the room: {locations}\n" if locations else "")
            if len(objects) == 1 or self._model.fits(prefix, text, MAX_NAME_TOKENS, suffix):
                break
            objects.pop()
        grammar = FREE_NAME if self._free_names else f"root ::= {enum_rule(self._types[layer])}"
        try:
            completion = self._model.complete(text, grammar, MAX_NAME_TOKENS, prefix, suffix)
        except CompletionTruncated:
            return ()
        return (Tag(completion.text, math.exp(completion.log_probability)),)

    def _parts(self, layer: str) -> tuple[str, str, str]:
        if layer not in self._prompt_parts:
            types = "" if self._free_names else f"Choose one of: {', '.join(self._types[layer])}."
            shared, template = fill_prompt(__package__, f"name_{layer}", types=types).split("|", 1)
            prefix, suffix = self._model.apply_chat_template(shared)
            self._prompt_parts[layer] = prefix, template, suffix
        return self._prompt_parts[layer]
