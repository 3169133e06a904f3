"""A small unnamed house: a kitchen with a dining area, a living room, a bedroom."""

import numpy as np
import pytest

from placegraph.runtime.messages import Graph
from placegraph.runtime.scene_graph import GraphNode, SceneGraph, Tag

CONTENTS = {
    "L0": ["table", "chair", "chair", "chair", "chair", "cup", "cup"],
    "R0": ["fridge", "window"],
    "R1": ["sofa", "tv", "lamp", "armchair", "vase", "window", "picture", "coffee table", "book", "vase"],
    "R2": ["bed", "nightstand", "nightstand", "lamp", "vase", "window"],
}
PARENTS = {"B0": "", "F0": "B0", "R0": "F0", "R1": "F0", "R2": "F0", "L0": "R0"}


def make_node(node_id, parent, name=""):
    tags = (Tag(name, 1.0),) if name else ()
    box = np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]])
    return GraphNode(id=node_id, parent=parent, tags=tags, box=box, footprint=box[:, :2], first_frame=-1, last_frame=-1)


def make_graph(parents, contents):
    objects = [(parent, name) for parent, names in contents.items() for name in names]
    return SceneGraph.of(
        [make_node(*place) for place in parents.items()]
        + [make_node(f"O{number}", parent, name) for number, (parent, name) in enumerate(objects)]
    )


@pytest.fixture
def graph_of():
    return make_graph


@pytest.fixture
def house():
    return make_graph(PARENTS, CONTENTS)


@pytest.fixture
def message_of():
    def make(graph, revision=1, final=False):
        return Graph(frame_id=7, stamp_ns=9, revision=revision, final=final, json=graph.to_json())

    return make
