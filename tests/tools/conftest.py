"""The command line run in this process, a small map of the drawn scene, and a small data set folder."""

import contextlib
import io
import logging
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import pytest

from placegraph.nodes.camera.flat import Flat
from placegraph.runtime.bus.session import free_endpoint
from placegraph.tools.cli import main

# Given poses and no language model: fast, and enough for what the tools do.
FLOW = """
[run]
out_dir = "{out_dir}"

[bus]
endpoint = "{endpoint}"

[nodes.camera]
{camera}

[nodes.pose]
method = "given"

[nodes.keyframe]

[nodes.instances]
model = "drawn_scene"

[nodes.fusion]

[nodes.hierarchy]

[nodes.naming]
method = "none"

[nodes.grounding]
use_model = false

[nodes.recorder]
"""
DRAWN = """source = "flat"
limit = 20

[nodes.camera.settings]
width = 160
height = 120
"""


@dataclass(frozen=True)
class Done:
    """What a command left: exit status, standard output, standard error."""

    code: int
    out: str
    err: str

    @property
    def reason(self) -> str:
        """The one line on standard error that says why it failed."""
        assert "Traceback" not in self.err
        lines = [line for line in self.err.splitlines() if line]
        assert len(lines) == 1 and lines[0].startswith("placegraph: "), self.err
        return lines[0].removeprefix("placegraph: ")


Run = Callable[..., Done]


def _run(*arguments: object) -> Done:
    out, err = io.StringIO(), io.StringIO()
    root, argv = logging.getLogger(), sys.argv
    handlers, level = list(root.handlers), root.level
    sys.argv = ["placegraph", *map(str, arguments)]
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            main()
        code: object = 0
    except SystemExit as end:
        code = end.code or 0
    finally:
        sys.argv, root.handlers[:] = argv, handlers  # the command's log goes to a stream that is gone now
        root.setLevel(level)
    assert isinstance(code, int)
    return Done(code, out.getvalue(), err.getvalue())


@pytest.fixture(scope="session")
def cli() -> Run:
    return _run


@pytest.fixture(autouse=True)
def apart_from_this_machine(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.delenv("PLACEGRAPH_MODELS", raising=False)
    monkeypatch.chdir(tmp_path)  # `out/` is made in the current folder
    for name in ("FORCE_COLOR", "COLUMNS", "TERM"):
        monkeypatch.delenv(name, raising=False)


@pytest.fixture
def write_flow(tmp_path: Path) -> Callable[..., Path]:
    def write(camera: str = "", name: str = "flow.toml") -> Path:
        path = tmp_path / name
        path.write_text(FLOW.format(out_dir=tmp_path / "out", endpoint=free_endpoint(), camera=camera))
        return path

    return write


@pytest.fixture
def drawn_flow(write_flow: Callable[..., Path]) -> Path:
    """A dataflow file of the drawn scene: 20 frames of 160x120."""
    return write_flow(DRAWN, "drawn.toml")


@pytest.fixture
def folder_flow(write_flow: Callable[..., Path]) -> Path:
    """A dataflow file without a source of its own."""
    return write_flow(name="folder.toml")


@pytest.fixture(scope="session")
def mapped(cli: Run, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The map folder of the drawn scene; tests must not change it."""
    base = tmp_path_factory.mktemp("mapped")
    flow = base / "drawn.toml"
    flow.write_text(FLOW.format(out_dir=base / "out", endpoint=free_endpoint(), camera=DRAWN))
    done = cli("run", flow, "--inline", "--quiet", "--out", base / "map")
    assert done.code == 0, done.err
    return base / "map"


@pytest.fixture
def seven(tmp_path: Path) -> Path:
    """A 7-Scenes folder of four drawn frames, 64x48."""
    folder = tmp_path / "seven"
    folder.mkdir()
    source = Flat(Path(), {"width": 64, "height": 48, "frames": 4})
    for frame in source.frames():
        stem = folder / f"frame-{frame.frame_id:06d}"
        assert cv2.imwrite(f"{stem}.color.jpg", frame.color[..., ::-1])
        assert cv2.imwrite(f"{stem}.depth.png", frame.depth)
        np.savetxt(f"{stem}.pose.txt", frame.given_world_from_camera)
    fx, fy, cx, cy = source.intrinsics
    np.savetxt(folder / "camera-intrinsics.txt", [[fx, 0, cx], [0, fy, cy], [0, 0, 1]])
    return folder
