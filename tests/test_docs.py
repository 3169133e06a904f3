"""The documentation: made pages are up to date, names in it exist, README stays short, the site needs no network."""

import importlib.util
import json
import os
import re
import shlex
import subprocess
import sys
import tomllib
from html.parser import HTMLParser
from pathlib import Path

import pytest
import typer
import yaml

from placegraph.tools.cli import app
from placegraph.tools.graph import node_types

ROOT = Path(__file__).parents[1]
PAGES = sorted((ROOT / "docs").glob("*.md"))
WRITTEN = [
    path for path in (*PAGES, *ROOT.glob("*.md")) if path.stem not in ("results", "commands", "dataflow", "LICENSE")
]
MAX_README_BYTES = 8192
MAX_LINE = 120
FOLDERS = "runtime|nodes|models_onnx|configs|tools|tests|docs|results|examples"
CODE_FOLDERS = ("configs", "models_onnx", "nodes", "runtime", "tools", "tests", "examples")
NOT_KEPT = ("models_onnx/weights", "configs/Replica")  # a folder that a user may fill; a folder of another repository
UNPUBLISHED = re.compile(
    r"METHOD|FACTS|ARCHITECTURE|REAL_MODELS|STYLE\.md|README, |(?<!llama\.cpp )(?<!its )\bissue \d+"
)


def generator():
    """docs/generate.py as a module; it is not part of the package."""
    spec = importlib.util.spec_from_file_location("docs_generate", ROOT / "docs" / "generate.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # pydantic looks its models' annotations up there
    spec.loader.exec_module(module)
    return module


GENERATOR = generator()


@pytest.mark.parametrize("path", GENERATOR.PAGES, ids=lambda path: path.name)
def test_made_pages_are_what_code_and_results_give(path: Path) -> None:
    assert path.read_text() == GENERATOR.PAGES[path](), "run `python docs/generate.py`"


def test_readme_is_short() -> None:
    assert len((ROOT / "README.md").read_bytes()) <= MAX_README_BYTES


@pytest.mark.parametrize("path", WRITTEN, ids=lambda path: path.name)
def test_lines_fit(path: Path) -> None:
    long = [line for line in path.read_text().splitlines() if len(line) > MAX_LINE]
    assert long == []


@pytest.mark.parametrize("path", [*WRITTEN, ROOT / "docs/results.md"], ids=lambda path: path.name)
def test_files_named_exist(path: Path) -> None:
    text = path.read_text()
    for name in re.findall(rf"(?<![\w./-])((?:{FOLDERS})/[\w/.-]*[\w/])", text):
        assert (ROOT / name).exists(), name
    for target in re.findall(r"\]\(([\w/.-]+)(?:#[\w-]+)?\)", text):
        assert (path.parent / target).exists(), f"a link to {target}"


@pytest.mark.parametrize("path", [*WRITTEN, ROOT / "docs/results.md"], ids=lambda path: path.name)
def test_commands_named_exist(path: Path) -> None:
    text = re.sub(r"^\| `placegraph [^|]*\|", "", path.read_text(), flags=re.MULTILINE)  # the changelog's old names
    commands = typer.main.get_command(app).commands
    for code in re.findall(r"```.*?```|`[^`]+`", text if path.name == "CHANGELOG.md" else path.read_text(), re.DOTALL):
        for name, sub in re.findall(r"(?:^|/|`)placegraph ([a-z][a-z-]*)(?: ([a-z][a-z-]*))?", code, re.MULTILINE):
            assert name in commands, code
            subcommands = getattr(commands[name], "commands", None)
            assert not subcommands or not sub or sub in subcommands, code


@pytest.mark.parametrize(
    "path", [*WRITTEN, ROOT / "docs/results.md", ROOT / "examples/README.md"], ids=lambda p: p.name
)
def test_command_lines_have_the_arguments_that_they_need(path: Path) -> None:
    for block in re.findall(r"```sh\n(.*?)```", path.read_text(), re.DOTALL):
        for line in block.replace("\\\n", " ").splitlines():
            words = shlex.split(line, comments=True)
            for start in [i for i, word in enumerate(words) if re.fullmatch(r"(\S*/bin/)?placegraph", word)]:
                if words[start - 1 : start] == ["cd"]:
                    continue
                command, arguments = typer.main.get_command(app), words[start + 1 :]
                arguments = arguments[: arguments.index("&&")] if "&&" in arguments else arguments
                while hasattr(command, "commands"):
                    command, arguments = command.commands[arguments[0]], arguments[1:]
                command.make_context("placegraph", list(arguments))  # raises UsageError


def test_made_usage_and_command_lines() -> None:
    graph = typer.main.get_command(app).commands["graph"]
    assert "placegraph graph [MAP] [OPTIONS]" in GENERATOR._command("graph", graph, 2)
    long = 'placegraph x --first "two words" ' + "--more value " * 6 + "--last 'three more words'  # needs \"a\""
    lines = GENERATOR._continued(long)
    assert lines[0] == '# needs "a"' and all(len(line) <= GENERATOR.CODE_WIDTH for line in lines)
    assert shlex.split("\n".join(lines).replace("\\\n", " "), comments=True) == shlex.split(long, comments=True)


@pytest.mark.parametrize("name", ["README.md", "docs/design.md"])
def test_every_node_is_named(name: str) -> None:
    text = (ROOT / name).read_text()
    unnamed = [node for node in node_types() if not re.search(rf"\b{node}\b", text)]
    assert [node for node in unnamed if (name, node) != ("README.md", "playback")] == []


def test_results_hold_what_a_number_needs() -> None:
    machines, themes = GENERATOR.load_results()
    experiments = [e for theme in themes for e in (*theme.entries, *theme.tables)]
    assert len({e.id for e in experiments}) == len(experiments)
    assert {e.machine for e in experiments} <= set(machines)
    assert all(e.command or e.measured_by for e in experiments)
    for table in (table for theme in themes for table in theme.tables):
        assert {len(row) for row in table.rows} == {len(table.columns)}


@pytest.mark.parametrize("path", sorted((ROOT / "results").glob("*.json")), ids=lambda path: path.name)
def test_results_are_written_canonically(path: Path) -> None:
    text = path.read_text()
    assert text == json.dumps(json.loads(text), indent=2, ensure_ascii=False) + "\n"


def test_a_missed_goal_is_missed() -> None:
    def value(number: float, goal: str | None) -> bool:
        return GENERATOR.Value(name="x", value=number, goal=goal).is_missed

    assert not value(1.0, None)
    assert value(0.7, ">= 0.75") and not value(0.75, ">= 0.75")
    assert value(2, "<= 1") and not value(1, "<= 1")


def test_pages_that_code_cites_exist() -> None:
    for folder in CODE_FOLDERS:
        for path in (ROOT / folder).rglob("*.py"):
            for page, anchor in re.findall(r"(docs/\w+\.md)(?:#([\w-]+))?", path.read_text()):
                assert (ROOT / page).exists(), f"{path}: {page}"
                headings = re.findall(r"^#+ (.*)", (ROOT / page).read_text(), re.MULTILINE)
                slugs = {re.sub(r"[^\w -]", "", heading.lower()).strip().replace(" ", "-") for heading in headings}
                assert not anchor or anchor in slugs, f"{path}: {page}#{anchor}"


def test_files_that_code_and_model_cards_cite_exist() -> None:
    paths = [path for folder in CODE_FOLDERS for path in sorted((ROOT / folder).rglob("*"))]
    python_files = {path.name for path in (*paths, ROOT / "docs/generate.py") if path.suffix == ".py"}
    missing = []
    for path in (path for path in paths if path.suffix in (".py", ".md", ".toml", ".txt", ".sh")):
        text = path.read_text()
        cited = re.findall(rf"(?<![\w./-])((?:{'|'.join(CODE_FOLDERS)})/[\w/.-]*\w)", text)
        missing += [f"{path}: {name}" for name in cited if name not in NOT_KEPT and not (ROOT / name).exists()]
        names = re.findall(r"(?<![\w/.*-])(\w+\.py)\b", text)  # without a folder
        missing += [f"{path}: {name}" for name in names if name not in python_files]
    assert missing == []


def test_code_cites_only_what_the_repository_holds() -> None:
    hits = [
        f"{path.relative_to(ROOT)}:{number}: {line.strip()}"
        for folder in CODE_FOLDERS
        for path in sorted((ROOT / folder).rglob("*"))
        if path.suffix in (".py", ".md", ".toml", ".txt", ".sh") and path != Path(__file__)
        for number, line in enumerate(path.read_text().splitlines(), 1)
        if UNPUBLISHED.search(line)
    ]
    assert hits == []


def test_citation_names_the_paper() -> None:
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert citation["version"] == project["version"] and citation["license"] == project["license"]
    assert "Hierarchical Scene Graph" in citation["preferred-citation"]["title"]


def test_hooks_and_constraints_pin_the_same_linter() -> None:
    hooks = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text())["repos"]
    assert [repository["repo"] for repository in hooks] == ["local"], "a hook that git would clone"
    pins = (ROOT / "constraints.txt").read_text().splitlines()
    wanted = {
        d for r in hooks for h in r["hooks"] for d in h.get("additional_dependencies", ()) if d.startswith("ruff")
    }
    assert wanted <= set(pins)


@pytest.mark.parametrize("path", sorted((ROOT / ".github" / "workflows").glob("*.yml")), ids=lambda path: path.name)
def test_workflows_run_files_that_exist(path: Path) -> None:
    jobs = yaml.safe_load(path.read_text())["jobs"]
    for step in (step for job in jobs.values() for step in job["steps"] if step.get("run", "").startswith("bash ")):
        assert (ROOT / step["run"].split()[1]).is_file()


class _Fetched(HTMLParser):
    """Addresses that a browser fetches by itself when it shows a page; links that a person follows are not."""

    def __init__(self) -> None:
        super().__init__()
        self.addresses: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = dict(attrs)
        self.addresses += [values[key] or "" for key in ("src", "srcset", "data", "poster") if key in values]
        if tag == "link" and values.get("rel") not in ("canonical", "next", "prev"):
            self.addresses.append(values.get("href") or "")


def test_the_site_builds_without_warnings_and_fetches_nothing(tmp_path: Path) -> None:
    pytest.importorskip("mkdocs", reason="needs the extra docs")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(tmp_path / "site")]
    environment = os.environ | {"NO_MKDOCS_2_WARNING": "1"}
    built = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, env=environment, check=False)
    assert built.returncode == 0 and built.stderr.strip() == "", built.stderr
    pages = sorted((tmp_path / "site").rglob("*.html"))
    assert {page.stem for page in PAGES} <= {page.stem for page in pages}
    for page in pages:
        fetched = _Fetched()
        fetched.feed(page.read_text())
        assert [a for a in fetched.addresses if re.match(r"(?:\w+:)?//", a)] == [], page
    for sheet in (tmp_path / "site").rglob("*.css"):
        assert re.findall(r"(?:url\(|@import )[\"']?(?:\w+:)?//", sheet.read_text()) == [], sheet
