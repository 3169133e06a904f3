import json

import numpy as np
import pytest

from placegraph.runtime.errors import QueryError
from placegraph.runtime.question import MAX_TEXT, error_reply, parse_request


def test_only_text_is_needed() -> None:
    question = parse_request(b'{"text": " the cup "}', "Q7")
    assert (question.text, question.question_id, question.k) == ("the cup", "Q7", 5)
    assert np.isnan(question.viewpoint_world).all()


@pytest.mark.parametrize("mode", ["program", "rules", "deductive"])
def test_modes(mode: str) -> None:
    assert parse_request(json.dumps({"text": "cup", "mode": mode}).encode()).mode == mode
    assert parse_request(b'{"text": "cup"}').mode == "program"


def test_all_fields() -> None:
    request = {"text": "cup", "id": "mine", "k": 2, "mode": "program", "viewpoint": [1, 2.5, 0]}
    question = parse_request(json.dumps(request).encode())
    assert question.question_id == "mine" and question.k == 2
    assert question.viewpoint_world.tolist() == [1.0, 2.5, 0.0]


@pytest.mark.parametrize(
    ("payload", "problem"),
    [
        (b"", "not JSON"),
        (b"\xff\xfe", "not UTF-8"),
        (b"where is the cup", "not JSON"),
        (b"[" * 100_000, "not JSON"),
        (b'["cup"]', "got list"),
        (b'{"text": ""}', "text: expected words"),
        (b'{"text": 3}', "text: expected words"),
        (b"{}", "text: expected words"),
        (b'{"text": "cup", "txt": 1}', "unknown field 'txt'"),
        (json.dumps({"text": "x" * (MAX_TEXT + 1)}).encode(), "at most 500"),
        (b'{"text": "cup", "k": 0}', "k: expected"),
        (b'{"text": "cup", "k": true}', "k: expected"),
        (b'{"text": "cup", "mode": "magic"}', "mode: expected"),
        (b'{"text": "cup", "id": 4}', "id: expected"),
        (b'{"text": "cup", "viewpoint": [1, 2]}', "viewpoint"),
        (b'{"text": "cup", "viewpoint": [1, 2, NaN]}', "viewpoint"),
        (b'{"text": "cup", "viewpoint": "here"}', "viewpoint"),
        (b'{"text": "cup", "viewpoint": [1, 2, -1e7]}', "viewpoint"),
        (b'{"text": "cup", "viewpoint": [1, 2, 1' + b"0" * 400 + b"]}", "viewpoint"),
        (b'{"text": "cup", "viewpoint": [1, 2, 1e999]}', "viewpoint"),
        (b'{"text": "cup", "k": 1' + b"0" * 5000 + b"}", "not JSON"),
        (b'{"text": "\\ud800"}', "text: half of a surrogate"),
        (b'{"text": "cup", "id": "a\\udfff"}', "id: half of a surrogate"),
    ],
)
def test_bad_requests_name_what_is_wrong(payload: bytes, problem: str) -> None:
    with pytest.raises(QueryError, match=problem):
        parse_request(payload)


def test_error_reply_has_the_shape_of_a_reply() -> None:
    reply = json.loads(error_reply("Q1", "why"))
    assert reply["status"] == "error" and reply["object_id"] is None and reply["error"] == "why"
