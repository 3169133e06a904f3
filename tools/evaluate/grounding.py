"""Questions of a house asked of its map: how often the box of the answer is the right one."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from placegraph.runtime.arrays import F64
from placegraph.runtime.errors import SourceError
from placegraph.runtime.query.request import make_question
from placegraph.runtime.vision.geometry import box_iou
from placegraph.tools.answerer import Answerer
from placegraph.tools.evaluate.places import share
from placegraph.tools.simulator.questions import AskedQuestion, from_json
from placegraph.tools.simulator.truth import QUESTIONS, TRUTH

IOUS = (0.1, 0.25, 0.5, 0.75)  # paper, "Metrics" of object grounding


@dataclass(frozen=True)
class Reply:
    """What came back: status, the object's id ("" without one), calls of the language model, and the time in ms."""

    status: str
    object_id: str
    calls: int
    ms: float


def read_questions(source: Path) -> list[AskedQuestion] | None:
    """The questions of a house folder; None when it has none. Raises SourceError naming what is damaged."""
    file = source / TRUTH / QUESTIONS
    if not file.exists():
        return None
    try:
        values = json.loads(file.read_text("utf-8"))
        if not isinstance(values, list):
            raise SourceError("expected a list of questions")
        return from_json(values)
    except (OSError, ValueError, SourceError) as error:
        raise SourceError(f"{file}: {error}") from None


def ask_all(folder: Path, questions: Sequence[AskedQuestion], true_from_map: F64) -> list[Reply]:
    """The map's reply to each question; true_from_map (4, 4) moves the map onto the truth."""
    replies = []
    with Answerer() as answerer:
        for asked in questions:
            fields = answerer.ask(folder, make_question(asked.text, pose=eye_in_map(asked, true_from_map)))
            replies.append(Reply(fields["status"], fields["object_id"] or "", fields["llm_calls"], fields["ms"]))
    return replies


def eye_in_map(asked: AskedQuestion, true_from_map: F64) -> list[float] | None:
    """Where the asker stands, metres, map frame; None where the answer does not depend on it."""
    if asked.viewpoint is None:
        return None
    eye: list[float] = (true_from_map[:3, :3].T @ (asked.viewpoint - true_from_map[:3, 3])).tolist()
    return eye


def grounding_scores(
    questions: Sequence[AskedQuestion], replies: Sequence[Reply], boxes: dict[str, F64]
) -> dict[str, Any]:
    """Scores in all and by form; `boxes` are the map objects' (2, 3) by id, in the frame of the questions."""
    ious = []
    for question, reply in zip(questions, replies, strict=True):
        answered = reply.status == "found" and reply.object_id in boxes
        ious.append(float(box_iou(boxes[reply.object_id], question.box)) if answered else 0.0)
    overlap = np.array(ious)
    forms = np.array([question.form for question in questions], object)
    return {
        "all": _row(overlap, replies),
        "forms": {
            form: _row(overlap[forms == form], [r for r, f in zip(replies, forms, strict=True) if f == form])
            for form in sorted(set(forms.tolist()))
        },
    }


def _row(ious: F64, replies: Sequence[Reply]) -> dict[str, Any]:
    count = len(replies)
    status = [reply.status for reply in replies]
    return {
        "questions": count,
        **{f"acc_{iou:g}": share(int((ious > iou).sum()), count) for iou in IOUS},
        "not_in_map": status.count("not_in_map"),
        "errors": status.count("error"),
        "ms": share(sum(reply.ms for reply in replies), count),
        "calls": share(sum(reply.calls for reply in replies), count),
    }
