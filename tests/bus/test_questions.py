"""A mapped scene is asked over the bus: by the command, and by a Zenoh session that knows nothing of placegraph."""

import json
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from placegraph.runtime.bus import Bus, BusConfig, free_endpoint
from placegraph.runtime.errors import QueryError

pytestmark = pytest.mark.bus

PLAIN_ZENOH = """
import json, sys, zenoh
config = zenoh.Config()
config.insert_json5("mode", '"client"')
config.insert_json5("connect/endpoints", json.dumps([sys.argv[1]]))
with zenoh.open(config) as session:
    for reply in session.get("placegraph/ask", payload=json.dumps({"text": sys.argv[2]}), timeout=60):
        print(reply.ok.payload.to_string())
"""


@pytest.fixture(scope="module")
def mapped(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, Path]]:
    folder, endpoint = tmp_path_factory.mktemp("run"), free_endpoint()
    config = folder / "small.toml"
    nodes = "\n".join(f"[nodes.{name}]" for name in ("fusion", "hierarchy", "grounding"))
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
        [sys.executable, "-c", PLAIN_ZENOH, endpoint, "find the table"], capture_output=True, text=True, timeout=90
    )
    reply = json.loads(asked.stdout)
    assert reply["status"] == "found" and reply["name"] == "table", asked.stdout
    assert reply["object_id"].startswith("O") and len(reply["box"]) == 2 and reply["evidence"]


def test_the_command_gives_the_same_object_live_and_from_the_map(mapped: tuple[str, Path]) -> None:
    endpoint, folder = mapped
    ask = [sys.executable, "-m", "placegraph.tools.cli", "ask"]
    live = subprocess.run(
        [*ask, "live", "where is the table", "--json", "--endpoint", endpoint],
        capture_output=True,
        text=True,
        timeout=90,
    )
    question = [*ask, str(folder), "where is the table", "--json"]
    saved = subprocess.run(question, capture_output=True, text=True, timeout=90)
    a, b = json.loads(live.stdout), json.loads(saved.stdout)
    assert a["status"] == "found", live.stderr
    assert (a["object_id"], a["box"], a["evidence"]) == (b["object_id"], b["box"], b["evidence"])


@pytest.mark.parametrize(
    ("payload", "problem"),
    [(b"", "not JSON"), (b"\xff", "not UTF-8"), (b'{"text": " "}', "text"), (b'{"text": "x", "k": -1}', "k: expected")],
)
def test_bad_requests_get_an_error_reply_at_once(mapped: tuple[str, Path], payload: bytes, problem: str) -> None:
    with Bus(BusConfig(endpoint=mapped[0])) as bus:
        reply = json.loads(bus.ask(payload, 10.0, "ask"))
    assert reply["status"] == "error" and problem in reply["error"]


def test_many_questions_at_once_are_all_answered(mapped: tuple[str, Path]) -> None:
    from concurrent.futures import ThreadPoolExecutor

    with Bus(BusConfig(endpoint=mapped[0])) as bus, ThreadPoolExecutor(24) as pool:
        request = json.dumps({"text": "the table"}).encode()
        replies = [json.loads(r) for r in pool.map(lambda _: bus.ask(request, 60.0, "ask"), range(24))]
    assert len(replies) == 24
    for reply in replies:
        assert reply["status"] == "found" or "busy" in reply["error"]
    assert any(reply["status"] == "found" for reply in replies)


def test_another_prefix_finds_nobody(mapped: tuple[str, Path]) -> None:
    with Bus(BusConfig(endpoint=mapped[0], prefix="other")) as bus, pytest.raises(QueryError, match="nobody answers"):
        bus.ask(b'{"text": "x"}', 5.0, "ask")
