"""One step of the deductive mode: entries offered to a chat model, in as many calls as its context asks for.

Every reply is JSON by a grammar made for the call: a bounded reason first (chain of thought), then ids, of which it can
name those offered and no others. Source: paper, "Selecting Related Objects" and "Object Grounding". Departs: the paper
repairs malformed replies by another call; here none can be malformed.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

from placegraph.runtime.errors import QueryError
from placegraph.runtime.language.grammar_options import enum_rule
from placegraph.runtime.language.language_model import LanguageModel, prompt
from placegraph.runtime.language.word_forms import tokens

MAX_REASON = 120  # departs: letters of a reason; a model that does not come to a point must not fill the context
MAX_CHOSEN = 6  # departs: ids of one list in one reply
MAX_CALLS = 4  # departs: of one step; what lies beyond is left out, which the evidence says
NONE = "none"  # of what is offered at the end


@dataclass(frozen=True)
class Entry:
    """One line of what is offered: a node's id and what is said of it, in plain words."""

    id: str
    text: str


@dataclass
class Selection:
    """Ids chosen in one step, in order, why, and how many entries were shown in how many calls."""

    targets: list[str] = field(default_factory=list)
    anchors: list[str] = field(default_factory=list)
    reasons: list[str] = field(default_factory=list)
    shown: int = 0
    calls: int = 0


class Dialogue:
    """Puts the steps of one question to a chat model."""

    def __init__(self, model: LanguageModel, question: str) -> None:
        self._model = model
        self._question = " ".join(tokens(question))
        self._marks: dict[str, tuple[str, str, str]] = {}

    def select(self, step: str, entries: Sequence[Entry], possible: Sequence[str]) -> Selection:
        """Targets, of the `possible` ids, and anchors among the entries. One call names at least one target.

        step: the prompt's name. Raises QueryError when not even one entry fits the context.
        """
        pages = self._pages(step, entries, _longest_selection(entries))
        found = Selection(shown=sum(map(len, pages[:MAX_CALLS])), calls=min(len(pages), MAX_CALLS))
        for page in pages[:MAX_CALLS]:
            ids = [entry.id for entry in page]
            offered = [one for one in ids if one in set(possible)]
            grammar = _selection_grammar(offered, ids, least=1 if len(pages) == 1 else 0)
            reply = self._ask(step, page, grammar, _longest_selection(entries))
            said = _read(reply, _Selected)
            _check(said.targets, offered)
            _check(said.anchors, ids)
            found.targets += [one for one in dict.fromkeys(said.targets) if one not in found.targets]
            found.anchors += [one for one in dict.fromkeys(said.anchors) if one not in found.anchors]
            found.reasons.append(said.reason.strip())
        return found

    def fits(self, step: str, entries: Sequence[Entry]) -> bool:
        """Whether these entries can be offered in one call of `choose`."""
        opening, middle, closing = self._parts(step)
        return self._model.fits(opening, _with_entries(middle, entries), _longest_choice(entries), closing)

    def choose(self, step: str, entries: Sequence[Entry]) -> tuple[str, str]:
        """The id of the one entry that is meant or "none", and why. Raises QueryError when they do not fit."""
        offered = [*(entry.id for entry in entries), NONE]
        rules = [
            f'root ::= {_opening()} {_literal(", ", "object")} "\\"" id "\\"}}"',
            _REASON,
            f"id ::= {_enum(offered)}",
        ]
        said = _read(self._ask(step, entries, "\n".join(rules), _longest_choice(entries)), _Chosen)
        _check([said.object], offered)
        return said.object, said.reason.strip()

    def _parts(self, step: str) -> tuple[str, str, str]:
        """Opening with the examples, what is asked with its fields open, and closing of a prompt."""
        if step not in self._marks:
            examples, asked = prompt(__package__, step, question=self._question).split("|", 1)
            opening, closing = self._model.dialogue(examples)
            self._marks[step] = opening, asked, closing
        return self._marks[step]

    def _ask(self, step: str, entries: Sequence[Entry], grammar: str, longest: int) -> str:
        """The only place where this mode calls the model."""
        opening, middle, closing = self._parts(step)
        reply = self._model.complete(_with_entries(middle, entries), grammar, longest, opening=opening, closing=closing)
        return reply.text

    def _pages(self, step: str, entries: Sequence[Entry], longest: int) -> list[list[Entry]]:
        """The entries in lists that fit the context, one entry at least in each."""
        opening, middle, closing = self._parts(step)
        pages: list[list[Entry]] = []
        for entry in entries:
            grown = [*pages[-1], entry] if pages else [entry]
            if pages and self._model.fits(opening, _with_entries(middle, grown), longest, closing):
                pages[-1] = grown
            elif len(pages) > MAX_CALLS:
                break  # it will not be shown
            else:
                pages.append([entry])
        return pages


class _SelectionReply(BaseModel):
    model_config = ConfigDict(frozen=True, strict=True, extra="forbid")
    reason: str


ReplyModel = TypeVar("Form", bound=_SelectionReply)


class _Selected(_SelectionReply):
    targets: list[str]
    anchors: list[str]


class _Chosen(_SelectionReply):
    object: str


def _read(reply: str, form: type[ReplyModel]) -> ReplyModel:
    try:
        return form.model_validate(json.loads(reply))
    except (json.JSONDecodeError, ValidationError):
        raise QueryError(f"the language model's reply is not the JSON that was asked for: {reply[:80]!r}") from None


def _check(ids: Sequence[str], offered: Sequence[str]) -> None:
    for one in ids:
        if one not in offered:
            raise QueryError(f"the language model chose {one!r}, which was not offered")


def _with_entries(asked: str, entries: Sequence[Entry]) -> str:
    return asked.replace("{entries}", "\n".join(f"{entry.id}: {entry.text}" for entry in entries))


_REASON = f"reason ::= [a-zA-Z0-9] [a-zA-Z0-9 ,.'-]{{0,{MAX_REASON - 1}}}"  # no quote, so that it is JSON as it stands


def _selection_grammar(targets: Sequence[str], anchors: Sequence[str], least: int) -> str:
    root = [_opening(), _literal(", ", "targets"), "targets", _literal(", ", "anchors"), "anchors", '"}"']
    return "\n".join([
        f"root ::= {' '.join(root)}",
        _REASON,
        f"targets ::= {_list('target', least) if targets else _NOTHING}",
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


def _list(rule: str, least: int) -> str:
    """GBNF of a JSON list of up to MAX_CHOSEN strings."""
    one = f'"\\"" {rule} "\\""'
    some = f'{one} (", " {one}){{0,{MAX_CHOSEN - 1}}}'
    return f'"[" {some} "]"' if least else f'"[" ({some})? "]"'


def _longest_selection(entries: Sequence[Entry]) -> int:
    """Tokens of the longest selection that the grammar allows, at most: no token is shorter than a letter."""
    return len('{"reason": "", "targets": [], "anchors": []}') + MAX_REASON + 2 * MAX_CHOSEN * (_max_id_length(entries) + 4)


def _longest_choice(entries: Sequence[Entry]) -> int:
    return len('{"reason": "", "object": ""}') + MAX_REASON + max(_max_id_length(entries), len(NONE))


def _max_id_length(entries: Sequence[Entry]) -> int:
    return max((len(entry.id) for entry in entries), default=0)
