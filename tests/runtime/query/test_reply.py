import json

import pytest
from pydantic import ValidationError

from placegraph.runtime.query.reply import Reply, error_reply, reply_json

FOUND = {
    "status": "found", "question_id": "Q1", "question": "cup", "object_id": "O1", "name": "cup",
    "box": [[0.0, 0, 0], [1, 1, 1]], "center": [0.5, 0.5, 0.5],
    "path": [{"id": "B0", "layer": "building", "name": "building"}, {"id": "O1", "layer": "object", "name": "cup"}],
    "approach": {"position": [0, 0, 0], "yaw_rad": 1.0}, "route": ["R0"], "travel_m": 1.5, "evidence": ["it is"],
    "candidates": [{"id": "O1", "name": "cup", "score": 1, "evidence": []}], "parse": None, "sure": True,
    "viewpoint": {"source": "asker", "xyz": [0, 0, 0]}, "revision": 3, "llm_calls": 0,
}  # fmt: skip


def test_a_refusal_is_a_reply_with_all_fields() -> None:
    payload = reply_json(error_reply("why", "Q1", "the cup").to_answer_json(), 3.21)
    reply = Reply.model_validate_json(payload)
    assert (reply.error, reply.question_id, reply.question, reply.ms) == ("why", "Q1", "the cup", 3.2)
    assert set(json.loads(payload)) == set(Reply.model_fields)


def test_an_answer_gets_its_time() -> None:
    answer = Reply.model_validate(FOUND | {"question": "é"}).to_answer_json()
    assert set(json.loads(answer)) == set(Reply.model_fields) - {"ms", "error"}
    payload = reply_json(answer, 12.345)
    reply = Reply.model_validate_json(payload)
    assert reply.ms == 12.3 and reply.error is None
    fields = json.loads(payload)
    assert list(fields) == sorted(Reply.model_fields) and '"question":"é"' in payload


@pytest.mark.parametrize(
    "wrong",
    [
        {"object_id": None},
        {"status": "not_in_map"},
        {"status": "error"},
        {"error": "why"},
        {"status": "maybe"},
        {"path": FOUND["path"][:1]},
        {"candidates": []},
        {"revision": "3"},
        {"sure": 1},
        {"ms": -1.0},
        {"new": 1},
        {"box": [[0, 0, 0]]},
    ],
)
def test_a_reply_that_contradicts_itself_is_none(wrong) -> None:
    with pytest.raises(ValidationError):
        Reply.model_validate(FOUND | wrong)
