"""The programs in examples/, run as a user runs them; ask_over_zenoh.py is run by tests/bus/test_questions.py."""

import subprocess
import sys
from pathlib import Path

import pytest

from placegraph.runtime.scene_graph import SceneGraph

EXAMPLES = Path(__file__).parents[2] / "examples"
FLOW = """
[nodes.camera]
source = "flat"
settings = { width = 160, height = 120, frames = 120 }
limit = 45

[nodes.pose]
method = "given"

[nodes.keyframe]

[nodes.instances]
model = "drawn_scene"

[nodes.fusion]

[nodes.hierarchy]
"""


@pytest.fixture(scope="module")
def mapped(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("examples")
    (folder / "small.toml").write_text(FLOW)
    command = [sys.executable, "-m", "placegraph.tools.cli", "run", "small.toml", "--inline", "--quiet", "--out", "map"]
    subprocess.run(command, cwd=folder, check=True, capture_output=True)
    return folder / "map"


def run(name: str, *arguments: object) -> list[str]:
    command = [sys.executable, str(EXAMPLES / name), *map(str, arguments)]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()


def test_rooms_and_their_objects_are_listed(mapped: Path) -> None:
    graph, lines = SceneGraph.load(mapped / "graph.json"), run("list_objects.py", mapped)
    assert [line.split()[0] for line in lines if line.startswith("R")] == [room.id for room in graph.layer("room")]
    things = sorted(line.split()[0] for line in lines if line.startswith("  O"))
    assert things == sorted(thing.id for thing in graph.layer("object"))


def test_a_route_leads_to_the_nearest_object_of_a_name(mapped: Path) -> None:
    graph = SceneGraph.load(mapped / "graph.json")
    thing = next(thing for thing in graph.layer("object") if thing.approach)
    lines = run("route_to_object.py", mapped, thing.name, *thing.approach.position)
    assert f" {thing.name}: 0.00 m" in lines[0] and lines[-1].startswith("look to ")
    with pytest.raises(subprocess.CalledProcessError):
        run("route_to_object.py", mapped, "unicorn", 0, 0, 0)


def test_an_object_list_is_asked(mapped: Path) -> None:
    lines = run("ask_object_list.py", "the chair next to the table")
    assert lines[0] == "found other chair" and any("table" in line for line in lines[1:])


def test_the_readme_names_every_program() -> None:
    text = (EXAMPLES / "README.md").read_text()
    assert all(f"`{path.name} " in text for path in EXAMPLES.glob("*.py"))
