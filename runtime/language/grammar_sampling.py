"""Sampling under a grammar: the next token is chosen among those that a GBNF grammar allows."""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np

from placegraph.runtime.arrays import F64, I64
from placegraph.runtime.errors import ModelError
from placegraph.runtime.language.llama_library import import_llama_cpp

TOKEN_DATA = np.dtype([("id", np.int32), ("logit", np.float32), ("p", np.float32)])  # llama_token_data of llama.h


class GrammarSampler:
    """Greedy choice of tokens by llama.cpp's own grammar sampler; a context manager, whose end frees it.

    The token of highest log-probability is checked alone first, and the whole vocabulary only when the grammar refuses
    it: a trained model's first choice is hardly ever refused, and checking all 49,152 tokens takes longer than the
    model itself.
    """

    def __init__(self, llama: Any, grammar: str) -> None:
        """llama: a loaded model. Raises ModelError when llama.cpp cannot read the grammar (GBNF)."""
        self._library = import_llama_cpp().llama_cpp
        self._vocabulary = self._library.llama_model_get_vocab(llama.model)
        self._sampler = self._library.llama_sampler_init_grammar(self._vocabulary, grammar.encode(), b"root")
        if not self._sampler:  # a null pointer
            raise ModelError(f"llama.cpp cannot read this grammar: {grammar}")
        self._end_token = llama.token_eos()
        self._all_tokens = np.arange(llama.n_vocab())

    def __enter__(self) -> GrammarSampler:
        return self

    def __exit__(self, *_: object) -> None:
        self._library.llama_sampler_free(self._sampler)

    def accept(self, token: int) -> None:
        """Advance the grammar past an allowed token."""
        self._library.llama_sampler_accept(self._sampler, token)

    def is_end(self, token: int) -> bool:
        """Whether the token ends the generation."""
        return bool(self._library.llama_vocab_is_eog(self._vocabulary, token))

    def is_complete(self) -> bool:
        """Whether the grammar allows nothing but the end."""
        if not len(self._allowed(np.array([self._end_token]))):
            return False
        return all(map(self.is_end, self._allowed(self._all_tokens).tolist()))

    def best_token(self, log_probabilities: F64) -> tuple[int, float]:
        """The allowed token of highest log-probability (the first of equals), and that log-probability in nats.

        log_probabilities: (V,) of the whole vocabulary. When the grammar refuses the model's first choice, the
        log-probability returned is normalised over the allowed tokens: a choice that the grammar forced is not held
        against the completion.
        """
        first_choice = int(log_probabilities.argmax())
        if len(self._allowed(np.array([first_choice]))):
            return first_choice, float(log_probabilities[first_choice])
        allowed = self._allowed(self._all_tokens)
        values = log_probabilities[allowed]
        highest = float(values.max())
        return int(allowed[values.argmax()]), -float(np.log(np.exp(values - highest).sum()))

    def _allowed(self, tokens: I64) -> I64:
        """Those of the tokens that the grammar allows next."""
        data = np.zeros(len(tokens), TOKEN_DATA)
        data["id"] = tokens
        array = self._library.llama_token_data_array(
            data=data.ctypes.data_as(self._library.llama_token_data_p), size=len(data), selected=-1, sorted=False
        )
        self._library.llama_sampler_apply(self._sampler, ctypes.byref(array))
        allowed: I64 = tokens[np.isfinite(data["logit"])]
        return allowed
