import json
import re

import pytest

from placegraph.runtime.messages.topics import TOPICS
from placegraph.runtime.scene_graph import SceneGraph
from placegraph.tools.graph import node_types


def test_the_tables_name_every_node_and_message(cli) -> None:
    done = cli("graph")
    assert done.code == 0 and done.err == ""
    nodes, topics = done.out.strip().split("\n\n")
    assert [line.split(" | ")[0].strip("| ") for line in nodes.splitlines()[2:]] == list(node_types())
    assert [line.split(" | ")[0].strip("| ") for line in topics.splitlines()[2:]] == [k.__name__ for k in TOPICS]
    assert "| recorder | " in nodes and nodes.count("| nothing |") == 3  # two sources take and one sink gives nothing


def test_givers_come_before_takers() -> None:
    types = node_types()
    seen = {kind for node in types.values() if not node.inputs for kind in node.outputs}
    for node in types.values():
        needed = {k for k in node.inputs if k not in node.feedback} & {k for t in types.values() for k in t.outputs}
        assert needed <= seen | set(node.outputs)
        seen |= set(node.outputs)


def test_the_tree_of_a_map_shows_every_node_below_its_parent(cli, mapped) -> None:
    done = cli("graph", mapped)
    assert done.code == 0 and done.err == ""
    graph = SceneGraph.load(mapped / "graph.json")
    path = []
    for line in done.out.splitlines():
        indent, node_id = re.match(r"( *)([BFRLO]\d+) ", line).groups()
        path = [*path[: len(indent) // 2], node_id]
        assert graph.nodes[node_id].parent == (path[-2] if len(path) > 1 else "")
        x, y, z = re.search(r"at \((\S+), (\S+), (\S+)\) size", line).groups()
        assert [float(x), float(y), float(z)] == pytest.approx(graph.nodes[node_id].center.tolist(), abs=0.0051)
    assert len(done.out.splitlines()) == len(graph.nodes) > 4
    assert re.search(r"O\d+ +chair \d", done.out)


def test_json_is_the_file(cli, mapped) -> None:
    text = (mapped / "graph.json").read_text()
    assert cli("graph", mapped, "--json").out == cli("graph", mapped / "graph.json", "--json").out == text
    assert json.loads(text)["version"] == 2


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ("", "not JSON"),
        ("[]", "expected graph version 2, found list"),
        ('{"version": 99, "nodes": []}', "expected graph version 2, found 99"),
        ('{"version": 2}', "'nodes' must be a list"),
        ('{"version": 2, "nodes": [], "connections": [], "ways": []}', "building"),
        ('{"version": 2, "nodes": [{"id": "X1"}], "connections": [], "ways": []}', "is not an id"),
    ],
)
def test_a_file_that_is_no_graph_is_named(cli, tmp_path, content, reason) -> None:
    (tmp_path / "graph.json").write_text(content)
    done = cli("graph", tmp_path)
    assert done.code == 1 and done.out == ""
    assert reason in done.reason


def test_a_folder_without_a_graph(cli, tmp_path) -> None:
    done = cli("graph", tmp_path)
    assert done.code == 1 and done.reason.startswith(f"{tmp_path}: no graph.json here; expected a map folder")
