"""Ctrl-C at a terminal: the signal reaches every process of the run's group."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import psutil
import pytest

from placegraph.runtime.bus.session import BusConfig
from placegraph.runtime.config import RunConfig, build
from placegraph.runtime.errors import PlacegraphError
from placegraph.runtime.inline import Inline
from placegraph.tools.map_files.map_folder import GRAPH
from placegraph.tools.run import _save_partial_map, run_dataflow
from placegraph.tools.run.map_collector import MapCollector

NODES = """[nodes.camera]
source = "flat"
realtime = true
[nodes.pose]
method = "given"
[nodes.keyframe]
"""


@pytest.fixture
def run(tmp_path: Path, bus_config: BusConfig) -> subprocess.Popen[str]:
    config = tmp_path / "flow.toml"
    config.write_text(f'[bus]\nendpoint = "{bus_config.endpoint}"\n{NODES}')
    command = [sys.executable, "-m", "placegraph.tools.cli", "run", str(config), "--out", str(tmp_path / "out")]
    return subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True
    )


def log(folder: Path, node: str) -> str:
    path = folder / "out" / "log" / f"{node}.log"
    return path.read_text() if path.exists() else ""


@pytest.mark.bus
def test_while_the_nodes_start_it_ends_the_run_at_once(run, tmp_path: Path, wait_until: Callable[..., None]) -> None:
    wait_until((tmp_path / "out" / "log" / "keyframe.log").exists, "the last process is started")
    os.killpg(run.pid, signal.SIGINT)
    output, _ = run.communicate(timeout=10)
    assert run.returncode == 1 and "got ready: nothing was mapped" in output, output
    assert "Traceback" not in output + log(tmp_path, "camera") + log(tmp_path, "pose") + log(tmp_path, "keyframe")


@pytest.mark.bus
def test_twice_it_does_not_wait_for_a_node_that_hangs(run, tmp_path: Path, wait_until: Callable[..., None]) -> None:
    wait_until(lambda: "ready" in log(tmp_path, "pose") and "ready" in log(tmp_path, "camera"), "the nodes are ready")
    (pose,) = (
        child
        for child in psutil.Process(run.pid).children()
        if any(file.path.endswith("pose.log") for file in child.open_files())
    )
    pose.suspend()
    for _ in range(2):
        os.killpg(run.pid, signal.SIGINT)
        with pytest.raises(subprocess.TimeoutExpired):
            run.wait(0.5)
    output, _ = run.communicate(timeout=15)
    assert run.returncode == 1 and "Traceback" not in output, output


@pytest.mark.bus
def test_live_it_is_not_waited_for_ever_for_a_keyframe_that_is_lost(
    tmp_path: Path, bus_config: BusConfig, monkeypatch, wait_until: Callable[..., None]
) -> None:
    monkeypatch.setattr("placegraph.tools.run.FINISH_TIMEOUT_S", 1.0)
    monkeypatch.setattr("placegraph.runtime.launcher.TERMINATE_TIMEOUT_S", 0.5)
    camera = {"source": "flat", "realtime": True, "limit": 25, "settings": {"width": 64, "height": 48}}
    nodes = {"camera": camera, "pose": {"method": "given"}, "keyframe": {}, "instances": {"model": "drawn_scene"}}
    config = RunConfig(bus=bus_config, nodes=nodes | {"fusion": {}, "hierarchy": {}})

    def hold_instances() -> None:
        names = ("camera", *nodes, "fusion", "hierarchy")
        wait_until(lambda: all("ready" in log(tmp_path, name) for name in names), "every node is ready")
        time.sleep(0.5)  # "ready" is logged before the launcher knows of it; the frames take 2.5 s
        (instances,) = (
            child
            for child in psutil.Process().children()
            if any(file.path.endswith("instances.log") for file in child.open_files())
        )
        instances.suspend()

    with ThreadPoolExecutor(1) as pool:
        held = pool.submit(hold_instances)
        with pytest.raises(PlacegraphError, match=r"the last graph did not come within 1 s of the source's end"):
            run_dataflow(config, "flow", tmp_path / "out", inline=False, quiet=True)
        held.result()


@pytest.mark.parametrize("writable", [True, False])
def test_a_run_that_fails_keeps_what_it_mapped(tmp_path: Path, writable: bool) -> None:
    camera = {"source": "flat", "limit": 40, "settings": {"width": 64, "height": 48}}
    nodes = {"camera": camera, "pose": {"method": "given"}, "keyframe": {}, "instances": {"model": "drawn_scene"}}
    dataflow = build(RunConfig(nodes=nodes | {"fusion": {"map_every_keyframes": 1}, "hierarchy": {}}))
    collector, folder = MapCollector(dataflow), tmp_path / "map"
    assert _save_partial_map(collector, folder) == "" and not folder.exists()
    with Inline(dataflow, collector.add) as shell:
        for message in dataflow.source.messages():
            if collector.graph is not None:
                break
            shell.feed(message)
    if writable:
        assert f"{folder} holds graph revision {collector.graph.revision}, not the last one" in _save_partial_map(
            collector, folder
        )
        assert (folder / GRAPH).exists()
    else:
        folder.write_text("")
        assert "the map cannot be written either: " in _save_partial_map(collector, folder)
