"""The programs in examples/, run as a user runs them; ask_over_zenoh.py is run by tests/bus/test_questions.py."""

import re
import shutil
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


def run_as_module(tmp_path: Path, name: str, package: str, code: str) -> list[str]:
    """Lines printed by code for which the example is a module of a package, as if it had been copied there."""
    shutil.copy(EXAMPLES / name, tmp_path)
    code = f"import {package} as package\npackage.__path__.append({str(tmp_path)!r})\n{code}"
    return subprocess.run(
        [sys.executable, "-c", code], check=True, capture_output=True, text=True, cwd=tmp_path
    ).stdout.splitlines()


def test_a_camera_of_ones_own_gives_sound_frames_until_the_limit(tmp_path: Path) -> None:
    code = """
from placegraph.nodes.camera import CameraConfig, NODE
from placegraph.runtime.node import Context
node = NODE(CameraConfig(source="my_camera", limit=3, settings={"width": 64, "height": 48}), Context())
for message in node.messages():
    message.check()
    print(type(message).__name__, message.frame_id)
print(node.is_lossless())
"""
    lines = run_as_module(tmp_path, "my_camera.py", "placegraph.nodes.camera", code)
    assert lines == ["Frame 0", "Frame 1", "Frame 2", "End 2", "False"]


def test_a_relation_of_ones_own_is_asked_for(tmp_path: Path) -> None:
    row = re.search(r"^    (\"level\": .*),$", (EXAMPLES / "my_relation.py").read_text(), re.MULTILINE)
    assert row
    things = [
        {"id": name, "tags": [name.split()[-1]], "center": [x, 0, z], "size": [0.3, 0.3, 0.3]}
        for name, x, z in (("low picture", 0, 0.5), ("high picture", 2, 1.5), ("lamp", 1, 1.45))
    ]
    code = f"""
import json
from pathlib import Path
from placegraph.nodes.grounding.program import CONDITIONS, ConditionForm
from placegraph.runtime.query.request import make_question
from placegraph.tools.query.offline_query import OfflineQuery
CONDITIONS |= {{{row[1]}}}
Path("room.json").write_text(json.dumps({{"objects": {things!r}}}))
with OfflineQuery() as query:
    reply = query.ask(Path("room.json"), make_question("the picture level with the lamp", mode="rules"))
print(reply["object_id"], *reply["evidence"], sep="\\n")
"""
    lines = run_as_module(tmp_path, "my_relation.py", "placegraph.nodes.grounding.relations", code)
    assert lines[0] == "high picture" and any("differ by 0.05 m" in line for line in lines[1:])


def test_the_readme_names_every_program() -> None:
    text = (EXAMPLES / "README.md").read_text()
    assert all(re.search(rf"`{path.name}[ `]", text) for path in EXAMPLES.glob("*.py"))
