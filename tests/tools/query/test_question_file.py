import gc
import json
import os
import signal
import subprocess
import sys
import time

import psutil
import pytest

from placegraph.runtime.errors import ConfigError, QueryError
from placegraph.tools.query.offline_query import OfflineQuery
from placegraph.tools.query.question_file import LineAnswerer, answer_all

FAST = {"use_model": False}
ROOM = {
    "objects": [
        {"id": 3, "tags": ["chair"], "center": [0, 0, 0.5], "size": [0.5, 0.5, 1], "color": "red"},
        {"id": "x7", "tags": ["chair"], "center": [3, 0, 0.5], "size": [0.5, 0.5, 1], "color": [40, 70, 180]},
        {"id": 5, "tags": ["table"], "center": [3, 1, 0.4], "size": [1, 1, 0.8]},
    ]
}
KEYS = {
    "question_id", "object_id", "status", "error", "candidates", "evidence", "parse", "sure", "llm_calls", "ms"
}  # fmt: skip


@pytest.fixture
def room(tmp_path):
    path = tmp_path / "room.json"
    path.write_text(json.dumps(ROOM))
    return path


def run(tmp_path, lines, graph, **options):
    """Answers to lines, which are bytes or what is to be JSON."""
    questions, out = tmp_path / "q.jsonl", tmp_path / "a.jsonl"
    questions.write_bytes(b"\n".join(line if isinstance(line, bytes) else json.dumps(line).encode() for line in lines))
    with OfflineQuery(FAST) as answerer:
        tally = answer_all(LineAnswerer(answerer, tmp_path, graph, **{"mode": "rules"} | options), questions, out)
    answers = [json.loads(line) for line in out.read_text().splitlines()]
    assert all(set(answer) == KEYS for answer in answers) and len(tally.ms) == len(answers)
    assert not out.with_name("a.jsonl.partial").exists()
    return answers


def test_answers_come_in_order_with_the_ids_of_the_caller(tmp_path, room) -> None:
    lines = [
        {"id": 1, "text": "the chair next to the table", "target": "unread"},
        {"id": "1", "text": "the red chair", "k": 1},
        b"  \r",
        {"id": "p", "text": "the piano"},
        {"id": "left", "text": "the left chair", "pose": [1.5, -3, 1.5, 1.57]},
    ]
    answers = run(tmp_path, lines, room)
    assert [(a["question_id"], a["object_id"], a["status"]) for a in answers] == [
        (1, "x7", "found"), ("1", 3, "found"), ("p", None, "not_in_map"), ("left", 3, "found")
    ]  # fmt: skip
    assert answers[0]["evidence"] == ["chair x7 is called chair", "chair x7 is 0.25 m from table 5"]
    assert [c["id"] for c in answers[0]["candidates"]] == ["x7", 3] and len(answers[1]["candidates"]) == 1
    assert answers[0]["candidates"][0]["score"] > answers[0]["candidates"][1]["score"]


@pytest.mark.parametrize(
    ("line", "own", "reason"),
    [
        (b"\xff", None, "not UTF-8"),
        (b"{", None, "not JSON"),
        (b"[" * 60_000, None, "not JSON"),
        (b"x" * 70_000, None, "70000 bytes; at most 65536 are read"),
        ([1], None, "expected an object like"),
        ({"text": "the chair"}, None, "id: expected"),
        ({"id": 1.5, "text": "the chair"}, None, "id: expected"),
        ({"id": True, "text": "the chair"}, None, "id: expected"),
        (b'{"id": "\\ud800", "text": "the chair"}', None, "id: expected"),
        ({"id": 4}, 4, "text: expected words"),
        ({"id": 4, "text": "x" * 501}, 4, "at most 500 characters, got 501"),
        ({"id": 4, "text": 5}, 4, "text: expected words"),
        ({"id": 4, "text": "the chair", "k": None}, 4, "k: expected"),
        ({"id": 4, "text": "the chair", "mode": "magic"}, 4, "mode: expected one of"),
        ({"id": 4, "text": "the chair", "pose": [1, 2]}, 4, "pose: expected"),
        ({"id": 4, "text": "the chair", "viewpoint": [1, 2, 3]}, 4, "it is called pose"),
        ({"id": 4, "text": "the chair", "graph": 3}, 4, "graph: expected the path"),
        ({"id": 4, "text": "the chair", "graph": "absent.json"}, 4, "absent.json: no graph.json here"),
        ({"id": 4, "text": "the chair", "graph": "x" * 300}, 4, "graph: File name too long"),
        ({"id": 4, "text": "the chair", "graph": "a\0b"}, 4, "no graph.json here"),
        ({"id": 4, "text": "the chair", "graph": "q.jsonl"}, 4, "q.jsonl: cannot read"),
    ],
)
def test_a_bad_line_is_answered_and_the_next_one_too(tmp_path, room, line, own, reason) -> None:
    bad, good = run(tmp_path, [line, {"id": 9, "text": "the table"}], room)
    assert (bad["question_id"], bad["status"], bad["object_id"]) == (own, "error", None)
    assert bad["error"].startswith("line 1: ") and reason in bad["error"]
    assert (good["question_id"], good["object_id"], good["error"]) == (9, 5, None)


def test_a_bug_in_one_answer_leaves_the_others(tmp_path, room, monkeypatch, caplog) -> None:
    asked = OfflineQuery.ask

    def broken(self, path, question):
        if question.text == "the chair":
            raise ZeroDivisionError("division by zero")
        return asked(self, path, question)

    monkeypatch.setattr(OfflineQuery, "ask", broken)
    bad, good = run(tmp_path, [{"id": 1, "text": "the chair"}, {"id": 2, "text": "the table"}], room)
    assert bad["error"] == "line 1: ZeroDivisionError: division by zero" and good["object_id"] == 5
    assert "Traceback" in caplog.text


def test_lines_name_their_own_graphs(tmp_path, room) -> None:
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "b.json").write_text(json.dumps({"objects": [ROOM["objects"][0] | {"id": "b"}]}))
    lines = [{"id": i, "text": "the red chair", "graph": g} for i, g in enumerate(["sub/b.json", str(room)] * 2)]
    assert [a["object_id"] for a in run(tmp_path, lines, None)] == ["b", 3, "b", 3]
    (alone,) = run(tmp_path, [{"id": 1, "text": "the chair"}], None)
    assert alone["error"] == "line 1: graph: expected in each line, as --graph names none"


def test_an_empty_list_has_nothing_in_it(tmp_path) -> None:
    (tmp_path / "empty.json").write_text('{"objects": []}')
    texts = ["the chair", "the lamp on the table", "the second bed from the left", "the table in the kitchen upstairs"]
    answers = run(tmp_path, [{"id": i, "text": text} for i, text in enumerate(texts)], tmp_path / "empty.json")
    assert [a["status"] for a in answers] == ["not_in_map"] * 4


def test_files_that_cannot_be_read_or_written(tmp_path, room) -> None:
    questions = tmp_path / "q.jsonl"
    with OfflineQuery(FAST) as answerer:
        batch = LineAnswerer(answerer, tmp_path, room)
        with pytest.raises(QueryError, match=r"q\.jsonl: cannot read"):
            answer_all(batch, questions, tmp_path / "a.jsonl")
        questions.write_text("")
        with pytest.raises(ConfigError, match=r"a\.jsonl: cannot write"):
            answer_all(batch, questions, tmp_path / "absent" / "a.jsonl")
        assert answer_all(batch, questions, tmp_path / "a.jsonl").text().startswith("0 questions: 0 found")
    assert (tmp_path / "a.jsonl").read_text() == ""


def test_a_thousand_questions_leave_no_memory_behind(tmp_path, room) -> None:
    texts = ["the chair next to the table", "the piano", "the red chair", "the second chair from the left", ""]
    memory, process = [], psutil.Process()
    with OfflineQuery(FAST) as answerer:
        batch = LineAnswerer(answerer, tmp_path, room, mode="rules")
        for n in range(1200):
            line = {"id": n, "text": f"{texts[n % 5]} {n}" if n % 2 else texts[n % 5], "pose": [n % 7, 0, 1]}
            batch.answer(n, json.dumps(line).encode())
            if n in (199, 1199):
                gc.collect()
                memory.append(process.memory_info().rss / 1e6)
    assert memory[1] - memory[0] < 10.0


def test_what_was_answered_is_kept_when_it_is_killed(tmp_path, mapped) -> None:
    questions, out = tmp_path / "q.jsonl", tmp_path / "a.jsonl"
    questions.write_text("".join(json.dumps({"id": n, "text": "a chair"}) + "\n" for n in range(100_000)))
    out.write_text("older answers\n")
    command = [sys.executable, "-m", "placegraph.tools.cli", "ask-batch", str(questions), "--out", str(out)]
    asking = subprocess.Popen([*command, "--graph", str(mapped), "--mode", "rules"], env=os.environ)
    partial, deadline = tmp_path / "a.jsonl.partial", time.monotonic() + 60
    while not (partial.exists() and partial.stat().st_size > 5000) and time.monotonic() < deadline:
        time.sleep(0.05)
    asking.send_signal(signal.SIGKILL)
    asking.wait(30)
    lines = partial.read_text().split("\n")
    assert [json.loads(line)["question_id"] for line in lines[:-1]] == list(range(len(lines) - 1)) and len(lines) > 3
    assert out.read_text() == "older answers\n"
