"""Whether replies keep their contract, whatever was asked: each fits its schema and names only what the graph holds."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import psutil
from pydantic import ValidationError

from placegraph.runtime.errors import PlacegraphError
from placegraph.runtime.messages import Answer, Graph, Question
from placegraph.runtime.messages.codec import decode, encode
from placegraph.runtime.node import Context, Node, build_node
from placegraph.runtime.query.query_server import QueryServer
from placegraph.runtime.query.reply import Reply
from placegraph.runtime.scene_graph import SceneGraph
from placegraph.runtime.scene_graph.object_list import read_listed
from placegraph.runtime.scene_graph.object_list_import import scene_of
from placegraph.tools.bench.fuzz import requests
from placegraph.tools.simulator.build import build
from placegraph.tools.simulator.listing import object_list
from placegraph.tools.simulator.questions import questions

NODE_ID = re.compile(r"\b[BFRLOC][0-9]+\b")
TIMEOUT_S = 600.0  # nobody waits: what takes long is seen in the times
SHOWN_FAULTS = 20


@dataclass
class Outcome:
    """What became of the requests: how many replies of each kind of request had which status, times, and faults."""

    statuses: Counter[tuple[str, str]] = field(default_factory=Counter)
    ms: list[float] = field(default_factory=list)
    faults: list[str] = field(default_factory=list)
    grown_mb: float = 0.0  # memory of the process, from the first tenth of the requests to the last

    def document(self) -> dict[str, Any]:
        """As JSON has it."""
        kinds: dict[str, dict[str, int]] = {}
        for (kind, status), count in sorted(self.statuses.items()):
            kinds.setdefault(kind, {})[status] = count
        p50, p95 = np.percentile(self.ms or [0.0], (50, 95))
        times = {"median": round(p50, 1), "p95": round(p95, 1), "max": max(self.ms, default=0.0)}
        return {
            "requests": len(self.ms),
            "faults": len(self.faults),
            "first_faults": self.faults[:SHOWN_FAULTS],
            "replies": kinds,
            "ms": times,
            "grown_mb": round(self.grown_mb, 1),
        }


class _Asker:
    """Stands where the bus's Request stands: a payload, and the replies to it."""

    def __init__(self, payload: bytes) -> None:
        self.payload = payload
        self.replies: list[bytes] = []

    def reply(self, payload: bytes) -> None:
        self.replies.append(payload)


def fuzz(count: int, *, mode: str, seed: int, floors: int = 2, settings: dict[str, Any] | None = None) -> Outcome:
    """Put `count` seeded requests to the question desk and the grounding node, in this process; mode: of all of them.

    The map is that of a generated house with so many floors, as an object list. settings: of the grounding node.
    """
    house = build(seed, floors)
    graph = scene_of(read_listed(object_list(house), f"house {seed}"), f"house {seed}").graph
    texts = [question.text for question in questions(house, seed)]
    outcome, process = Outcome(), psutil.Process()
    with _running(graph, settings or {}) as node:
        for number, (kind, payload) in enumerate(requests(texts, count, seed)):
            asker, faults = _Asker(payload), []
            try:
                _put(node, asker, mode)
            except Exception as error:  # the node would have ended
                faults.append(f"{type(error).__name__}: {error}")
            status, more = _judged(asker.replies, graph, outcome)
            outcome.statuses[kind, status] += 1
            outcome.faults += [f"{kind} {payload[:300]!r}: {fault}" for fault in faults + more]
            if number == count // 10:
                outcome.grown_mb = -process.memory_info().rss / 1e6
    outcome.grown_mb += process.memory_info().rss / 1e6
    return outcome


@contextmanager
def _running(graph: SceneGraph, settings: dict[str, Any]) -> Iterator[Node]:
    node = build_node("grounding", settings, Context())
    try:
        node.start()
        unnamed = Graph(frame_id=-1, stamp_ns=0, revision=1, final=True, json=graph.to_json())
        for named_graph in build_node("naming", {"method": "none"}, Context()).step(unnamed):
            node.step(named_graph)
        yield node
    finally:
        node.stop()


def _put(node: Node, asker: _Asker, mode: str) -> None:
    """A request's way in a running system, without the bus: desk, message on the wire, node, desk."""

    def forward(number: int, question: Question) -> None:
        asked = decode(Question, encode(replace(question, mode=mode)))
        answers = [message for message in node.step(asked) if isinstance(message, Answer)]
        if len(answers) != 1:
            raise PlacegraphError(f"{len(answers)} answers from the node")
        desk.answer(number, decode(Answer, encode(answers[0])).json)

    desk = QueryServer(forward, TIMEOUT_S)
    try:
        desk.take(asker)  # type: ignore[arg-type]  # of the bus's Request it needs what the asker has
    finally:
        desk.close("the node failed")


def _judged(replies: list[bytes], graph: SceneGraph, outcome: Outcome) -> tuple[str, list[str]]:
    """The reply's status, and what is wrong with it."""
    if len(replies) != 1:
        return "none", [f"{len(replies)} replies"]
    try:
        reply = Reply.model_validate_json(replies[0])
    except ValidationError as error:
        return "invalid", [f"{replies[0][:300]!r}: {error.errors(include_url=False)[0]}"]
    outcome.ms.append(reply.ms)
    known = {*graph.nodes, *graph.connections}
    ids = {reply.object_id, *reply.route, *(step.id for step in reply.path), *(one.id for one in reply.candidates)}
    sentences = [*reply.evidence, *(sentence for one in reply.candidates for sentence in one.evidence)]
    said = set(NODE_ID.findall(reply.question.upper()))  # an id of the asker may be told to be nowhere
    ids |= {found for sentence in sentences for found in NODE_ID.findall(sentence) if found not in said}
    strange = sorted(node_id for node_id in ids if node_id is not None and node_id not in known)
    return reply.status, [f"ids that are not in the graph: {strange}"] if strange else []
