"""The reply to a question (docs/asking.md#reply): every reply fits `Reply`, also one that says why there is none."""

from __future__ import annotations

import json
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

Point = Annotated[list[float], Field(min_length=3, max_length=3)]  # metres, world frame
Score = Annotated[float, Field(ge=0, le=1)]


class _ReplyPart(BaseModel):
    model_config = ConfigDict(frozen=True, strict=True, extra="forbid", allow_inf_nan=False)


class PathStep(_ReplyPart):
    """One node of the path from the building to the object."""

    id: str
    layer: str
    name: str


class RankedObject(_ReplyPart):
    """One candidate with its score and the reasons for it, in sentences."""

    id: str
    name: str
    score: Score
    evidence: list[str]


class ApproachPose(_ReplyPart):
    """Where a robot can stand to face the object, and its heading."""

    position: Point
    yaw_rad: float


class ReplyViewpoint(_ReplyPart):
    """The viewpoint from which left, right, front and behind were judged."""

    source: str
    xyz: Point
    heading_rad: float | None = None


class Reply(_ReplyPart):
    """The fields of a reply, always all of them. `Reply.model_json_schema()` is its JSON Schema."""

    status: Literal["found", "not_in_map", "error"]
    error: str | None  # the reason; null unless status is "error"
    question_id: str
    question: str
    object_id: str | None
    name: str | None
    box: Annotated[list[Point], Field(min_length=2, max_length=2)] | None  # min and max
    center: Point | None
    path: list[PathStep]
    approach: ApproachPose | None
    route: list[str]
    travel_m: Annotated[float, Field(ge=0)] | None
    evidence: list[str]
    candidates: list[RankedObject]
    parse: dict[str, Any] | str | None
    sure: bool
    viewpoint: ReplyViewpoint | None
    revision: int  # of the graph that was asked; -1: there was none
    llm_calls: Annotated[int, Field(ge=0)]
    ms: Annotated[float, Field(ge=0)]  # from the request's arrival to its reply

    @model_validator(mode="after")
    def _is_consistent(self) -> Reply:
        """Raises ValueError when the fields contradict each other."""
        found = self.status == "found"
        if {found} != {value is not None for value in (self.object_id, self.name, self.box, self.center)}:
            raise ValueError("object_id, name, box and center must be set if and only if status is found")
        if (self.status == "error") != bool(self.error):
            raise ValueError("error must be set if and only if status is error")
        if not found and (self.path or self.candidates or self.route or self.approach):
            raise ValueError("what was not found has no path, candidates, route or approach")
        if found and (self.path[-1:] != [step for step in self.path if step.id == self.object_id]):
            raise ValueError("the path ends at the object")
        if found and self.object_id not in [candidate.id for candidate in self.candidates[:1]]:
            raise ValueError("the object is the first candidate")
        return self


def answered(answer: dict[str, Any], ms: float) -> dict[str, Any]:
    """The reply that carries a node's answer; `ms` since the question arrived, which no node knows."""
    return {"error": None} | answer | {"ms": round(ms, 1)}


def error_reply(reason: str, question_id: str = "", text: str = "", ms: float = 0.0) -> dict[str, Any]:
    """The reply that says why there is no answer; `ms` since the question arrived."""
    return {
        "status": "error",
        "error": reason,
        "question_id": question_id,
        "question": text,
        **dict.fromkeys(("object_id", "name", "box", "center", "approach", "travel_m", "parse", "viewpoint")),
        **{field: [] for field in ("path", "route", "evidence", "candidates")},
        "sure": False,
        "revision": -1,
        "llm_calls": 0,
        "ms": round(ms, 1),
    }


def encode_reply(reply: dict[str, Any]) -> bytes:
    """A reply as it is sent: UTF-8 JSON with sorted keys."""
    return json.dumps(reply, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False).encode()
