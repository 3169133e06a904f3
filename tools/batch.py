"""Many questions about maps or object lists in one process: lines of JSON in, lines of JSON out (README, "Asking")."""

from __future__ import annotations

import json
import logging
import os
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import track

from placegraph.runtime.errors import ConfigError, ModelError, QueryError, SchemaError
from placegraph.runtime.query.reply import error_reply
from placegraph.runtime.query.request import MAX_BYTES, make_question
from placegraph.runtime.scene_graph.object_list import OwnId
from placegraph.tools.answerer import Answerer

logger = logging.getLogger(__name__)

PARTIAL = ".partial"  # behind the name of --out until all answers are there
FIELDS = ("object_id", "status", "error", "candidates", "evidence", "parse", "sure", "llm_calls", "ms")


@dataclass
class Tally:
    """What became of the questions."""

    statuses: Counter[str] = field(default_factory=Counter)
    ms: list[float] = field(default_factory=list)

    def add(self, answer: dict[str, Any]) -> None:
        """Count one answer."""
        self.statuses[answer["status"]] += 1
        self.ms.append(answer["ms"])

    def in_words(self) -> str:
        """One line."""
        found, absent, errors = (self.statuses[status] for status in ("found", "not_in_map", "error"))
        p50, p95 = np.percentile(self.ms or [0.0], (50, 95))
        asked = f"{len(self.ms)} questions: {found} found, {absent} not in the map, {errors} errors"
        return f"{asked}; {p50:.1f} ms median, {p95:.1f} ms p95"


class Batch:
    """Answers lines of questions; whatever a line holds, it gets one answer."""

    def __init__(
        self, answerer: Answerer, folder: Path, graph: Path | None, *, k: int = 5, mode: str = "program"
    ) -> None:
        """folder: where relative `graph` paths of lines start; graph: of lines that name none; k, mode: likewise."""
        self._answerer, self._folder, self._graph = answerer, folder, graph
        self._defaults = {"k": k, "mode": mode}

    def answer(self, number: int, line: bytes) -> dict[str, Any]:
        """The answer to a line; an error tells its number. Raises ModelError and ConfigError: no line can be asked."""
        question_id: OwnId | None = None
        try:
            fields = _fields(line)
            question_id = _id(fields)
            reply = self._ask(fields)
        except (QueryError, SchemaError) as error:
            reply = error_reply(str(error)).model_dump(mode="json")
        except (ModelError, ConfigError):
            raise
        except Exception as error:  # a bug; the other lines are still to be answered
            logger.exception("line %d", number)
            reply = error_reply(f"{type(error).__name__}: {error}").model_dump(mode="json")
        if reply["status"] == "error":
            reply["error"] = f"line {number}: {reply['error']}"
        return {"question_id": question_id} | {name: reply[name] for name in FIELDS}

    def _ask(self, fields: dict[str, Any]) -> dict[str, Any]:
        if "viewpoint" in fields:  # other fields that are not read are the caller's own
            raise QueryError("unknown field 'viewpoint'; it is called pose")
        asked = self._defaults | fields
        question = make_question(asked.get("text"), k=asked["k"], mode=asked["mode"], pose=asked.get("pose"))
        named = fields.get("graph")
        if named is not None and (not isinstance(named, str) or not named):
            raise QueryError("graph: expected the path of a map folder, a graph or an object list")
        path = self._graph if named is None else self._folder / named
        if path is None:
            raise QueryError("graph: expected in each line, as --graph names none")
        try:
            return self._answerer.ask(path, question)
        except OSError as error:  # a path that cannot be one: too long
            raise QueryError(f"graph: {error.strerror}") from None


def _fields(line: bytes) -> dict[str, Any]:
    if len(line) > MAX_BYTES:
        raise QueryError(f"{len(line)} bytes; at most {MAX_BYTES} are read")
    try:
        fields = json.loads(line.decode("utf-8-sig"))
    except UnicodeDecodeError:
        raise QueryError("not UTF-8") from None
    except (ValueError, RecursionError):
        raise QueryError('not JSON; expected {"id": "...", "text": "..."}') from None
    if not isinstance(fields, dict):
        raise QueryError(f'expected an object like {{"id": "...", "text": "..."}}, got {type(fields).__name__}')
    return fields


def _id(fields: dict[str, Any]) -> OwnId:
    own = fields.get("id")
    if type(own) is int:
        return own
    if not isinstance(own, str) or not own or any("\ud800" <= character <= "\udfff" for character in own):
        raise QueryError("id: expected text that is not empty, or a whole number")
    return own


def answer_all(batch: Batch, questions: Path, out: Path) -> Tally:
    """Answer every line of `questions`, blank ones left out, into `out`, a line each in their order.

    Each answer is written before the next question is asked, to `out` with ".partial" behind its name, which becomes
    `out` when all are there: what was answered before an end by force is kept, and an older `out` is whole until then.
    Raises QueryError when the questions cannot be read, ConfigError when the answers cannot be written.
    """
    try:
        lines = [(number, line) for number, line in enumerate(questions.read_bytes().split(b"\n"), 1) if line.strip()]
    except OSError as error:
        raise QueryError(f"{questions}: cannot read: {error.strerror}") from None
    partial, tally = out.with_name(out.name + PARTIAL), Tally()
    console = Console(stderr=True)
    try:
        with partial.open("w", encoding="utf-8") as file:
            for number, line in track(lines, "asking", console=console, disable=not console.is_terminal):
                answer = batch.answer(number, line)
                file.write(json.dumps(answer, ensure_ascii=False, allow_nan=False) + "\n")
                file.flush()
                tally.add(answer)
        os.replace(partial, out)
    except OSError as error:
        raise ConfigError(f"{out}: cannot write: {error.strerror}") from None
    return tally
