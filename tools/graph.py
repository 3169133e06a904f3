"""`placegraph graph`: the dataflow as tables, made from the code, or the scene graph of a map."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from placegraph.runtime.messages import Message
from placegraph.runtime.messages.topics import TOPICS
from placegraph.runtime.node import NODES, Node, available, plugin
from placegraph.runtime.scene_graph import SceneGraph
from placegraph.tools.map_files.map_folder import read_graph


def graph(
    map_folder: Annotated[
        Path | None, typer.Argument(metavar="MAP", help="A map folder or graph file: print its graph instead.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the graph's canonical JSON.")] = False,
    schema: Annotated[bool, typer.Option("--schema", help="Print the JSON Schema of graph.json.")] = False,
) -> None:
    """Print the dataflow as tables or, with MAP, the hierarchy of a map."""
    if schema:
        print(json.dumps(SceneGraph.json_schema(), indent=1))
        return
    if map_folder is None:
        print(dataflow_table())
        print()
        print(topic_table())
        return
    scene_graph = read_graph(map_folder)
    print(scene_graph.to_json() if as_json else tree(scene_graph))


def node_types() -> dict[str, type[Node]]:
    """Every node class by name, in the order of the dataflow (producers before consumers, otherwise by name)."""
    types: dict[str, type[Node]] = {name: plugin(NODES, name, "NODE", "node") for name in available(NODES)}
    order: list[str] = []
    waiting = sorted(types)
    while waiting:
        for name in waiting:
            producers = [other for other in waiting if other != name]
            if not any(kind in types[other].outputs for kind in types[name].inputs for other in producers):
                break
        order.append(name)
        waiting.remove(name)
    return {name: types[name] for name in order}


def _names(kinds: tuple[type[Message], ...]) -> str:
    return ", ".join(kind.__name__ for kind in kinds) or "nothing"


def dataflow_table() -> str:
    """Markdown table of the nodes."""
    rows = ["| node | inputs | outputs |", "|---|---|---|"]
    rows += [f"| {n} | {_names(t.inputs)} | {_names(t.outputs)} |" for n, t in node_types().items()]
    return "\n".join(rows)


def topic_table() -> str:
    """Markdown table of the topics."""
    rows = ["| message | key | delivery | producer waits when ahead by | recorded |", "|---|---|---|---|---|"]
    for topic in TOPICS.values():
        credit = str(topic.credit) if topic.credit else "never waits"
        recorded = "yes" if topic.recorded else "no"
        rows.append(f"| {topic.kind.__name__} | {topic.key} | {topic.delivery} | {credit} | {recorded} |")
    return "\n".join(rows)


def tree(graph: SceneGraph) -> str:
    """The hierarchy as indented lines: id, name, tags with weights, centre and size."""
    lines: list[str] = []

    def add(node_id: str, depth: int) -> None:
        node = graph.nodes[node_id]
        size = node.box[1] - node.box[0]
        tags = ", ".join(f"{tag.name} {tag.weight:.2f}" for tag in node.tags[:3])
        where = f"at ({', '.join(f'{v:.2f}' for v in node.center)}) size ({', '.join(f'{v:.2f}' for v in size)}) m"
        lines.append(f"{'  ' * depth}{node.id:<5}{tags or node.layer}  {where}")
        for child in graph.children(node_id):
            add(child.id, depth + 1)

    add(graph.building.id, 0)
    return "\n".join(lines)
