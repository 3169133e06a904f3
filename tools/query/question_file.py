"""Files of questions about maps or object lists: JSON lines in, JSON lines out, one process for all."""

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
from placegraph.runtime.query.request import make_question, parse_json_object
from placegraph.runtime.scene_graph.object_list import SourceId
from placegraph.runtime.validation import is_unicode
from placegraph.tools.query.offline_query import OfflineQuery

logger = logging.getLogger(__name__)

PARTIAL = ".partial"  # ending of the answers' file until all answers are there
FIELDS = ("object_id", "status", "error", "candidates", "evidence", "parse", "sure", "llm_calls", "ms")


@dataclass
class AnswerCounts:
    """The answers by status, and their times."""

    statuses: Counter[str] = field(default_factory=Counter)
    ms: list[float] = field(default_factory=list)

    def add(self, answer: dict[str, Any]) -> None:
        """Count one answer."""
        self.statuses[answer["status"]] += 1
        self.ms.append(answer["ms"])

    def text(self) -> str:
        """One line for people."""
        found, absent, errors = (self.statuses[status] for status in ("found", "not_in_map", "error"))
        p50, p95 = np.percentile(self.ms or [0.0], (50, 95))
        counts = f"{len(self.ms)} questions: {found} found, {absent} not in the map, {errors} errors"
        return f"{counts}; {p50:.1f} ms median, {p95:.1f} ms p95"


class LineAnswerer:
    """Answers lines of a questions' file; every line gets one answer, whatever it holds."""

    def __init__(
        self, query: OfflineQuery, folder: Path, graph: Path | None, *, k: int = 5, mode: str = "program"
    ) -> None:
        """folder: base of relative `graph` paths in lines; graph, k, mode: for lines that do not have their own."""
        self._query, self._folder, self._graph = query, folder, graph
        self._defaults = {"k": k, "mode": mode}

    def answer(self, number: int, line: bytes) -> dict[str, Any]:
        """The answer to a line; an error names its number. Raises ModelError, ConfigError: they concern all lines."""
        question_id: SourceId | None = None
        try:
            fields = parse_json_object(line, '{"id": "...", "text": "..."}')
            question_id = _id(fields)
            reply = self._ask(fields)
        except (QueryError, SchemaError) as error:
            reply = error_reply(str(error)).model_dump(mode="json")
        except (ModelError, ConfigError):
            raise
        except Exception as error:  # a bug; the other lines can still be answered
            logger.exception("line %d", number)
            reply = error_reply(f"{type(error).__name__}: {error}").model_dump(mode="json")
        if reply["status"] == "error":
            reply["error"] = f"line {number}: {reply['error']}"
        return {"question_id": question_id} | {name: reply[name] for name in FIELDS}

    def _ask(self, fields: dict[str, Any]) -> dict[str, Any]:
        if "viewpoint" in fields:  # an easy mistake; other unknown fields are the caller's own
            raise QueryError("unknown field 'viewpoint'; it is called pose")
        options = self._defaults | fields
        question = make_question(options.get("text"), k=options["k"], mode=options["mode"], pose=options.get("pose"))
        graph = fields.get("graph")
        if graph is not None and (not isinstance(graph, str) or not graph):
            raise QueryError("graph: expected the path of a map folder, a graph or an object list")
        path = self._graph if graph is None else self._folder / graph
        if path is None:
            raise QueryError("graph: expected in each line, as --graph names none")
        try:
            return self._query.ask(path, question)
        except OSError as error:  # for example a name that is too long
            raise QueryError(f"graph: {error.strerror}") from None


def _id(fields: dict[str, Any]) -> SourceId:
    line_id = fields.get("id")
    if type(line_id) is int:
        return line_id
    if not isinstance(line_id, str) or not line_id or not is_unicode(line_id):
        raise QueryError("id: expected text that is not empty, or a whole number")
    return line_id


def answer_all(answerer: LineAnswerer, questions: Path, out: Path) -> AnswerCounts:
    """Answer every line of `questions`, blank ones left out, with one line of `out` each, in the same order.

    Each answer is written at once to `out` with ".partial" behind its name, and the file is renamed when all are there:
    a run that is killed leaves its answers so far, and an older `out` stays whole until then.
    Raises QueryError when the questions cannot be read, ConfigError when the answers cannot be written.
    """
    try:
        lines = [(number, line) for number, line in enumerate(questions.read_bytes().split(b"\n"), 1) if line.strip()]
    except OSError as error:
        raise QueryError(f"{questions}: cannot read: {error.strerror}") from None
    partial, counts = out.with_name(out.name + PARTIAL), AnswerCounts()
    console = Console(stderr=True)
    try:
        with partial.open("w", encoding="utf-8") as file:
            for number, line in track(lines, "asking", console=console, disable=not console.is_terminal):
                answer = answerer.answer(number, line)
                file.write(json.dumps(answer, ensure_ascii=False, allow_nan=False) + "\n")
                file.flush()
                counts.add(answer)
        os.replace(partial, out)
    except OSError as error:
        raise ConfigError(f"{out}: cannot write: {error.strerror}") from None
    return counts
