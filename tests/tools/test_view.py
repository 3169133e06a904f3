import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

from placegraph.runtime.errors import ConfigError, SourceError
from placegraph.tools.view import view, viewer_command


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    path = tmp_path / "run.rrd"
    path.write_bytes(b"")
    return path


def test_the_bundled_viewer_opens_a_file_or_a_run_folder(recording: Path) -> None:
    command = viewer_command(recording, None, False)
    assert command == viewer_command(recording.parent, None, False)
    assert Path(command[0]).parent == Path(sys.executable).parent
    assert command[1] == str(recording)
    assert subprocess.run([command[0], "--version"], capture_output=True, check=True).stdout


@pytest.mark.parametrize("web", [False, True])
def test_it_listens_on_loopback_only(recording: Path, web: bool) -> None:
    command = viewer_command(recording, None, web)
    assert command[command.index("--bind") + 1] == "127.0.0.1"
    assert ("--web-viewer" in command) == web


def test_a_screenshot_names_its_file(recording: Path) -> None:
    command = viewer_command(recording, Path("a.png"), False)
    assert command[command.index("--screenshot-to") + 1] == "a.png"
    with pytest.raises(ConfigError, match="exclude each other"):
        viewer_command(recording, Path("a.png"), True)


def test_without_a_recording_or_a_viewer(tmp_path: Path, recording: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(SourceError, match=r"absent\.rrd: no such recording"):
        viewer_command(tmp_path / "absent.rrd", None, False)
    (tmp_path / "empty").mkdir()
    with pytest.raises(SourceError, match=r"empty/run\.rrd: no such recording"):
        viewer_command(tmp_path / "empty", None, False)
    monkeypatch.setattr(sys, "executable", str(tmp_path / "python"))
    with pytest.raises(ConfigError, match="rerun: the Rerun viewer is missing"):
        viewer_command(recording, None, False)


@pytest.mark.parametrize("code", [0, 3])
def test_the_viewers_exit_code_is_passed_on(recording: Path, monkeypatch: pytest.MonkeyPatch, code: int) -> None:
    def run(command: list[str], **kwargs: Any) -> subprocess.CompletedProcess[bytes]:
        assert command[1] == str(recording)
        return subprocess.CompletedProcess(command, code)

    monkeypatch.setattr(subprocess, "run", run)
    app = typer.Typer()
    app.command()(view)
    assert CliRunner().invoke(app, [str(recording)]).exit_code == code
