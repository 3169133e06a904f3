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


class ProgramParse(_ReplyPart):
    """The program that the question was parsed into: as text, and as the JSON of `nodes/grounding/program.py`."""

    text: str
    program: dict[str, Any]
    confidence: Score | None  # the model's; null when rules parsed the question
    reader: str  # "model" or "rules"; "" when the program was given


class LayerSelection(_ReplyPart):
    """Mode "deductive": the ids that the model kept in each layer."""

    floors: list[str] = []
    rooms: list[str] = []
    locations: list[str] = []
    targets: list[str] = []
    anchors: list[str] = []


class Reply(_ReplyPart):
    """The fields of a reply; the JSON always has all of them. `Reply.model_json_schema()` is its JSON Schema."""

    status: Literal["found", "not_in_map", "error"]
    error: str | None = None  # the reason; null unless status is "error"
    question_id: str
    question: str
    object_id: str | None = None
    name: str | None = None
    box: Annotated[list[Point], Field(min_length=2, max_length=2)] | None = None  # min and max
    center: Point | None = None
    path: list[PathStep] = []
    approach: ApproachPose | None = None
    route: list[str] = []
    travel_m: Annotated[float, Field(ge=0)] | None = None
    evidence: list[str] = []
    candidates: list[RankedObject] = []
    parse: ProgramParse | LayerSelection | None = None
    sure: bool = False
    viewpoint: ReplyViewpoint | None = None
    revision: int = -1  # of the graph that was asked; -1: there was none
    llm_calls: Annotated[int, Field(ge=0)] = 0
    ms: Annotated[float, Field(ge=0)] = 0.0  # from the request's arrival to its reply; the server sets it

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

    def to_answer_json(self) -> str:
        """The JSON of an Answer message: without `ms`, which the server sets, and `error` when there is none."""
        return _canonical(self.model_dump(mode="json", exclude={"ms"} if self.error else {"ms", "error"}))


def reply_json(answer_json: str, ms: float) -> str:
    """The reply that is sent: a node's answer with all fields, and the milliseconds since the request arrived.

    Canonical: sorted keys, no spaces; equal replies give equal bytes in UTF-8.
    """
    return _canonical({"error": None} | json.loads(answer_json) | {"ms": round(ms, 1)})


def _canonical(fields: dict[str, Any]) -> str:
    return json.dumps(fields, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False)


def error_reply(reason: str, question_id: str = "", text: str = "", revision: int = -1) -> Reply:
    """A reply that says why there is no answer."""
    return Reply(status="error", error=reason, question_id=question_id, question=text, revision=revision)
