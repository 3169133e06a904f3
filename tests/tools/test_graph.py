import dataclasses
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from placegraph.runtime.messages.topics import TOPICS
from placegraph.runtime.scene_graph import SceneGraph
from placegraph.runtime.scene_graph.place_graph import Connection, RouteSegment
from placegraph.tools.graph import node_types


def test_the_tables_name_every_node_and_message(cli) -> None:
    done = cli("graph")
    assert done.code == 0 and done.err == ""
    nodes, topics = done.out.strip().split("\n\n")
    assert [line.split(" | ")[0].strip("| ") for line in nodes.splitlines()[2:]] == list(node_types())
    assert [line.split(" | ")[0].strip("| ") for line in topics.splitlines()[2:]] == [k.__name__ for k in TOPICS]
    assert "| recorder | " in nodes and nodes.count("| nothing |") == 3  # two sources and one sink


def test_producers_come_before_consumers() -> None:
    types = node_types()
    seen = {kind for node in types.values() if not node.inputs for kind in node.outputs}
    for node in types.values():
        needed = set(node.inputs) & {k for t in types.values() for k in t.outputs}
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


KINDS = {"object": dict, "array": list, "string": str, "integer": int, "number": (int, float), "null": type(None)}


def problems(value: Any, schema: dict[str, Any], root: dict[str, Any], where: str = "graph") -> list[str]:
    """What a JSON value has against the part of JSON Schema that graph.json's uses; unknown fields count, too."""
    if "$ref" in schema:
        return problems(value, root["$defs"][schema["$ref"].rpartition("/")[2]], root, where)
    if "anyOf" in schema:
        options = [problems(value, option, root, where) for option in schema["anyOf"]]
        return [] if [] in options else options[0]
    if "const" in schema or "enum" in schema:
        return [] if value in schema.get("enum", [schema.get("const")]) else [f"{where}: {value}"]
    if not isinstance(value, KINDS[schema["type"]]):
        return [f"{where}: {value} is no {schema['type']}"]
    found = []
    if isinstance(value, str):
        found += [where] * (re.search(schema.get("pattern", ""), value) is None)
    if isinstance(value, list):
        found += [f"{where}: size"] * (not schema.get("minItems", 0) <= len(value) <= schema.get("maxItems", 1e9))
        items = [*schema.get("prefixItems", []), *[schema.get("items", {})] * len(value)]
        for i, item in enumerate(value):
            found += problems(item, items[i], root, f"{where}[{i}]")
    if isinstance(value, dict):
        known, others = schema.get("properties", {}), schema.get("additionalProperties")
        found += [f"{where}: no {name}" for name in schema.get("required", []) if name not in value]
        for name, item in value.items():
            field = known.get(name, others)
            found += problems(item, field, root, f"{where}.{name}") if field else [f"{where}: unknown {name}"]
    return found


def graph_with_all_parts(folder: Path) -> dict[str, Any]:
    """A map's graph with a second room, a door and a way to it, which a map of so few frames lacks."""
    graph = SceneGraph.load(folder / "graph.json")
    room = graph.layer("room")[0]
    other_room = dataclasses.replace(room, id="R9")
    ends = np.array([[1.0, 1, 0], [1, 1, 0]])
    door = Connection(id="C0", kind="door", rooms=(room.id, "R9"), ends=ends, width_m=0.9, length_m=0.0)
    way = RouteSegment(room=room.id, ends=("C0", room.id), length_m=1.0, points=np.array([[1.0, 1], [2, 1]]))
    return dict(json.loads(SceneGraph.of([*graph.nodes.values(), other_room], [door], [way]).to_json()))


def test_a_real_graph_fits_the_published_schema_and_a_wrong_one_does_not(cli, mapped: Path) -> None:
    schema = json.loads(cli("graph", "--schema").out)
    document = graph_with_all_parts(mapped)
    assert document["connections"] and document["ways"] and document["nodes"][-1]["approach"]
    assert problems(document, schema, schema) == []
    document["nodes"][-1]["box"].pop()
    document["ways"][0]["points"][0][1] = "1"
    del document["connections"][0]["kind"]
    document["nodes"][0]["id"] = "X1"
    assert len(problems(document, schema, schema)) == 4


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ("", "not JSON"),
        ("[]", "Input should be an object"),
        ('{"version": 99, "nodes": []}', "expected graph version 2, found 99"),
        ('{"version": 2}', "nodes: Field required"),
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
