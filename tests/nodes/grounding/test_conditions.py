"""Any program that the schema allows, on any map: no error, no warning, only ids that exist, the same twice."""

import random

import numpy as np
import pytest

from placegraph.nodes.grounding.program import CONDITIONS, MAX_DEPTH, Condition, Program, Thing
from placegraph.nodes.grounding.program_executor import ProgramExecutor
from placegraph.runtime.scene_graph import SceneGraph

NOUNS = (
    "thing", "", "one", "chairs", "table", "window", "wall", "floor", "corner", "room", "ceiling", "door", "enter",
    "bed", "zebra", "o3", "r1", "kitchen", "lamp", "center", "nightstand",
)  # fmt: skip
WORDS = ("red", "dark brown", "big", "burnt", "upstairs", "second floor", "sit on", "wooden", "9")


def random_thing(luck, depth=1):
    conditions = []
    for _ in range(luck.choice((0, 1, 1, 2, 3, 4)) if depth == 1 else luck.choice((0, 0, 1, 2))):
        name = luck.choice(list(CONDITIONS))
        form = CONDITIONS[name]
        count = luck.randint(*form.things)
        if count and depth == MAX_DEPTH:
            continue
        number = {"never": 0, "may": luck.choice((0, 1, 2, 9)), "must": luck.randint(1, 9)}[form.number]
        things = tuple(random_thing(luck, depth + 1) for _ in range(count))
        words = luck.choice(WORDS) if form.words else ""
        conditions.append(Condition(name=name, things=things, words=words, number=number, negated=luck.random() < 0.15))
    return Thing(noun=luck.choice(NOUNS), conditions=tuple(conditions))


@pytest.fixture(scope="module")
def maps(house, unnamed_house, request):
    node_of, room_of = request.getfixturevalue("node_of"), request.getfixturevalue("room_of")
    flat = [(name, (1, 1, 1), (0, 0, 0)) for name in ("chair", "chair", "table", "", "door")]  # all in one point
    alone = SceneGraph.of([node_of("B0", "", "building", (0, 0, 0), (1, 1, 1))])
    return house, unnamed_house, alone, room_of(("cup", (1, 1, 1), (0.1, 0.1, 0.1))), room_of(*flat)


@pytest.mark.parametrize("seed", range(4))
def test_any_program_on_any_map(maps, names, seed):
    luck = random.Random(seed)
    for _ in range(60):
        graph, program = luck.choice(maps), Program(target=random_thing(luck))
        asker = np.array([luck.uniform(0, 5), luck.uniform(0, 5), 1.5]) if luck.random() < 0.3 else np.full(3, np.nan)
        first, again = (ProgramExecutor(graph, names, asker).rank(program) for _ in range(2))
        assert first == again
        for candidate in first.candidates:
            assert candidate.node.id in graph.nodes
            assert 0 <= candidate.score <= 1
            assert all(candidate.evidence)
