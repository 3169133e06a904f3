import json
import time

import pytest

from placegraph.runtime.messages import Question
from placegraph.runtime.query.query_server import MAX_WAITING, QueryServer
from placegraph.runtime.query.reply import Reply, error_reply


class Asker:
    """Stands where the bus's IncomingQuery stands: a payload, and one reply."""

    def __init__(self, payload: bytes = b'{"text": "cup", "id": "same"}') -> None:
        self.payload, self.replies = payload, []

    def reply(self, payload: bytes) -> None:
        self.replies.append(json.loads(payload))


def answer(text: str = "an answer") -> str:
    return error_reply(text).to_answer_json()


@pytest.fixture
def forwarded() -> list[tuple[int, Question]]:
    return []


def query_server(forwarded: list, timeout_s: float = 60.0) -> QueryServer:
    return QueryServer(lambda number, question: forwarded.append((number, question)), timeout_s)


def test_each_asker_gets_its_own_answer_once(forwarded: list) -> None:
    server, askers = query_server(forwarded), [Asker(), Asker()]
    for asker in askers:
        server.receive(asker)  # type: ignore[arg-type]
    (first, question), (second, _) = forwarded
    assert question.question_id == "same" and server.is_waiting(first)
    server.answer(second, answer("two"))
    server.answer(first, answer("one"))
    server.answer(first, answer("three"))
    assert [[reply["error"] for reply in asker.replies] for asker in askers] == [["one"], ["two"]]


def test_a_bad_request_is_answered_and_not_forwarded(forwarded: list) -> None:
    asker = Asker(b"{}")
    query_server(forwarded).receive(asker)  # type: ignore[arg-type]
    assert asker.replies[0]["status"] == "error" and forwarded == []
    Reply.model_validate(asker.replies[0])
    wrong = Asker(b'{"id": "mine", "text": 3}')
    query_server(forwarded).receive(wrong)  # type: ignore[arg-type]
    assert wrong.replies[0]["question_id"] == "mine"


def test_the_time_from_arrival_to_reply_is_told(forwarded: list) -> None:
    server, asker = query_server(forwarded), Asker()
    server.receive(asker)  # type: ignore[arg-type]
    time.sleep(0.05)
    server.answer(forwarded[0][0], answer())
    assert 50 <= asker.replies[0]["ms"] < 5000


def test_too_many_are_told_so_and_a_place_gets_free_again(forwarded: list) -> None:
    server, askers = query_server(forwarded), [Asker() for _ in range(MAX_WAITING + 1)]
    for asker in askers:
        server.receive(asker)  # type: ignore[arg-type]
    busy = Reply.model_validate(askers[-1].replies[0])
    assert len(forwarded) == MAX_WAITING and "busy: 16 questions are waiting" in (busy.error or "")
    assert (busy.question_id, busy.question) == ("same", "cup")
    server.answer(forwarded[0][0], answer())
    late = Asker()
    server.receive(late)  # type: ignore[arg-type]
    assert len(forwarded) == MAX_WAITING + 1 and late.replies == []
    server.close("the grounding node ended")
    assert all(len(asker.replies) == 1 for asker in [*askers, late])
    assert Reply.model_validate(late.replies[0]).error == "the grounding node ended"


def test_whoever_comes_after_the_end_is_told_so(forwarded: list) -> None:
    server, asker = query_server(forwarded), Asker()
    server.close("the grounding node ended")
    server.receive(asker)  # type: ignore[arg-type]
    assert [reply["error"] for reply in asker.replies] == ["the grounding node ended"] and forwarded == []


def test_a_slow_node_is_answered_for(forwarded: list) -> None:
    server, asker = query_server(forwarded, timeout_s=0.05), Asker()
    server.receive(asker)  # type: ignore[arg-type]
    deadline = time.monotonic() + 5
    while not asker.replies and time.monotonic() < deadline:
        time.sleep(0.01)
    reply = Reply.model_validate(asker.replies[0])
    assert (reply.error, reply.question_id) == ("no answer within 0.05 s", "same") and reply.ms >= 50
    assert not server.is_waiting(forwarded[0][0])
    server.answer(forwarded[0][0], answer())
    assert len(asker.replies) == 1
