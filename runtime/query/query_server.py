"""Where a process that answers questions keeps its askers: queue with a limit, a time limit, one reply to each."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

from placegraph.runtime.bus.session import Request
from placegraph.runtime.errors import QueryError
from placegraph.runtime.messages import Question
from placegraph.runtime.query.reply import Reply, error_reply
from placegraph.runtime.query.request import asked_id, parse_request

MAX_WAITING = 16


@dataclass(frozen=True)
class _Asker:
    request: Request
    question: Question
    since_s: float  # monotonic
    timer: threading.Timer

    def reply(self, reply: Reply) -> None:
        """Send a reply with the milliseconds since the request came."""
        self.timer.cancel()
        self.request.reply(reply.timed((time.monotonic() - self.since_s) * 1e3).to_json().encode())


class QueryServer:
    """Turns requests into Questions under a number of its own, which keeps two askers apart who chose the same id."""

    def __init__(self, forward: Callable[[int, Question], None], timeout_s: float) -> None:
        """`forward` takes a number and its question to the node; a reply is due within `timeout_s`."""
        self._forward, self._timeout_s = forward, timeout_s
        self._waiting: dict[int, _Asker] = {}
        self._asked = 0
        self._closed_because = ""
        self._lock = threading.Lock()

    def take(self, request: Request) -> None:
        """Forward a request, or reply at once why not; runs on the bus's thread."""
        began_s = time.monotonic()
        with self._lock:
            self._asked += 1
            number = self._asked
        try:
            question = parse_request(request.payload, f"Q{number}")
        except QueryError as error:
            ms = (time.monotonic() - began_s) * 1e3
            request.reply(error_reply(str(error), asked_id(request.payload)).timed(ms).to_json().encode())
            return
        timer = threading.Timer(self._timeout_s, self._refuse, (number, f"no answer within {self._timeout_s:g} s"))
        timer.daemon = True
        asker = _Asker(request, question, began_s, timer)
        with self._lock:
            reason = self._closed_because
            if not reason and len(self._waiting) >= MAX_WAITING:
                reason = f"busy: {MAX_WAITING} questions are waiting; ask again later"
            if not reason:
                self._waiting[number] = asker
        if reason:
            asker.reply(error_reply(reason, question.question_id, question.text))
            return
        timer.start()
        self._forward(number, question)

    def answer(self, number: int, answer_json: str) -> None:
        """Reply to one asker with the node's answer; nothing happens when the reply is already out."""
        with self._lock:
            asker = self._waiting.pop(number, None)
        if asker is not None:
            asker.reply(Reply.model_validate_json(answer_json))

    def _refuse(self, number: int, reason: str) -> None:
        with self._lock:
            asker = self._waiting.pop(number, None)
        if asker is not None:
            asker.reply(error_reply(reason, asker.question.question_id, asker.question.text))

    def is_waiting(self, number: int) -> bool:
        """Whether the asker of a question still waits; after the time limit nobody does, and a step would be wasted."""
        with self._lock:
            return number in self._waiting

    def close(self, reason: str) -> None:
        """Reply to everybody who still waits, and from now on to everybody who comes."""
        with self._lock:
            self._closed_because = reason
            numbers = list(self._waiting)
        for number in numbers:
            self._refuse(number, reason)
