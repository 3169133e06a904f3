"""What clients send (docs/asking.md#request): a JSON object, checked against `QuestionRequest`, becomes a Question."""

from __future__ import annotations

import json
import math
import reprlib
from typing import Annotated, Any, Literal, get_args

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, StringConstraints, ValidationError

from placegraph.runtime.errors import QueryError
from placegraph.runtime.messages import Question
from placegraph.runtime.validation import MAX_COORDINATE_M

MAX_BYTES = 65_536  # of a request; more is refused unread
# all chosen by hand
MAX_TEXT = 500  # characters; longer is not a question but a document
MAX_ID = 100  # characters
MAX_CANDIDATES = 50
# parsed by the language model, by phrase rules, or asked of the model level by level
Mode = Literal["program", "rules", "deductive"]
MODES: tuple[str, ...] = get_args(Mode)

Number = Annotated[float, Field(ge=-MAX_COORDINATE_M, le=MAX_COORDINATE_M, allow_inf_nan=False)]


class QuestionRequest(BaseModel):
    """The fields of a request; each description says what is expected. `model_json_schema()` is its JSON Schema."""

    model_config = ConfigDict(frozen=True, strict=True, extra="forbid")

    text: Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=MAX_TEXT)] = Field(
        description=f"words, not empty, at most {MAX_TEXT} characters"
    )
    id: Annotated[str, StringConstraints(max_length=MAX_ID)] = Field(
        default="", description=f"at most {MAX_ID} characters of text"
    )
    pose: Annotated[list[Number], Field(min_length=3, max_length=4)] | None = Field(
        default=None, description="[x, y, z] or [x, y, z, yaw]: metres and radians, world frame, finite"
    )
    k: int = Field(default=5, ge=1, le=MAX_CANDIDATES, description=f"a whole number from 1 to {MAX_CANDIDATES}")
    mode: Mode = Field(default="program", description=f"one of {', '.join(MODES)}")


REQUEST_FIELDS = tuple(QuestionRequest.model_fields)


def parse_request(payload: bytes, fallback_id: str = "") -> Question:
    """Read a request; raises QueryError naming what is wrong. `fallback_id`: for a request without an id."""
    return to_question({"id": fallback_id} | parse_json_object(payload, '{"text": "..."}'))


def parse_json_object(payload: bytes, example: str) -> dict[str, Any]:
    """The JSON object in at most MAX_BYTES of UTF-8; raises QueryError, which shows the example."""
    if len(payload) > MAX_BYTES:
        raise QueryError(f"has {len(payload)} bytes; at most {MAX_BYTES} are read")
    try:
        fields = json.loads(payload.decode("utf-8-sig"))  # -sig: some editors write a byte order mark first
    except UnicodeDecodeError:
        raise QueryError("not UTF-8") from None
    except (ValueError, RecursionError):  # ValueError: also a number of thousands of digits
        raise QueryError(f"not JSON; expected {example}") from None
    if not isinstance(fields, dict):
        raise QueryError(f"expected an object like {example}, got {type(fields).__name__}")
    return fields


def request_id(payload: bytes) -> str:
    """The id in a request whose other fields may be wrong; "" when there is none that could be sent back."""
    try:
        return QuestionRequest(text="-", id=parse_json_object(payload, "").get("id", "")).id
    except (QueryError, ValidationError):
        return ""


def make_question(text: Any, *, question_id: Any = "", k: Any = 5, mode: Any = "program", pose: Any = None) -> Question:
    """Make a Question; raises QueryError naming the field that is wrong. pose: as in `QuestionRequest`."""
    return to_question({"text": text, "id": question_id, "k": k, "mode": mode, "pose": pose})


def to_question(request: dict[str, Any]) -> Question:
    """The Question of a request's fields; raises QueryError naming the field that is wrong."""
    for field in sorted(set(request) - set(REQUEST_FIELDS)):
        hint = "it is called pose" if field == "viewpoint" else f"there are: {', '.join(sorted(REQUEST_FIELDS))}"
        raise QueryError(f"unknown field {_shown(field)}; {hint}")
    try:
        checked = QuestionRequest.model_validate(request)
    except ValidationError as error:
        raise QueryError(_reason(error)) from None
    pose = [*(checked.pose or ()), math.nan, math.nan, math.nan, math.nan]
    x, y, z, yaw_rad = pose[:4]
    return Question(
        frame_id=-1,
        stamp_ns=0,
        question_id=checked.id,
        text=checked.text,
        k=checked.k,
        mode=checked.mode,
        viewpoint_world=np.array([x, y, z]),
        heading_rad=yaw_rad,
    )


def _reason(error: ValidationError) -> str:
    first = error.errors(include_url=False)[0]
    field = str(first["loc"][0])
    expected = f"{field}: expected {QuestionRequest.model_fields[field].description}"
    if first["type"] == "missing":
        return expected
    if first["type"] == "string_too_long":
        return f"{expected}, got {len(first['input'])}"
    if first["type"] == "string_unicode":  # JSON can spell half of a surrogate pair, UTF-8 cannot
        return f"{expected}, got half of a surrogate pair, which is no character"
    return f"{expected}, got {_shown(first['input'])}"


def _shown(value: object) -> str:
    """The start of a value, for messages; half a surrogate pair, which UTF-8 cannot encode, as its number."""
    return reprlib.repr(value).encode("utf-8", "backslashreplace").decode()
