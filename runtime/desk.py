"""Where a process that answers questions keeps its askers: queue with a limit, a time limit, one reply to each."""

from __future__ import annotations

import threading
from collections.abc import Callable

from placegraph.runtime.bus import Request
from placegraph.runtime.errors import QueryError
from placegraph.runtime.messages import Question
from placegraph.runtime.question import error_reply, parse_request

MAX_WAITING = 16


class Desk:
    """Turns requests into Questions under a number of its own, which keeps two askers apart who chose the same id."""

    def __init__(self, forward: Callable[[int, Question], None], timeout_s: float) -> None:
        """`forward` takes a number and its question to the node; a reply is due within `timeout_s`."""
        self._forward, self._timeout_s = forward, timeout_s
        self._waiting: dict[int, tuple[Request, threading.Timer]] = {}
        self._asked = 0
        self._closed_because = ""
        self._lock = threading.Lock()

    def take(self, request: Request) -> None:
        """Forward a request, or reply at once why not; runs on the bus's thread."""
        with self._lock:
            self._asked += 1
            number = self._asked
            refusal = self._closed_because
            if not refusal and len(self._waiting) >= MAX_WAITING:
                refusal = f"busy: {MAX_WAITING} questions are waiting"
        if refusal:
            request.reply(error_reply("", refusal))
            return
        try:
            question = parse_request(request.payload, f"Q{number}")
        except QueryError as error:
            request.reply(error_reply("", str(error)))
            return
        late = error_reply(question.question_id, f"no answer within {self._timeout_s:g} s")
        timer = threading.Timer(self._timeout_s, self.answer, (number, late))
        timer.daemon = True
        with self._lock:
            self._waiting[number] = request, timer
        timer.start()
        self._forward(number, question)

    def answer(self, number: int, payload: bytes) -> None:
        """Reply to one asker; nothing happens when the reply is already out."""
        with self._lock:
            request, timer = self._waiting.pop(number, (None, None))
        if request is not None and timer is not None:
            timer.cancel()
            request.reply(payload)

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
            self.answer(number, error_reply("", reason))
