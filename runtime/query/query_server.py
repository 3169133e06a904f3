"""The server side of asking: questions that wait for their answer, at most MAX_WAITING, each with a time limit."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

from placegraph.runtime.bus.session import IncomingQuery
from placegraph.runtime.errors import QueryError
from placegraph.runtime.messages import Question
from placegraph.runtime.query.reply import error_reply, reply_json
from placegraph.runtime.query.request import parse_request, request_id

MAX_WAITING = 16  # chosen by hand: at a second an answer, the last one waits less than the time limit


@dataclass(frozen=True)
class _PendingQuestion:
    query: IncomingQuery
    question: Question
    arrived_s: float  # monotonic
    timer: threading.Timer

    def answer(self, answer_json: str) -> None:
        self.timer.cancel()
        self.query.reply(_reply_bytes(answer_json, self.arrived_s))

    def refuse(self, reason: str) -> None:
        self.answer(error_reply(reason, self.question.question_id, self.question.text).to_answer_json())


class QueryServer:
    """Turns queries into Questions. It numbers them, as two clients may choose the same question id."""

    def __init__(self, forward: Callable[[int, Question], None], timeout_s: float) -> None:
        """`forward` passes a number and its question to the node; a reply is sent within `timeout_s`."""
        self._forward, self._timeout_s = forward, timeout_s
        self._waiting: dict[int, _PendingQuestion] = {}
        self._last_number = 0
        self._closing_reason = ""
        self._lock = threading.Lock()

    def receive(self, query: IncomingQuery) -> None:
        """Forward a question to the node, or reply at once with the reason why not; runs on the bus's thread."""
        arrived_s = time.monotonic()
        with self._lock:
            self._last_number += 1
            number = self._last_number
        try:
            question = parse_request(query.payload, f"Q{number}")
        except QueryError as error:
            reply = error_reply(str(error), request_id(query.payload))
            query.reply(_reply_bytes(reply.to_answer_json(), arrived_s))
            return
        timer = threading.Timer(self._timeout_s, self._refuse, (number, f"no answer within {self._timeout_s:g} s"))
        timer.daemon = True
        pending = _PendingQuestion(query, question, arrived_s, timer)
        with self._lock:
            reason = self._closing_reason
            if not reason and len(self._waiting) >= MAX_WAITING:
                reason = f"busy: {MAX_WAITING} questions are waiting; ask again later"
            if not reason:
                self._waiting[number] = pending
        if reason:
            pending.refuse(reason)
            return
        timer.start()
        self._forward(number, question)

    def answer(self, number: int, answer_json: str) -> None:
        """Reply to a question with the node's answer; does nothing when its time limit was reached before."""
        if (pending := self._pop(number)) is not None:
            pending.answer(answer_json)

    def _refuse(self, number: int, reason: str) -> None:
        if (pending := self._pop(number)) is not None:
            pending.refuse(reason)

    def _pop(self, number: int) -> _PendingQuestion | None:
        with self._lock:
            return self._waiting.pop(number, None)

    def is_waiting(self, number: int) -> bool:
        """Whether a question still waits for its answer; after the time limit a step would be wasted."""
        with self._lock:
            return number in self._waiting

    def close(self, reason: str) -> None:
        """Reply with an error to all questions that wait, and to all that come later."""
        with self._lock:
            self._closing_reason = reason
            numbers = list(self._waiting)
        for number in numbers:
            self._refuse(number, reason)


def _reply_bytes(answer_json: str, arrived_s: float) -> bytes:
    """The reply to a query that arrived at a monotonic time."""
    return reply_json(answer_json, (time.monotonic() - arrived_s) * 1e3).encode()
