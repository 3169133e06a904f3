"""How many rooms and locations of generated houses are named right, by each method, from the true lists of objects.

    python tests/measurements/place_names.py [FIRST-LAST] [MODEL.gguf]

Prints for each method and layer: places, right first names, seconds a house, calls of the language model.
"""

import dataclasses
import sys
import time

from placegraph.nodes.naming import NODE, NamingConfig
from placegraph.runtime.language.word_forms import normal_form, synonyms
from placegraph.runtime.messages import Graph
from placegraph.runtime.node import Context
from placegraph.runtime.scene_graph import SceneGraph
from placegraph.tools.simulator.ground_truth_graph import ground_truth_graph
from placegraph.tools.simulator.house_frames import generate_house


def without_place_names(graph: SceneGraph) -> Graph:
    """The graph as hierarchy would give it."""
    nodes = [
        dataclasses.replace(node, tags=()) if node.layer in ("room", "location") else node
        for node in graph.nodes.values()
    ]
    return Graph(frame_id=0, stamp_ns=0, revision=0, final=True, json=graph.with_nodes(nodes).to_json())


def is_right(name: str, truth: str) -> bool:
    """Whether both are the same type of place, synonyms included."""
    name, truth = normal_form(name), normal_form(truth)
    return name == truth or truth in synonyms().get(name, ())


def main(seeds: range, model_path: str) -> None:
    """Print one line a method and layer."""
    truths = [ground_truth_graph(generate_house(seed)) for seed in seeds]
    for method in ("evidence", "language_model"):
        node = NODE(NamingConfig(method=method, model_path=model_path), Context())
        began_s = time.monotonic()
        named = [SceneGraph.from_json(node.step(without_place_names(truth))[0].json) for truth in truths]
        seconds = (time.monotonic() - began_s) / len(truths)
        for layer in ("room", "location"):
            pairs = [(graph.nodes[place.id], place) for graph, truth in zip(named, truths, strict=True)
                     for place in truth.layer(layer)]  # fmt: skip
            right = sum(is_right(found.tags[0].name, place.name) for found, place in pairs if found.tags)
            print(f"{method:15} {layer:9} {right:4} of {len(pairs):4} right ({right / len(pairs):.2f})", end="  ")
            print(f"{seconds:.1f} s a house, {node._model.calls} calls")
        node.stop()


if __name__ == "__main__":
    first, last = map(int, (sys.argv[1:2] or ["400-409"])[0].split("-"))
    main(range(first, last + 1), sys.argv[2] if len(sys.argv) > 2 else "")
