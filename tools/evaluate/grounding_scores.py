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
from placegraph.tools.evaluate.place_overlap import ratio
from placegraph.tools.query.offline_query import OfflineQuery
from placegraph.tools.simulator.ground_truth import QUESTIONS, TRUTH
from placegraph.tools.simulator.questions import HouseQuestion, from_json

IOUS = (0.1, 0.25, 0.5, 0.75)  # source: paper, "Metrics" of object grounding


@dataclass(frozen=True)
class QuestionResult:
    """What came back: status, the object's id ("" without one), calls of the language model, and the time in ms."""

    status: str
    object_id: str
    calls: int
    ms: float


def read_questions(source: Path) -> list[HouseQuestion] | None:
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


def ask_all(folder: Path, questions: Sequence[HouseQuestion], true_from_map: F64) -> list[QuestionResult]:
    """The map's reply to each question; true_from_map (4, 4) moves the map onto the truth."""
    results = []
    with OfflineQuery() as query:
        for asked in questions:
            reply = query.ask(folder, make_question(asked.text, pose=eye_in_map(asked, true_from_map)))
            results.append(QuestionResult(reply["status"], reply["object_id"] or "", reply["llm_calls"], reply["ms"]))
    return results


def eye_in_map(asked: HouseQuestion, true_from_map: F64) -> list[float] | None:
    """Where the asker stands, metres, map frame; None where the answer does not depend on it."""
    if asked.viewpoint is None:
        return None
    eye: list[float] = (true_from_map[:3, :3].T @ (asked.viewpoint - true_from_map[:3, 3])).tolist()
    return eye


def grounding_scores(
    questions: Sequence[HouseQuestion], results: Sequence[QuestionResult], boxes: dict[str, F64]
) -> dict[str, Any]:
    """Scores overall and by form; `boxes` are the map objects' (2, 3) by id, in the frame of the questions."""
    ious = np.array(
        [
            float(box_iou(boxes[result.object_id], question.box))
            if result.status == "found" and result.object_id in boxes
            else 0.0
            for question, result in zip(questions, results, strict=True)
        ]
    )
    forms = np.array([question.form for question in questions], object)
    return {
        "all": _score_row(ious, results),
        "forms": {
            form: _score_row(ious[forms == form], [r for r, f in zip(results, forms, strict=True) if f == form])
            for form in sorted(set(forms.tolist()))
        },
    }


def _score_row(ious: F64, results: Sequence[QuestionResult]) -> dict[str, Any]:
    count = len(results)
    statuses = [result.status for result in results]
    return {
        "questions": count,
        **{f"acc_{iou:g}": ratio(int((ious > iou).sum()), count) for iou in IOUS},
        "not_in_map": statuses.count("not_in_map"),
        "errors": statuses.count("error"),
        "ms": ratio(sum(result.ms for result in results), count),
        "calls": ratio(sum(result.calls for result in results), count),
    }
