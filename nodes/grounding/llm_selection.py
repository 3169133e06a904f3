"""One step of the deductive mode: offer entries to a chat model, in several calls when they do not fit one.

Each reply is JSON constrained by a grammar made for the call: a short reason first (chain of thought), then ids from
those offered. Source: paper, "Selecting Related Objects" and "Object Grounding". Not as in the paper, which repairs
malformed replies with another call: with a grammar no reply is malformed.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

from placegraph.runtime.errors import QueryError
from placegraph.runtime.language.grammar_options import enum_rule
from placegraph.runtime.language.language_model import LanguageModel
from placegraph.runtime.language.prompts import fill_prompt
from placegraph.runtime.language.word_forms import tokens

# Chosen by hand.
MAX_REASON = 120  # letters of a reason, so that a rambling model does not fill the context
MAX_CHOSEN = 6  # ids of one list in one reply
MAX_CALLS = 4  # of one step; entries beyond are left out, and the evidence says so
NONE = "none"  # the choice when no entry fits


@dataclass(frozen=True)
class Entry:
    """One offered line: a node's id and its description in plain words."""

    id: str
    text: str


@dataclass
class Selection:
    """The ids chosen in one step, in order, the reasons, and how many entries were shown in how many calls."""

    targets: list[str] = field(default_factory=list)
    anchors: list[str] = field(default_factory=list)
    reasons: list[str] = field(default_factory=list)
    shown: int = 0
    calls: int = 0


class Dialogue:
    """The calls to a chat model for one question."""

    def __init__(self, model: LanguageModel, question: str) -> None:
        self._model = model
        self._question = " ".join(tokens(question))
        self._prompt_parts: dict[str, tuple[str, str, str]] = {}

    def select(self, step: str, entries: Sequence[Entry], possible: Sequence[str]) -> Selection:
        """Select targets, among the `possible` ids, and anchors among all entries. A single call selects some target.

        step: the prompt's name. Raises QueryError when not even one entry fits the context.
        """
        pages = self._pages(step, entries, _longest_selection(entries))
        selection = Selection(shown=sum(map(len, pages[:MAX_CALLS])), calls=min(len(pages), MAX_CALLS))
        for page in pages[:MAX_CALLS]:
            ids = [entry.id for entry in page]
            offered = [node_id for node_id in ids if node_id in set(possible)]
            grammar = _selection_grammar(offered, ids, min_count=1 if len(pages) == 1 else 0)
            reply = self._ask(step, page, grammar, _longest_selection(entries))
            selected = _read(reply, _Selected)
            _check(selected.targets, offered)
            _check(selected.anchors, ids)
            selection.targets += [new for new in dict.fromkeys(selected.targets) if new not in selection.targets]
            selection.anchors += [new for new in dict.fromkeys(selected.anchors) if new not in selection.anchors]
            selection.reasons.append(selected.reason.strip())
        return selection

    def fits(self, step: str, entries: Sequence[Entry]) -> bool:
        """Whether these entries fit one call of `choose`."""
        prefix, middle, suffix = self._parts(step)
        return self._model.fits(prefix, _with_entries(middle, entries), _longest_choice(entries), suffix)

    def choose(self, step: str, entries: Sequence[Entry]) -> tuple[str, str]:
        """The id of the chosen entry or "none", and the reason. Raises QueryError when the entries do not fit."""
        offered = [*(entry.id for entry in entries), NONE]
        rules = [
            f'root ::= {_opening()} {_literal(", ", "object")} "\\"" id "\\"}}"',
            _REASON,
            f"id ::= {_enum(offered)}",
        ]
        chosen = _read(self._ask(step, entries, "\n".join(rules), _longest_choice(entries)), _Chosen)
        _check([chosen.object], offered)
        return chosen.object, chosen.reason.strip()

    def _parts(self, step: str) -> tuple[str, str, str]:
        """A prompt's opening with the examples, its middle with the open field {entries}, and its closing."""
        if step not in self._prompt_parts:
            examples, middle = fill_prompt(__package__, step, question=self._question).split("|", 1)
            prefix, suffix = self._model.apply_chat_template(examples)
            self._prompt_parts[step] = prefix, middle, suffix
        return self._prompt_parts[step]

    def _ask(self, step: str, entries: Sequence[Entry], grammar: str, max_tokens: int) -> str:
        """One call of the model."""
        prefix, middle, suffix = self._parts(step)
        reply = self._model.complete(_with_entries(middle, entries), grammar, max_tokens, prefix=prefix, suffix=suffix)
        return reply.text

    def _pages(self, step: str, entries: Sequence[Entry], max_tokens: int) -> list[list[Entry]]:
        """Split the entries into lists that each fit the context, with at least one entry each."""
        prefix, middle, suffix = self._parts(step)
        pages: list[list[Entry]] = []
        for entry in entries:
            grown = [*pages[-1], entry] if pages else [entry]
            if pages and self._model.fits(prefix, _with_entries(middle, grown), max_tokens, suffix):
                pages[-1] = grown
            elif len(pages) > MAX_CALLS:
                break  # it will not be shown
            else:
                pages.append([entry])
        return pages


class _SelectionReply(BaseModel):
    model_config = ConfigDict(frozen=True, strict=True, extra="forbid")
    reason: str


ReplyModel = TypeVar("ReplyModel", bound=_SelectionReply)


class _Selected(_SelectionReply):
    targets: list[str]
    anchors: list[str]


class _Chosen(_SelectionReply):
    object: str


def _read(reply: str, model: type[ReplyModel]) -> ReplyModel:
    try:
        return model.model_validate(json.loads(reply))
    except (json.JSONDecodeError, ValidationError):
        raise QueryError(f"the language model's reply is not the JSON that was asked for: {reply[:80]!r}") from None


def _check(ids: Sequence[str], offered: Sequence[str]) -> None:
    for node_id in ids:
        if node_id not in offered:
            raise QueryError(f"the language model chose {node_id!r}, which was not offered")


def _with_entries(text: str, entries: Sequence[Entry]) -> str:
    return text.replace("{entries}", "\n".join(f"{entry.id}: {entry.text}" for entry in entries))


_REASON = f"reason ::= [a-zA-Z0-9] [a-zA-Z0-9 ,.'-]{{0,{MAX_REASON - 1}}}"  # no quote, so that it is JSON as it stands


def _selection_grammar(targets: Sequence[str], anchors: Sequence[str], min_count: int) -> str:
    root = [_opening(), _literal(", ", "targets"), "targets", _literal(", ", "anchors"), "anchors", '"}"']
    return "\n".join([
        f"root ::= {' '.join(root)}",
        _REASON,
        f"targets ::= {_list('target', min_count) if targets else _NOTHING}",
        f"anchors ::= {_list('anchor', 0)}",
        *([f"target ::= {_enum(targets)}"] if targets else []),
        f"anchor ::= {_enum(anchors)}",
    ])  # fmt: skip


_NOTHING = '"[]"'


def _opening() -> str:
    return f'{_literal("{", "reason")} "\\"" reason "\\""'


def _literal(before: str, name: str) -> str:
    return f'"{before}\\"{name}\\": "'


def _enum(ids: Sequence[str]) -> str:
    return enum_rule(list(ids))


def _list(rule: str, min_count: int) -> str:
    """GBNF of a JSON list of up to MAX_CHOSEN strings."""
    item = f'"\\"" {rule} "\\""'
    items = f'{item} (", " {item}){{0,{MAX_CHOSEN - 1}}}'
    return f'"[" {items} "]"' if min_count else f'"[" ({items})? "]"'


def _longest_selection(entries: Sequence[Entry]) -> int:
    """An upper limit of tokens for the longest selection that the grammar allows: one token per letter."""
    return (
        len('{"reason": "", "targets": [], "anchors": []}')
        + MAX_REASON
        + 2 * MAX_CHOSEN * (_max_id_length(entries) + 4)
    )


def _longest_choice(entries: Sequence[Entry]) -> int:
    return len('{"reason": "", "object": ""}') + MAX_REASON + max(_max_id_length(entries), len(NONE))


def _max_id_length(entries: Sequence[Entry]) -> int:
    return max((len(entry.id) for entry in entries), default=0)
