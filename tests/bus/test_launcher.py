import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from placegraph.runtime.bus.session import BusConfig
from placegraph.runtime.config import Dataflow, RunConfig, RunSettings, build
from placegraph.runtime.errors import PlacegraphError
from placegraph.runtime.inline import Inline
from placegraph.runtime.launcher import Launcher, RestartBudget
from placegraph.runtime.messages import End, Health, Keyframe, LastKeyframe, Message, Pose, Segments
from placegraph.runtime.messages.codec import encode

pytestmark = pytest.mark.bus

FRAMES = 14


def flow(bus_config: BusConfig, folder: Path, limit: int = FRAMES, **camera: object) -> Dataflow:
    nodes = {
        "camera": {"source": "flat", "limit": limit, "settings": {"width": 160, "height": 120}, **camera},
        "pose": {"stride": 2},
        "keyframe": {"translation_m": 0.02},
        "instances": {"model": "drawn_scene"},
    }
    config = RunConfig(run=RunSettings(), bus=bus_config, nodes=nodes)
    return build(config, folder)


def test_processes_give_the_same_messages_as_one_thread(bus_config, tmp_path, wait_until) -> None:
    inline: dict[str, list[bytes]] = {}

    def observe(message: Message) -> None:
        inline.setdefault(type(message).__name__, []).append(encode(message))

    with Inline(flow(bus_config, tmp_path), observe) as shell:
        shell.run()

    got: dict[str, list[bytes]] = {}
    kinds = (Pose, Keyframe, Segments, LastKeyframe, End)
    with Launcher(flow(bus_config, tmp_path), tmp_path) as launcher:
        for kind in kinds:
            launcher.observe(kind, lambda m: got.setdefault(type(m).__name__, []).append(encode(m)))
        launcher.start()
        wait_until(lambda: (launcher.poll(), "LastKeyframe" in got)[1], "the last keyframe")
        launcher.stop()
        wait_until(lambda: len(got["Segments"]) == len(got["Keyframe"]), "all segments")
    assert len(got["Pose"]) == FRAMES and len(got["Keyframe"]) > 2
    for kind in kinds:
        assert got[kind.__name__] == inline[kind.__name__], kind.__name__


def test_stop_drains_and_ends_every_process_with_status_0(bus_config, tmp_path, wait_until) -> None:
    health: dict[str, Health] = {}
    with Launcher(flow(bus_config, tmp_path, limit=0), tmp_path) as launcher:
        launcher.observe(Health, lambda m: health.update({m.node: m}))  # type: ignore[attr-defined]
        launcher.start()
        processes = [psutil.Process(pid) for pid in launcher.pids().values()]
        wait_until(lambda: len(health) == 4, "health of four nodes")
        launcher.stop_source()
        launcher.stop()
        assert {n: process.returncode for n, process in launcher._processes.items()} == dict.fromkeys(
            launcher.pids(), 0
        )
    assert not any(process.is_running() for process in processes)
    logs = {path.stem: path.read_text() for path in (tmp_path / "log").iterdir()}
    assert len(logs) == 4
    for name, text in logs.items():  # the last report was waited for
        assert f"stopped after {health[name].steps} steps" in text


def test_a_node_that_dies_in_a_replay_ends_the_run_and_is_named(bus_config, tmp_path, wait_until) -> None:
    with Launcher(flow(bus_config, tmp_path, limit=0), tmp_path) as launcher:
        launcher.start()
        os.kill(launcher.pids()["instances"], signal.SIGKILL)
        with pytest.raises(PlacegraphError, match="instances was killed by signal 9"):
            wait_until(launcher.poll, "the death is noticed")


def test_live_a_restartable_node_is_started_again_and_the_run_goes_on(bus_config, tmp_path, wait_until) -> None:
    segments: list[Message] = []
    with Launcher(flow(bus_config, tmp_path, limit=0, realtime=True), tmp_path) as launcher:
        launcher.observe(Segments, segments.append)
        launcher.start()
        wait_until(lambda: segments, "segments before")
        first = launcher.pids()["instances"]
        os.kill(first, signal.SIGKILL)
        wait_until(lambda: (launcher.poll(), launcher.restarts)[1], "a restart")
        assert launcher.pids()["instances"] != first
        seen = len(segments)
        wait_until(lambda: (launcher.poll(), len(segments) > seen)[1], "segments after")


def test_live_a_node_that_is_not_restartable_ends_the_run(bus_config, tmp_path, wait_until) -> None:
    with Launcher(flow(bus_config, tmp_path, limit=0, realtime=True), tmp_path) as launcher:
        launcher.start()
        os.kill(launcher.pids()["pose"], signal.SIGKILL)
        with pytest.raises(PlacegraphError, match="pose was killed"):
            wait_until(launcher.poll, "the death is noticed")


def test_a_process_that_cannot_start_is_named_with_its_log(bus_config, tmp_path) -> None:
    dataflow = flow(bus_config, tmp_path)
    dataflow.config.nodes["instances"]["model"] = "no_such_model"
    with (
        Launcher(dataflow, tmp_path) as launcher,
        pytest.raises(PlacegraphError, match=r"(?s)instances ended.*no_such_model"),
    ):
        launcher.start()


def test_a_start_can_be_cancelled(bus_config, tmp_path) -> None:
    with (
        Launcher(flow(bus_config, tmp_path), tmp_path) as launcher,
        pytest.raises(PlacegraphError, match=r"stopped while camera, .* got ready: nothing was mapped"),
    ):
        launcher.start(lambda: True)


def test_ctrl_c_does_not_reach_a_child_that_still_starts(bus_config, tmp_path, wait_until) -> None:
    dataflow = flow(bus_config, tmp_path)
    (tmp_path / "log").mkdir()
    with Launcher(dataflow, tmp_path) as launcher:
        for name in dataflow.nodes:
            launcher._spawn(name)
            os.kill(launcher.pids()[name], signal.SIGINT)
        wait_until(lambda: (launcher.poll(), launcher._alive == set(dataflow.nodes))[1], "all are ready")
        assert not any(path.read_text().count("KeyboardInterrupt") for path in (tmp_path / "log").iterdir())


def test_nodes_that_hang_are_killed_together_not_one_after_the_other(bus_config, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr("placegraph.runtime.launcher.TERMINATE_TIMEOUT_S", 1.5)
    with Launcher(flow(bus_config, tmp_path), tmp_path) as launcher:
        launcher.start()
        for pid in launcher.pids().values():
            os.kill(pid, signal.SIGSTOP)
        began = time.monotonic()
        launcher.kill()
        assert time.monotonic() - began < 3.0  # four times 1.5 s otherwise


def test_a_source_that_fails_while_it_ends_is_named(bus_config, tmp_path, wait_until) -> None:
    with Launcher(flow(bus_config, tmp_path, limit=0), tmp_path) as launcher:
        launcher.start()
        camera = launcher.pids()["camera"]
        os.kill(camera, signal.SIGSTOP)
        launcher.stop_source()
        os.kill(camera, signal.SIGKILL)
        with pytest.raises(PlacegraphError, match="camera was killed by signal 9"):
            wait_until(launcher.poll, "the death is noticed", 5.0)


def test_children_end_when_their_launcher_is_killed(tmp_path, wait_until) -> None:
    code = (
        "import sys, time\nfrom pathlib import Path\n"
        "from placegraph.runtime.bus.session import BusConfig, free_endpoint\n"
        "from placegraph.runtime.config import RunConfig, build\nfrom placegraph.runtime.launcher import Launcher\n"
        "nodes = {'camera': {'source': 'flat'}, 'pose': {}}\n"
        "config = RunConfig(bus=BusConfig(endpoint=free_endpoint()), nodes=nodes)\n"
        f"launcher = Launcher(build(config), Path({str(tmp_path)!r}))\nlauncher.start()\n"
        "print(*launcher.pids().values(), flush=True)\ntime.sleep(60)\n"
    )
    parent = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    assert parent.stdout is not None
    pids = [int(pid) for pid in parent.stdout.readline().split()]
    children = [psutil.Process(pid) for pid in pids]
    parent.kill()
    parent.wait()
    parent.stdout.close()
    assert len(children) == 2
    wait_until(
        lambda: not any(child.is_running() and child.status() != "zombie" for child in children), "children end", 15
    )


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_run_ends_in_order_and_leaves_nothing(tmp_path, number, bus_config, wait_until) -> None:
    config = tmp_path / "flow.toml"
    config.write_text(
        f'[bus]\nendpoint = "{bus_config.endpoint}"\n[nodes.camera]\nsource = "flat"\nrealtime = true\n[nodes.pose]\n'
    )
    command = [sys.executable, "-m", "placegraph.tools.cli", "run", str(config), "--out", str(tmp_path / "out")]
    run = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    log = tmp_path / "out" / "log" / "pose.log"
    wait_until(lambda: log.exists() and "ready" in log.read_text(), "pose is ready")
    time.sleep(1.0)
    run.send_signal(number)
    output, _ = run.communicate(timeout=40)
    assert run.returncode == 0, output
    assert "ending the source" in output
    assert len((tmp_path / "out" / "trajectory.txt").read_text().splitlines()) > 1


def test_restart_budget() -> None:
    budget = RestartBudget()
    assert [budget.next_delay_s(t) for t in (0.0, 1.0, 2.0, 3.0, 4.0)] == [0.5, 1.0, 2.0, 4.0, 8.0]
    assert budget.next_delay_s(5.0) is None
    assert budget.next_delay_s(100.0) == 0.5
