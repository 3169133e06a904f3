"""Write what is made from code or data: pages of docs/, and tables of README.md, CHANGELOG.md and docs/method.md.

    python docs/generate.py          write them
    python docs/generate.py --check  exit status 1 if one differs from what would be written

results.md comes from results/*.json, commands.md from the command line's own help, dataflow.md from the node classes
and the table of topics. README's headline numbers come from the results, the changelog's renamed settings from the
code, and the method's table of the paper's steps from README. `make docs` writes all before it builds the site;
tests/test_docs.py compares them. The pages are plain Markdown, so that they can be read on GitHub, too.
"""

from __future__ import annotations

import json
import re
import sys
import textwrap
from pathlib import Path
from typing import Any, Literal, get_args

import typer
from pydantic import BaseModel, ConfigDict, Field

from placegraph.runtime.renamed_settings import RENAMED_SETTINGS
from placegraph.tools.cli import app
from placegraph.tools.graph import dataflow_table, topic_table

ROOT = Path(__file__).parents[1]
RESULTS = ROOT / "results"
README, CHANGELOG, METHOD = ROOT / "README.md", ROOT / "CHANGELOG.md", ROOT / "docs/method.md"
HEADLINES = (  # in README: what, the experiment's id, its value's name
    ("Five generated houses: trajectory, ATE rmse", "five_trajectory", "ATE rmse"),
    ("Five houses: rooms, F1 at IoU .5", "five_floors_rooms", "rooms F1 at IoU .5"),
    ("Five houses: objects at IoU .25, precision", "five_objects", "precision"),
    ("Five houses: objects at IoU .25, recall", "five_objects", "recall"),
    ("Five houses: questions about the maps, Acc@.25", "five_questions", "Acc@.25"),
    ("Questions about true graphs, exact object", "true_graphs", "exact object"),
    ("Human-written sentences parsed exactly (Nr3D)", "people", "exact program"),
    ("7-Scenes kitchen: trajectory, ATE rmse", "kitchen_trajectory", "ATE rmse"),
    ("7-Scenes kitchen: end to end on two CPU cores", "kitchen_speed", "end to end, 10 processes"),
    ("One question, median", "latency", "median"),
)
CODE_WIDTH = 88  # of commands: what the site shows without scrolling
WIDTH = 118  # of generated prose; rows of tables may be longer
SHELL_WORD = re.compile(r"""(?:[^\s"']|"[^"]*"|'[^']*')+""")
GOAL = re.compile(r"(<=|>=) (-?[0-9.]+)")
VALUE_NAMES = {Path: "PATH", int: "N", float: "NUMBER"}
MADE = "<!-- Made by docs/generate.py: do not edit. -->"


class _Strict(BaseModel):
    model_config = ConfigDict(frozen=True, strict=True, extra="forbid")


class Value(_Strict):
    """One measured number, or a text where a number cannot say it."""

    name: str
    value: float | int | str
    unit: str = ""
    goal: str | None = Field(default=None, pattern=GOAL.pattern)

    @property
    def is_missed(self) -> bool:
        """Whether there is a goal and the value does not meet it."""
        if self.goal is None or isinstance(self.value, str):
            return False
        relation, bound = self.goal.split()
        return self.value > float(bound) if relation == "<=" else self.value < float(bound)

    @property
    def shown(self) -> str:
        """The value with its unit."""
        number = self.value if isinstance(self.value, str) else f"{self.value:g}"
        return f"{number} {self.unit}".rstrip()

    @property
    def shown_goal(self) -> str:
        """The goal in words, marked when it was missed; empty where there is none."""
        if self.goal is None:
            return ""
        relation, bound = self.goal.split()
        words = f"{'at most' if relation == '<=' else 'at least'} {float(bound):g} {self.unit}".rstrip()
        return f"{words}: **missed**" if self.is_missed else words


class _Provenance(_Strict):
    """Where a number comes from."""

    id: str = Field(pattern=r"^[a-z0-9_]+$")
    title: str
    command: list[str] = []  # in today's names
    measured_by: str = ""  # where no command gives the number
    commit: str = Field(pattern=r"^[0-9a-f]{7}$")
    commit_is: Literal["measured", "recorded"]  # of the code that was measured, or the one that wrote the number down
    machine: str  # a key of machines.json
    date: str = Field(pattern=r"^20\d\d-\d\d-\d\d$")
    stop: int  # the working session that measured it
    notes: list[str] = []


class Entry(_Provenance):
    """One experiment."""

    values: list[Value] = Field(min_length=1)


class Table(_Provenance):
    """One experiment whose numbers need rows and columns."""

    columns: list[str]
    rows: list[list[str | float | int]]


class Theme(_Strict):
    """One file of results."""

    title: str
    intro: list[str]
    entries: list[Entry]
    tables: list[Table] = []


def load_results() -> tuple[dict[str, str], list[Theme]]:
    """The machines by key, and the themes in the order of their files' names. Raises pydantic's ValidationError."""
    machines = json.loads((RESULTS / "machines.json").read_text())
    files = sorted(path for path in RESULTS.glob("*.json") if path.name != "machines.json")
    return machines, [Theme.model_validate_json(path.read_text()) for path in files]


def results_page() -> str:
    """results.md: what missed its goal, then every experiment with its numbers, command, commit, machine and date."""
    machines, themes = load_results()
    missed = [(e, v) for theme in themes for e in theme.entries for v in e.values if v.is_missed]
    with_goal = sum(v.goal is not None for theme in themes for e in theme.entries for v in e.values)
    lines = [
        "# Results",
        "",
        MADE,
        "",
        *_wrapped(
            "Every number that placegraph claims is a row of a file in `results/`. This page is made from those files "
            "by `python docs/generate.py`. Each experiment names the command that gives it, in today's names. "
            '"Measured at" is the commit of the code that was measured. Where that was not written down, "recorded '
            'by" is the commit that wrote the number down, usually the next one.'
        ),
        "",
        *_table(["machine", "what it is"], [[f"`{key}`", what] for key, what in machines.items()]),
        "",
        "## Goals that were missed",
        "",
        f"{with_goal - len(missed)} of {with_goal} goals are met. These are not:",
        "",
        *_table(
            ["experiment", "measure", "value", "goal"],
            [[f"[{e.title}](#{e.id})", v.name, v.shown, v.shown_goal.split(":")[0]] for e, v in missed],
        ),
        "",
    ]
    for theme in themes:
        lines += [f"## {theme.title}", ""]
        if theme.intro:
            lines += [*_wrapped(" ".join(theme.intro)), ""]
        for entry in theme.entries:
            rows = [[v.name, v.shown, v.shown_goal] for v in entry.values]
            columns = ["measure", "value", "goal"] if any(v.goal for v in entry.values) else ["measure", "value"]
            lines += _experiment(entry, _table(columns, [row[: len(columns)] for row in rows]))
        for table in theme.tables:
            rows = [[f"{cell:g}" if not isinstance(cell, str) else cell for cell in row] for row in table.rows]
            lines += _experiment(table, _table(table.columns, rows))
    return "\n".join(lines).rstrip() + "\n"


def _experiment(experiment: _Provenance, table: list[str]) -> list[str]:
    commit = "Measured at" if experiment.commit_is == "measured" else "Recorded by"
    source = f"{commit} commit `{experiment.commit}`, {experiment.date}, machine `{experiment.machine}`."
    anchor = f'<a id="{experiment.id}"></a>'  # understood by GitHub and by the site
    lines = [anchor, "", f"### {experiment.title}", "", *table, ""]
    if experiment.command:
        lines += ["```sh", *(part for line in experiment.command for part in _continued(line)), "```", ""]
    notes = [experiment.measured_by] * bool(experiment.measured_by) + experiment.notes
    return lines + ([*_wrapped(" ".join(notes)), ""] if notes else []) + [*_wrapped(source), ""]


def _continued(command: str) -> list[str]:
    """One shell command over lines that fit, split by backslashes between its words; a comment stands above it.

    Quoted words and comments stay whole, so that what is copied from the page runs.
    """
    if len(command) <= CODE_WIDTH:
        return [command]
    code, mark, comment = command.partition("  # ")
    lines: list[str] = []
    for word in SHELL_WORD.findall(code):
        if lines and len(lines[-1]) + len(word) < CODE_WIDTH - len(" \\"):
            lines[-1] += f" {word}"
        else:
            lines.append(f"    {word}" if lines else word)
    return [f"# {comment}"] * bool(mark) + [f"{line} \\" for line in lines[:-1]] + lines[-1:]


def commands_page() -> str:
    """commands.md: every command with its arguments and options, from its own help."""
    root: Any = typer.main.get_command(app)
    lines = [
        "# Commands",
        "",
        MADE,
        "",
        *_wrapped(
            "Exit status of every command: 0 done, 1 an error that placegraph explains in one line on standard error, "
            "2 wrong usage or configuration. `ask` also ends with 3 when the object is not in the map. What `--json` "
            "prints is in [Files and formats](formats.md)."
        ),
        "",
        *_table(["command", "what it does"], [[f"[`{n}`](#{n})", _first_line(c)] for n, c in root.commands.items()]),
        "",
    ]
    for name, command in root.commands.items():
        lines += _command(name, command, 2)
    return "\n".join(lines).rstrip() + "\n"


def _command(name: str, command: Any, level: int) -> list[str]:
    """The section of a command, and of its subcommands."""
    anchor = name.replace(" ", "-")
    lines = [f"{'#' * level} {name}", ""]  # the anchor is what GitHub and the site make of this heading
    for paragraph in (command.help or "").split("\n\n"):
        lines += [*_wrapped(_escaped(" ".join(paragraph.split()))), ""]
    subcommands = getattr(command, "commands", None)
    if subcommands:
        rows = [[f"[`{n}`](#{anchor}-{n})", _first_line(c)] for n, c in subcommands.items()]
        lines += [*_table(["subcommand", "what it does"], rows), ""]
        for sub, subcommand in subcommands.items():
            lines += _command(f"{name} {sub}", subcommand, level + 1)
        return lines
    parameters = [p for p in command.params if p.name != "help"]
    arguments = [_argument(p) for p in parameters if p.param_type_name == "argument"]
    lines += ["```sh", " ".join(["placegraph", name, *arguments, *(["[OPTIONS]"] if parameters else [])]), "```", ""]
    rows = [[_spelled(p), _escaped(" ".join((p.help or "").split())) + _default(p)] for p in parameters]
    return lines + ([*_table(["argument or option", "meaning"], rows), ""] if rows else [])


def _argument(parameter: Any) -> str:
    """The argument as usage lines write it: in brackets when it may be left out, with dots when it repeats."""
    name = str(parameter.metavar or parameter.name.upper()).replace("...", "").strip("[]")
    shown = name if parameter.required else f"[{name}]"
    return f"{shown}..." if parameter.nargs == -1 else shown


def _spelled(parameter: Any) -> str:
    if parameter.param_type_name == "argument":
        name = _argument(parameter)  # a bar would end the cell, and in code an escaped one shows its backslash
        return f"<code>{name.replace('|', '&#124;')}</code>" if "|" in name else f"`{name}`"
    annotation = parameter.type_descriptor.annotation  # of typer 0.29; list[Path] is a repeatable option
    kind = next(iter(get_args(annotation)), annotation)
    value = "" if kind is bool else f" {parameter.metavar or VALUE_NAMES.get(kind, 'TEXT')}"
    return f"`{max(parameter.opts, key=len)}{value}`" + (" (required)" if parameter.required else "")


def _default(parameter: Any) -> str:
    default = parameter.default
    shown = isinstance(default, (str, int, float)) and not isinstance(default, bool) and str(default)
    return f" Default: `{default}`." if shown else ""  # not of a path, which depends on where placegraph lies


def _first_line(command: Any) -> str:
    return _escaped(" ".join((command.help or "").split("\n\n")[0].split()))


def _escaped(text: str) -> str:
    return text.replace("<", "&lt;").replace("|", "\\|")


def dataflow_page() -> str:
    """dataflow.md: which node takes and gives which message, and how each message travels."""
    return "\n".join(
        [
            "# Dataflow tables",
            "",
            MADE,
            "",
            *_wrapped(
                "Each node is an operating-system process. `placegraph graph` prints these tables from the code; "
                "[Design](design.md) explains them. The dataflow is a directed acyclic graph, which is checked when a "
                "configuration is read."
            ),
            "",
            "## Nodes",
            "",
            dataflow_table(),
            "",
            "## Messages",
            "",
            topic_table(),
            "",
        ]
    )


def _table(columns: list[str], rows: list[list[str]]) -> list[str]:
    return [f"| {' | '.join(columns)} |", "|---" * len(columns) + "|", *(f"| {' | '.join(row)} |" for row in rows)]


def _wrapped(text: str) -> list[str]:
    return textwrap.wrap(text, WIDTH, break_long_words=False, break_on_hyphens=False)


def readme_page() -> str:
    """README.md with its headline numbers taken from the results."""
    values = {(e.id, v.name): v for theme in load_results()[1] for e in theme.entries for v in e.values}
    rows = []
    for what, entry_id, name in HEADLINES:
        value = values[entry_id, name]
        rows.append([f"[{what}](docs/results.md#{entry_id})", value.shown, value.shown_goal])
    return _with_table(README, "headline", ["what", "value", "goal"], rows)


def changelog_page() -> str:
    """CHANGELOG.md with the settings that were renamed."""
    rows = [[_setting(old), _setting(new)] for old, new in RENAMED_SETTINGS.items()]
    return _with_table(CHANGELOG, "renamed settings", ["before", "now"], rows)


def _setting(path: str) -> str:
    """`node.table.key` as it stands in a configuration: its table and its key."""
    node, _, rest = path.partition(".")
    tables, _, key = rest.rpartition(".")
    return f"`[nodes.{'.'.join(filter(None, (node, tables)))}] {key}`"


def method_page() -> str:
    """docs/method.md with README's table of the paper's steps."""
    _, _, rest = README.read_text().partition("<!-- paper table: docs/generate.py copies it into docs/method.md -->\n")
    header, _, *rows = rest.partition("\n<!-- end of paper table -->")[0].splitlines()
    cells = [[cell.strip() for cell in row.strip("|").split("|")] for row in (header, *rows)]
    return _with_table(METHOD, "paper table", cells[0], cells[1:])


def _with_table(path: Path, name: str, columns: list[str], rows: list[list[str]]) -> str:
    """The text of a file with the table between its two marks of that name replaced."""
    start, end = f"<!-- {name}: made by docs/generate.py -->", f"<!-- end of {name} -->"
    before, mark, rest = path.read_text().partition(start)
    assert mark, f"{path} has no line {start}"
    return "\n".join([before + start, *_table(columns, rows), end]) + rest.partition(end)[2]


PAGES = {
    ROOT / "docs/results.md": results_page,
    ROOT / "docs/commands.md": commands_page,
    ROOT / "docs/dataflow.md": dataflow_page,
    README: readme_page,
    CHANGELOG: changelog_page,
    METHOD: method_page,
}


def main(arguments: list[str]) -> int:
    """Write the pages, or with --check only compare them. Returns the exit status."""
    stale = 0
    for path, make in PAGES.items():
        name, text = path.relative_to(ROOT), make()
        if path.exists() and path.read_text() == text:
            continue
        stale += 1
        if "--check" in arguments:
            print(f"{name} is not what the code and the data give: run `python docs/generate.py`")
        else:
            path.write_text(text)
            print(f"wrote {name}")
    return int(bool(stale) and "--check" in arguments)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
