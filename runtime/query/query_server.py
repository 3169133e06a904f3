"""Where a process that answers questions keeps its askers: queue with a limit, a time limit, one reply to each."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

from placegraph.runtime.bus.session import Request
from placegraph.runtime.errors import QueryError
from placegraph.runtime.messages import Question
from placegraph.runtime.query.reply import error_reply, reply_json
from placegraph.runtime.query.request import asked_id, parse_request

MAX_WAITING = 16


@dataclass(frozen=True)
class _Asker:
    request: Request
    question: Question
    since_s: float  # monotonic
    timer: threading.Timer

    def reply(self, answer_json: str) -> None:
        """Send an answer with the milliseconds since the request came."""
        self.timer.cancel()
        self.request.reply(reply_json(answer_json, (time.monotonic() - self.since_s) * 1e3).encode())

    def refuse(self, reason: str) -> None:
        """Send the reason why there is no answer."""
        self.reply(error_reply(reason, self.question.question_id, self.question.text).to_answer_json())


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
            reply = error_reply(str(error), asked_id(request.payload))
            request.reply(reply_json(reply.to_answer_json(), ms).encode())
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
            asker.refuse(reason)
            return
        timer.start()
        self._forward(number, question)

    def answer(self, number: int, answer_json: str) -> None:
        """Reply to one asker with the node's answer; nothing happens when the reply is already out."""
        with self._lock:
            asker = self._waiting.pop(number, None)
        if asker is not None:
            asker.reply(answer_json)

    def _refuse(self, number: int, reason: str) -> None:
        with self._lock:
            asker = self._waiting.pop(number, None)
        if asker is not None:
            asker.refuse(reason)

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
