"""The JSON that askers send and receive (README, "Asking"): request to Question message, and error replies."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from placegraph.runtime.errors import QueryError
from placegraph.runtime.messages import Question

MAX_TEXT = 500  # characters; longer is not a request but a document
MAX_CANDIDATES = 50
MAX_COORDINATE_M = 1e6  # no building is larger, and no sum of squares overflows
MODES = ("program", "rules", "deductive")  # read by the model or by phrase rules and executed; level by level
FIELDS = {"text", "id", "k", "mode", "viewpoint"}


def parse_request(payload: bytes, fallback_id: str = "") -> Question:
    """Read a request; raises QueryError naming the field that is wrong. A bare text that is no JSON is refused too."""
    try:
        request = json.loads(payload.decode("utf-8"))
    except UnicodeDecodeError:
        raise QueryError("the request is not UTF-8") from None
    except (ValueError, RecursionError):  # ValueError: also a number of thousands of digits
        raise QueryError('the request is not JSON; expected {"text": "..."}') from None
    if not isinstance(request, dict):
        raise QueryError(f'expected an object like {{"text": "..."}}, got {type(request).__name__}')
    if unknown := sorted(set(request) - FIELDS):
        raise QueryError(f"unknown field {unknown[0]!r}; there are: {', '.join(sorted(FIELDS))}")
    return make_question(
        request.get("text"),
        question_id=request.get("id", fallback_id),
        k=request.get("k", 5),
        mode=request.get("mode", MODES[0]),
        viewpoint=request.get("viewpoint"),
    )


def make_question(
    text: Any, *, question_id: Any = "", k: Any = 5, mode: Any = "program", viewpoint: Any = None
) -> Question:
    """Check every part of a question; raises QueryError."""
    if not isinstance(text, str) or not text.strip():
        raise QueryError("text: expected words that are not empty")
    if len(text) > MAX_TEXT:
        raise QueryError(f"text: at most {MAX_TEXT} characters, got {len(text)}")
    if not isinstance(question_id, str) or len(question_id) > 100:
        raise QueryError("id: expected at most 100 characters of text")
    for field, value in (("text", text), ("id", question_id)):
        if any("\ud800" <= character <= "\udfff" for character in value):  # JSON can spell them, UTF-8 cannot
            raise QueryError(f"{field}: half of a surrogate pair is no character")
    if type(k) is not int or not 1 <= k <= MAX_CANDIDATES:
        raise QueryError(f"k: expected a whole number from 1 to {MAX_CANDIDATES}")
    if mode not in MODES:
        raise QueryError(f"mode: expected one of {', '.join(MODES)}")
    return Question(
        frame_id=-1,
        stamp_ns=0,
        question_id=question_id,
        text=text.strip(),
        k=k,
        mode=mode,
        viewpoint_world=_viewpoint(viewpoint),
    )


def _viewpoint(value: Any) -> np.ndarray[Any, np.dtype[np.float64]]:
    if value is None:
        return np.full(3, np.nan)
    numbers = value if isinstance(value, (list, tuple)) else []
    if len(numbers) != 3 or not all(type(v) in (int, float) and abs(v) <= MAX_COORDINATE_M for v in numbers):
        raise QueryError("viewpoint: expected [x, y, z] in metres, world frame")
    return np.array(numbers, float)


def error_reply(question_id: str, reason: str) -> bytes:
    """The reply when there can be no answer: same shape as any other, `status` is "error"."""
    reply = {"status": "error", "question_id": question_id, "object_id": None, "box": None, "error": reason}
    return json.dumps(reply, sort_keys=True).encode()
