import json
import math

import numpy as np
import pytest

from placegraph.runtime.errors import QueryError
from placegraph.runtime.query.request import MAX_BYTES, MAX_TEXT, MODES, make_question, parse_request, request_id


def test_only_text_is_needed() -> None:
    question = parse_request(b'{"text": " the cup "}', "Q7")
    assert (question.text, question.question_id, question.k, question.mode) == ("the cup", "Q7", 5, "program")
    assert np.isnan(question.viewpoint_world).all() and math.isnan(question.heading_rad)


@pytest.mark.parametrize("mode", ["program", "rules", "deductive"])
def test_modes(mode: str) -> None:
    assert parse_request(json.dumps({"text": "cup", "mode": mode}).encode()).mode == mode
    assert mode in MODES


def test_all_fields() -> None:
    request = {"text": "cup", "id": "mine", "k": 2, "mode": "rules", "pose": [1, 2.5, 0, -1.5]}
    question = parse_request(json.dumps(request).encode())
    assert question.question_id == "mine" and question.k == 2
    assert question.viewpoint_world.tolist() == [1.0, 2.5, 0.0] and question.heading_rad == -1.5
    standing = make_question("cup", pose=[1, 2.5, 0])
    assert standing.viewpoint_world.tolist() == [1.0, 2.5, 0.0] and math.isnan(standing.heading_rad)
    assert np.isnan(parse_request(b'{"text": "cup", "pose": null}').viewpoint_world).all()


@pytest.mark.parametrize(
    ("payload", "problem"),
    [
        (b"", "not JSON"),
        (b"\xff\xfe", "not UTF-8"),
        (b"where is the cup", "not JSON"),
        (b"[" * 50_000, "not JSON"),
        (b'{"text": ' + b"[" * 50_000 + b"]" * 10_000, "not JSON"),
        (b'{"text": ' + b"[" * 500 + b"]" * 500 + b"}", "text: expected words"),
        (b" " * (MAX_BYTES + 1), f"has {MAX_BYTES + 1} bytes"),
        (b'["cup"]', "got list"),
        (b"null", "got NoneType"),
        (b'{"text": ""}', "text: expected words"),
        (b'{"text": " \\n "}', "text: expected words"),
        (b'{"text": 3}', "text: expected words.*got 3"),
        (b'{"text": null}', "text: expected words"),
        (b"{}", "text: expected words"),
        (b'{"text": "cup", "txt": 1}', "unknown field 'txt'; there are: id, k, mode, pose, text"),
        (b'{"text": "cup", "viewpoint": [1, 2, 3]}', "unknown field 'viewpoint'; it is called pose"),
        (json.dumps({"text": "x" * (MAX_TEXT + 1)}).encode(), "at most 500 characters, got 501"),
        (json.dumps({"text": "chair " * 1700}).encode(), "at most 500 characters, got 10200"),
        (b'{"text": "cup", "k": 0}', "k: expected"),
        (b'{"text": "cup", "k": 51}', "k: expected"),
        (b'{"text": "cup", "k": true}', "k: expected.*got True"),
        (b'{"text": "cup", "k": 2.0}', "k: expected"),
        (b'{"text": "cup", "k": null}', "k: expected"),
        (b'{"text": "cup", "k": 1' + b"0" * 5000 + b"}", "not JSON"),
        (b'{"text": "cup", "k": 1' + b"0" * 4000 + b"}", "k: expected"),
        (b'{"text": "cup", "mode": "magic"}', "mode: expected one of program, rules, deductive, got 'magic'"),
        (b'{"text": "cup", "mode": ["rules"]}', "mode: expected"),
        (b'{"text": "cup", "id": 4}', "id: expected"),
        (json.dumps({"text": "cup", "id": "x" * 101}).encode(), "id: expected at most 100 characters"),
        (b'{"text": "cup", "pose": [1, 2]}', "pose: expected"),
        (b'{"text": "cup", "pose": [1, 2, 3, 4, 5]}', "pose: expected"),
        (b'{"text": "cup", "pose": [1, 2, NaN]}', "pose: expected"),
        (b'{"text": "cup", "pose": [1, 2, 3, Infinity]}', "pose: expected"),
        (b'{"text": "cup", "pose": [1, 2, true]}', "pose: expected"),
        (b'{"text": "cup", "pose": [1, 2, "3"]}', "pose: expected"),
        (b'{"text": "cup", "pose": "here"}', "pose: expected"),
        (b'{"text": "cup", "pose": {"x": 1}}', "pose: expected"),
        (b'{"text": "cup", "pose": [1, 2, -1e7]}', "pose: expected"),
        (b'{"text": "cup", "pose": [1, 2, 1' + b"0" * 400 + b"]}", "pose: expected"),
        (b'{"text": "cup", "pose": [1, 2, 1e999]}', "pose: expected"),
        (b'{"text": "\\ud800"}', "text: .*half of a surrogate"),
        (b'{"text": "cup", "id": "a\\udfff"}', "id: .*half of a surrogate"),
        (b'{"text": "cup", "\\ud800": 1}', "unknown field"),
    ],
)
def test_bad_requests_name_what_is_wrong(payload: bytes, problem: str) -> None:
    with pytest.raises(QueryError, match=problem) as raised:
        parse_request(payload)
    assert len(str(raised.value)) < 250
    str(raised.value).encode()  # can be sent


def test_the_id_of_a_bad_request_is_found_where_it_has_one() -> None:
    assert request_id(b'{"text": 3, "id": "mine"}') == "mine"
    for payload in (b"", b"\xff", b"[1]", b"{}", b'{"id": 4}', b'{"id": "\\ud800"}', b"[" * 60_000, b" " * 70_000):
        assert request_id(payload) == ""
