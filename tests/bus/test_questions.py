"""A mapped scene is asked over the bus: by the command, and by a Zenoh session that knows nothing of placegraph."""

import json
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from placegraph.runtime.bus.session import Bus, BusConfig, free_endpoint
from placegraph.runtime.errors import QueryError
from placegraph.runtime.query.reply import Reply

pytestmark = pytest.mark.bus

EXAMPLE = Path(__file__).parents[2] / "examples" / "ask_over_zenoh.py"


@pytest.fixture(scope="module")
def mapped(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, Path]]:
    folder, endpoint = tmp_path_factory.mktemp("run"), free_endpoint()
    config = folder / "small.toml"
    nodes = "\n".join(f"[nodes.{name}]" for name in ("fusion", "hierarchy", "naming", "grounding"))
    config.write_text(
        '[nodes.camera]\nsource = "flat"\nsettings = { width = 160, height = 120, frames = 120 }\nlimit = 45\n'
        '[nodes.pose]\nmethod = "given"\n[nodes.keyframe]\n[nodes.instances]\nmodel = "drawn_scene"\n' + nodes
    )
    command = [sys.executable, "-m", "placegraph.tools.cli", "run", str(config)]
    command += ["--out", str(folder / "map"), "--endpoint", endpoint, "--stay"]
    run = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    assert run.stdout is not None
    said = ""
    for line in run.stdout:
        said += line
        if "answering questions at" in line:
            break
    else:
        pytest.fail(said)
    yield endpoint, folder / "map"
    run.send_signal(signal.SIGINT)
    rest, _ = run.communicate(timeout=60)
    assert run.returncode == 0, rest


def test_a_plain_zenoh_session_gets_a_json_reply(mapped: tuple[str, Path]) -> None:
    endpoint, _ = mapped
    asked = subprocess.run(
        [sys.executable, str(EXAMPLE), "find the table", endpoint], capture_output=True, text=True, timeout=90
    )
    reply = json.loads(asked.stdout)
    assert reply["status"] == "found" and reply["name"] == "table", asked.stdout
    assert reply["object_id"].startswith("O") and len(reply["box"]) == 2 and reply["evidence"]
    assert Reply.model_validate(reply).ms > 0


def test_the_command_gives_the_same_object_live_and_from_the_map(mapped: tuple[str, Path]) -> None:
    endpoint, folder = mapped
    ask = [sys.executable, "-m", "placegraph.tools.cli", "ask"]
    live = subprocess.run(
        [*ask, "live", "where is the table", "--json", "--pose", "1,2,1.5,90", "--endpoint", endpoint],
        capture_output=True,
        text=True,
        timeout=90,
    )
    question = [*ask, str(folder), "where is the table", "--json", "--pose", "1,2,1.5,90"]
    saved = subprocess.run(question, capture_output=True, text=True, timeout=90)
    a, b = json.loads(live.stdout), json.loads(saved.stdout)
    assert a["status"] == "found", live.stderr
    assert (a["object_id"], a["box"], a["evidence"]) == (b["object_id"], b["box"], b["evidence"])
    assert a["viewpoint"] == b["viewpoint"] and a["viewpoint"]["xyz"] == [1, 2, 1.5]


@pytest.mark.parametrize(
    ("payload", "problem"),
    [
        (b"", "not JSON"),
        (b"\xff", "not UTF-8"),
        (b'{"text": " "}', "text"),
        (b'{"text": "x", "k": -1}', "k: expected"),
        (b'{"text": "x", "viewpoint": [0, 0, 0]}', "it is called pose"),
    ],
)
def test_bad_requests_get_an_error_reply_at_once(mapped: tuple[str, Path], payload: bytes, problem: str) -> None:
    with Bus(BusConfig(endpoint=mapped[0])) as bus:
        reply = json.loads(bus.ask(payload, 10.0, "ask"))
    assert problem in (Reply.model_validate(reply).error or "")


def test_many_questions_at_once_are_all_answered(mapped: tuple[str, Path]) -> None:
    from concurrent.futures import ThreadPoolExecutor

    with Bus(BusConfig(endpoint=mapped[0])) as bus, ThreadPoolExecutor(24) as pool:
        request = json.dumps({"text": "the table"}).encode()
        replies = [json.loads(r) for r in pool.map(lambda _: bus.ask(request, 60.0, "ask"), range(24))]
    assert len(replies) == 24
    for reply in replies:
        assert reply["status"] == "found" or "busy" in reply["error"]
    assert any(reply["status"] == "found" for reply in replies)


MANY = """
import json, sys, threading, zenoh
config = zenoh.Config()
config.insert_json5("mode", '"client"')
config.insert_json5("connect/endpoints", json.dumps([sys.argv[1]]))
things, replies, start = ("table", "chair", "refrigerator", "piano"), [], threading.Barrier(10)
def ask(number):
    sent = {"text": f"the {things[number % 4]}", "id": f"{sys.argv[2]}-{number}", "mode": "rules"}
    start.wait()
    for reply in session.get("placegraph/ask", payload=json.dumps(sent), timeout=60):
        replies.append([sent, json.loads(reply.ok.payload.to_string())])
with zenoh.open(config) as session:
    threads = [threading.Thread(target=ask, args=(n,)) for n in range(10)]
    [thread.start() for thread in threads]
    [thread.join() for thread in threads]
print(json.dumps(replies))
"""


def test_thirty_askers_of_three_processes_get_their_own_replies(mapped: tuple[str, Path]) -> None:
    asking = [
        subprocess.Popen([sys.executable, "-c", MANY, mapped[0], name], stdout=subprocess.PIPE, text=True)
        for name in ("a", "b", "c")
    ]
    replies = [pair for one in asking for pair in json.loads(one.communicate(timeout=90)[0])]
    assert len({sent["id"] for sent, _ in replies}) == len(replies) == 30
    revisions = set()
    for sent, reply in replies:
        checked = Reply.model_validate(reply)
        assert (checked.question_id, checked.question) == (sent["id"], sent["text"])
        if checked.status == "error":
            assert checked.error is not None and checked.error.startswith("busy: 16 questions are waiting")
            continue
        revisions.add(checked.revision)
        if checked.status == "found":
            assert checked.name in sent["text"]
    assert len(revisions) == 1 and revisions.pop() > 0  # the run is over: all were asked of its last graph


def test_another_prefix_finds_nobody(mapped: tuple[str, Path]) -> None:
    with Bus(BusConfig(endpoint=mapped[0], prefix="other")) as bus, pytest.raises(QueryError, match="nobody answers"):
        bus.ask(b'{"text": "x"}', 5.0, "ask")
