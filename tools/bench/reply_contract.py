"""Whether replies keep their contract under hostile requests: each fits its schema and names only ids of the graph."""

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
from placegraph.runtime.scene_graph.object_list import parse_object_list
from placegraph.runtime.scene_graph.object_list_import import graph_from_object_list
from placegraph.tools.bench.hostile_requests import requests
from placegraph.tools.simulator.house_frames import generate_house
from placegraph.tools.simulator.object_list_export import object_list
from placegraph.tools.simulator.questions import generate_questions

NODE_ID = re.compile(r"\b[BFRLOC][0-9]+\b")
TIMEOUT_S = 600.0  # of the query server: long enough that slow replies show in the times and not as timeouts
MAX_SHOWN_FAULTS = 20


@dataclass
class FuzzOutcome:
    """Replies by kind of request and status, their times, and the faults found in them."""

    statuses: Counter[tuple[str, str]] = field(default_factory=Counter)
    ms: list[float] = field(default_factory=list)
    faults: list[str] = field(default_factory=list)
    grown_mb: float = 0.0  # memory of the process, from the first tenth of the requests to the last

    def document(self) -> dict[str, Any]:
        """The outcome for JSON."""
        kinds: dict[str, dict[str, int]] = {}
        for (kind, status), count in sorted(self.statuses.items()):
            kinds.setdefault(kind, {})[status] = count
        p50, p95 = np.percentile(self.ms or [0.0], (50, 95))
        times = {"median": round(p50, 1), "p95": round(p95, 1), "max": max(self.ms, default=0.0)}
        return {
            "requests": len(self.ms),
            "faults": len(self.faults),
            "first_faults": self.faults[:MAX_SHOWN_FAULTS],
            "replies": kinds,
            "ms": times,
            "grown_mb": round(self.grown_mb, 1),
        }


class _FakeRequest:
    """Takes the place of the bus's Request: a payload, and the replies to it."""

    def __init__(self, payload: bytes) -> None:
        self.payload = payload
        self.replies: list[bytes] = []

    def reply(self, payload: bytes) -> None:
        self.replies.append(payload)


def fuzz(count: int, *, mode: str, seed: int, floors: int = 2, settings: dict[str, Any] | None = None) -> FuzzOutcome:
    """Put `count` seeded requests to the query server and the grounding node, in this process, all with one `mode`.

    The map is an object list of a simulated house with so many floors. settings: of the grounding node.
    """
    house = generate_house(seed, floors)
    graph = graph_from_object_list(parse_object_list(object_list(house), f"house {seed}"), f"house {seed}").graph
    texts = [question.text for question in generate_questions(house, seed)]
    outcome, process = FuzzOutcome(), psutil.Process()
    with _running(graph, settings or {}) as node:
        for number, (kind, payload) in enumerate(requests(texts, count, seed)):
            request, faults = _FakeRequest(payload), []
            try:
                _put(node, request, mode)
            except Exception as error:  # it would have ended the node's process
                faults.append(f"{type(error).__name__}: {error}")
            status, reply_faults = _check(request.replies, graph, outcome)
            outcome.statuses[kind, status] += 1
            outcome.faults += [f"{kind} {payload[:300]!r}: {fault}" for fault in faults + reply_faults]
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


def _put(node: Node, request: _FakeRequest, mode: str) -> None:
    """The path of a request in a running system, without the bus: server, encoded message, node, server."""

    def forward(number: int, question: Question) -> None:
        received = decode(Question, encode(replace(question, mode=mode)))
        answers = [message for message in node.step(received) if isinstance(message, Answer)]
        if len(answers) != 1:
            raise PlacegraphError(f"{len(answers)} answers from the node")
        server.answer(number, decode(Answer, encode(answers[0])).json)

    server = QueryServer(forward, TIMEOUT_S)
    try:
        server.receive(request)  # type: ignore[arg-type]
    finally:
        server.close("the node failed")


def _check(replies: list[bytes], graph: SceneGraph, outcome: FuzzOutcome) -> tuple[str, list[str]]:
    """The reply's status, and its faults."""
    if len(replies) != 1:
        return "none", [f"{len(replies)} replies"]
    try:
        reply = Reply.model_validate_json(replies[0])
    except ValidationError as error:
        return "invalid", [f"{replies[0][:300]!r}: {error.errors(include_url=False)[0]}"]
    outcome.ms.append(reply.ms)
    known_ids = {*graph.nodes, *graph.connections}
    ids = {reply.object_id, *reply.route, *(step.id for step in reply.path), *(thing.id for thing in reply.candidates)}
    sentences = [*reply.evidence, *(sentence for thing in reply.candidates for sentence in thing.evidence)]
    asked_ids = set(NODE_ID.findall(reply.question.upper()))  # the evidence may say that these do not exist
    ids |= {node_id for sentence in sentences for node_id in NODE_ID.findall(sentence) if node_id not in asked_ids}
    unknown = sorted(node_id for node_id in ids if node_id is not None and node_id not in known_ids)
    return reply.status, [f"ids that are not in the graph: {unknown}"] if unknown else []
