"""llama.cpp itself: its import made safe, and what a grammar allows next."""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np

from placegraph.runtime.arrays import F64, I64
from placegraph.runtime.errors import ModelError

TOKEN_DATA = np.dtype([("id", np.int32), ("logit", np.float32), ("p", np.float32)])  # llama.h


def safe_llama_cpp() -> Any:
    """llama_cpp with its AMX buffers off: its AMX kernels crash on Sapphire Rapids (llama.cpp issue 20824)."""
    import llama_cpp

    inner = llama_cpp.llama_cpp
    if not getattr(inner.llama_model_default_params, "without_amx", False):
        default = inner.llama_model_default_params

        def without_extra_buffers() -> Any:
            params = default()
            params.use_extra_bufts = False
            return params

        without_extra_buffers.without_amx = True  # type: ignore[attr-defined]
        inner.llama_model_default_params = llama_cpp.llama_model_default_params = without_extra_buffers
    return llama_cpp


class Allowed:
    """What a grammar allows next, by llama.cpp's own grammar sampler.

    The model's favourite is tried alone, and the whole vocabulary only when the grammar refuses that one: a trained
    model is hardly ever refused, and trying all 49,152 tokens takes longer than the model itself.
    """

    def __init__(self, llama: Any, grammar: str) -> None:
        """llama: a loaded model. Raises ModelError when llama.cpp cannot read the grammar (GBNF)."""
        self._inner = safe_llama_cpp().llama_cpp
        self._vocabulary = self._inner.llama_model_get_vocab(llama.model)
        self._sampler = self._inner.llama_sampler_init_grammar(self._vocabulary, grammar.encode(), b"root")
        if not self._sampler:  # a pointer
            raise ModelError(f"llama.cpp cannot read this grammar: {grammar}")
        self._end = llama.token_eos()
        self._all = np.arange(llama.n_vocab())

    def __enter__(self) -> Allowed:
        return self

    def __exit__(self, *_: object) -> None:
        self._inner.llama_sampler_free(self._sampler)

    def accept(self, token: int) -> None:
        """Go on behind a token that is allowed."""
        self._inner.llama_sampler_accept(self._sampler, token)

    def is_end(self, token: int) -> bool:
        """Whether the token ends what is written."""
        return bool(self._inner.llama_vocab_is_eog(self._vocabulary, token))

    def ended(self) -> bool:
        """Whether only the end may follow."""
        return len(self._among(np.array([self._end]))) > 0 and all(map(self.is_end, self._among(self._all).tolist()))

    def best(self, values: F64) -> tuple[int, float]:
        """The allowed token of highest log-probability, the first of equals, and that log-probability.

        Where the favourite of all is not allowed it is that among the allowed ones: who is held back is not in doubt.
        """
        favourite = int(values.argmax())
        if len(self._among(np.array([favourite]))):
            return favourite, float(values[favourite])
        allowed = self._among(self._all)
        among = values[allowed]
        highest = float(among.max())
        return int(allowed[among.argmax()]), -float(np.log(np.exp(among - highest).sum()))

    def _among(self, tokens: I64) -> I64:
        """Those of the tokens that the grammar allows next."""
        data = np.zeros(len(tokens), TOKEN_DATA)
        data["id"] = tokens
        array = self._inner.llama_token_data_array(
            data=data.ctypes.data_as(self._inner.llama_token_data_p), size=len(data), selected=-1, sorted=False
        )
        self._inner.llama_sampler_apply(self._sampler, ctypes.byref(array))
        allowed: I64 = tokens[np.isfinite(data["logit"])]
        return allowed
