import subprocess
import sys

import pytest

from placegraph.tools.cli import PANELS

NAMES = [name for commands in PANELS.values() for name in commands]


def test_without_a_command_it_lists_them_all(cli) -> None:
    done = cli()
    assert done.code == 2  # wrong usage
    lines = (done.out + done.err).splitlines()
    panels = [line.split("─ ")[1].split(" ─")[0] for line in lines if line.startswith("╭─ ")]
    assert panels[1:] == list(PANELS)


def test_in_100_columns_each_command_is_one_line(cli, monkeypatch) -> None:
    monkeypatch.setattr("typer.rich_utils.MAX_WIDTH", 100)
    lines = [line for line in cli("--help").out.splitlines() if line.startswith("│ ")]
    assert [line.split()[1] for line in lines[-len(NAMES) :]] == NAMES


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("evaluate out/demo --source house", "evaluate map"),
        ("evaluate-networks --json", "evaluate networks"),
        ("evaluate-grounding out/demo", "evaluate grounding"),
        ("bench", "bench nodes"),
        ("bench --json", "bench nodes"),
        ("bench --growth out.svg --floors 2", "bench growth SVG"),
        ("bench --fuzz=3", "bench fuzz REQUESTS"),
        ("ask --graph room.json --batch q.jsonl --out a.jsonl", "ask-batch QUESTIONS --out ANSWERS"),
    ],
)
def test_an_old_command_names_the_new_one(cli, old, new) -> None:
    done = cli(*old.split())
    assert (done.code, done.out, done.reason) == (2, "", f"this command is now `placegraph {new}`")


@pytest.mark.parametrize("name", NAMES)
def test_every_command_helps(cli, name) -> None:
    done = cli(name, "-h")
    assert done.code == 0 and done.err == ""
    assert f"Usage: placegraph {name}" in done.out
    assert all(len(line) <= 80 for line in done.out.splitlines())  # without a terminal: 80 columns


@pytest.mark.parametrize(
    "arguments", [("rnu",), ("run",), ("run", "a.toml", "--limit", "-1"), ("ask", "only"), ("record", "a.toml")]
)
def test_wrong_usage_is_2_and_shows_the_usage(cli, arguments) -> None:
    done = cli(*arguments)
    assert done.code == 2 and done.out == ""
    assert "Usage: placegraph" in done.err and "Traceback" not in done.err


def test_a_wrong_setting_is_2_and_any_other_error_is_1(cli, tmp_path) -> None:
    settings = cli("check", tmp_path / "absent.toml")
    other = cli("graph", tmp_path / "absent")
    assert (settings.code, other.code) == (2, 1)
    assert settings.reason.startswith(f"{tmp_path / 'absent.toml'}: no such dataflow file")
    assert other.reason.startswith(f"{tmp_path / 'absent'}: no graph.json here")
    assert settings.out == other.out == ""


def test_as_a_program_it_ends_with_one_line_and_the_status(tmp_path) -> None:
    command = [sys.executable, "-m", "placegraph.tools.cli", "check", "absent.toml"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 2 and done.stdout == ""
    assert done.stderr.startswith("placegraph: absent.toml: no such dataflow file; with placegraph come: ")
    assert "flat.toml" in done.stderr
    assert done.stderr.count("\n") == 1
