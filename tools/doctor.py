"""`placegraph doctor`: what placegraph needs of this machine, what is there and what is missing."""

from __future__ import annotations

import importlib.util
import json
import os
import platform
import shutil
import sys
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

import psutil
import typer

MIN_MEMORY_GB = 3.5  # of the whole machine; chosen by hand


@dataclass(frozen=True)
class Finding:
    """The result of one check: ok, note (something optional is missing) or bad (placegraph cannot run)."""

    what: str
    state: str
    detail: str


def doctor(as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False) -> None:
    """Check this machine: what placegraph needs, what is there, what is missing.

    Exit status: 0 placegraph can run, 1 it cannot.
    """
    findings = [*_machine(), *_packages(), _bus(), _language_model(), _camera()]
    if as_json:
        print(json.dumps([asdict(finding) for finding in findings]))
    else:
        for finding in findings:
            print(f"{finding.state:<5} {finding.what:<18} {finding.detail}")
    if any(finding.state == "bad" for finding in findings):
        raise typer.Exit(1)


def _machine() -> list[Finding]:
    memory_gb = psutil.virtual_memory().total / 1e9
    free_gb = shutil.disk_usage(Path.cwd()).free / 1e9
    return [
        Finding("python", "ok", f"{platform.python_version()} at {sys.executable}"),
        Finding("cpu", "ok", f"{psutil.cpu_count()} cores, {platform.machine()}"),
        Finding("memory", "ok" if memory_gb >= MIN_MEMORY_GB else "bad", f"{memory_gb:.1f} GB"),
        Finding(
            "disk",
            "ok" if free_gb > 2 else "note",
            f"{free_gb:.0f} GB free here; a recording takes about 1.3 MB per keyframe",
        ),
    ]


def _packages() -> list[Finding]:
    needed = ["zenoh", "onnxruntime", "cv2", "scipy", "kiss_icp", "rerun", "msgpack", "llama_cpp", "wordllama"]
    findings = []
    for name in needed:
        installed = importlib.util.find_spec(name) is not None
        detail = "installed" if installed else "missing: pip install placegraph"
        findings.append(Finding(name, "ok" if installed else "bad", detail))
    return findings


def _bus() -> Finding:
    from placegraph.runtime.bus.session import Bus, BusConfig, free_endpoint
    from placegraph.runtime.errors import ConfigError

    config = BusConfig(endpoint=free_endpoint())
    try:
        with Bus(config, hub=True), Bus(config):
            return Finding("bus", "ok", "a Zenoh hub and a client met on loopback")
    except ConfigError as error:
        return Finding("bus", "bad", str(error))


def _language_model() -> Finding:
    from placegraph.runtime.errors import ModelError
    from placegraph.runtime.language.language_model import default_model_path

    try:
        path = default_model_path()
    except ModelError as error:
        return Finding("language model", "bad", str(error))
    return Finding("language model", "ok", f"{path.name}, {path.stat().st_size / 1e6:.0f} MB")


def _camera() -> Finding:
    if importlib.util.find_spec("depthai") is None:
        return Finding("camera", "note", "no depthai: pip install 'placegraph[oak]' for a live OAK-D")
    os.environ.setdefault("DEPTHAI_LEVEL", "error")  # its warnings go to standard output, amid our JSON
    from placegraph.nodes.camera.oak import find_device
    from placegraph.runtime.errors import SourceError

    try:
        device = find_device("")
    except SourceError as error:
        return Finding("camera", "note", str(error))
    return Finding("camera", "ok", f"an OAK camera: {device.deviceId}")
