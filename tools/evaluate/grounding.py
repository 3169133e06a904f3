"""Questions of a house asked of its map: how often the box of the answer is the right one."""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from placegraph.runtime.errors import QueryError, SourceError
from placegraph.runtime.geometry import box_iou
from placegraph.runtime.messages import Answer, Graph
from placegraph.runtime.node import Context, build_node
from placegraph.runtime.question import make_question
from placegraph.runtime.scene_graph import SceneGraph
from placegraph.tools.evaluate.places import share
from placegraph.tools.house.questions import AskedQuestion, from_json
from placegraph.tools.house.truth import QUESTIONS, TRUTH
from placegraph.tools.map_folder import RUN, find_graph, read_config

F64 = NDArray[np.float64]

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


class StoredGraph:
    """A map folder's graph that answers questions as its run would have; a context manager."""

    def __init__(self, folder: Path) -> None:
        self._graph = SceneGraph.load(find_graph(folder))
        settings: dict[str, Any] = {}
        context = Context()
        if (folder / RUN).exists():
            config = read_config(folder)
            settings = config.nodes.get("grounding", {})
            context = Context(model_dirs=tuple(config.run.model_dirs), threads=config.run.threads)
        self._node = build_node("grounding", settings, context)

    def __enter__(self) -> StoredGraph:
        self._node.start()
        text = self._graph.to_json()
        self._node.step(Graph(frame_id=-1, stamp_ns=0, revision=0, final=True, named=True, json=text))
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._node.stop()

    def ask(self, text: str, viewpoint_map: F64 | None) -> Reply:
        """Ask one question; viewpoint (3,) in metres, map frame. Raises QueryError when it is no question."""
        viewpoint = None if viewpoint_map is None else viewpoint_map.tolist()
        question = make_question(text, pose=viewpoint)
        began = time.perf_counter()
        answers = [message for message in self._node.step(question) if isinstance(message, Answer)]
        ms = (time.perf_counter() - began) * 1e3
        if not answers:
            raise QueryError("the grounding node gave no answer")
        reply = json.loads(answers[0].json)
        return Reply(reply["status"], reply["object_id"] or "", reply["llm_calls"], ms)


def ask_all(folder: Path, questions: Sequence[AskedQuestion], true_from_map: F64) -> list[Reply]:
    """The map's reply to each question; true_from_map (4, 4) moves the map onto the truth."""
    replies = []
    with StoredGraph(folder) as graph:
        for question in questions:
            asker = question.viewpoint
            if asker is not None:
                asker = true_from_map[:3, :3].T @ (asker - true_from_map[:3, 3])
            replies.append(graph.ask(question.text, asker))
    return replies


def grounding_scores(
    questions: Sequence[AskedQuestion], replies: Sequence[Reply], boxes: dict[str, F64]
) -> dict[str, Any]:
    """Scores in all and by form; `boxes` are the map objects' (2, 3) by id, in the frame of the questions."""
    ious = []
    for question, reply in zip(questions, replies, strict=True):
        answered = reply.status == "found" and reply.object_id in boxes
        ious.append(box_iou(boxes[reply.object_id], question.box) if answered else 0.0)
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
