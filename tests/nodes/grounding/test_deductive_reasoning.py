import numpy as np
import pytest

from placegraph.nodes.grounding.deductive_reasoning import MAX_LISTED, deduce
from placegraph.nodes.grounding.llm_selection import MAX_CALLS
from placegraph.nodes.grounding.program_executor import ProgramExecutor
from placegraph.runtime.errors import QueryError
from placegraph.runtime.language.language_model import LanguageModel
from placegraph.runtime.scene_graph import SceneGraph

NOWHERE = np.full(3, np.nan)


class Careful(LanguageModel):
    """The packaged model; every call is checked to fit the context."""

    def complete(self, text, program_grammar, max_tokens, prefix="", suffix=""):
        assert self.fits(prefix, text, max_tokens, suffix)
        return super().complete(text, program_grammar, max_tokens, prefix=prefix, suffix=suffix)


@pytest.fixture(scope="module")
def model():
    made = Careful()
    yield made
    made.close()


@pytest.fixture
def places(node_of):
    """A building with one floor and one room without a name, to hang things in."""
    return [
        node_of("B0", "", "building", (0, 0, 0), (9, 9, 3)),
        node_of("F0", "B0", "floor 1", (0, 0, 0), (9, 9, 3)),
        node_of("R0", "F0", "", (0, 0, 0), (9, 9, 3)),
    ]


def test_an_empty_graph_asks_nothing(model, names, places):
    before = model.calls
    for nodes in (places[:1], places[:2], places):
        reading, ranking = deduce(model, ProgramExecutor(SceneGraph.of(nodes), names, NOWHERE), "the lamp")
        assert (reading.targets, ranking.candidates) == ([], [])
        assert "nothing in the map" in ranking.notes[-1]
    assert model.calls == before


def test_what_is_no_question_is_refused(model, names, house):
    for text in ("", "  ", "кружка", "x " * 5000):
        with pytest.raises(QueryError):
            deduce(model, ProgramExecutor(house, names, NOWHERE), text)


def test_one_floor_and_no_room_named_ask_for_objects_only(model, names, places, thing_of):
    things = [thing_of(i, "R0", name, (i, i, 1), (0.3, 0.3, 0.3)) for i, name in enumerate(("lamp", "bed", ""))]
    graph, before = SceneGraph.of([*places, *things]), model.calls
    reading, ranking = deduce(model, ProgramExecutor(graph, names, NOWHERE), "the lamp near the bed")
    assert model.calls - before == 2  # which objects, and which one
    assert (reading.floors, reading.rooms, reading.locations) == (["F0"], ["R0"], [])
    assert reading.targets and set(reading.targets) | set(reading.anchors) <= {"O0", "O1", "O2"}
    assert {candidate.node.id for candidate in ranking.candidates} <= set(reading.targets)


def test_each_level_is_narrowed_within_the_one_above(model, names, house):
    before = model.calls
    asker = np.array([5.0, 1.0, 1.5])
    (reading, ranking), again = (
        deduce(model, ProgramExecutor(house, names, asker), "the vase near the window") for _ in range(2)
    )
    assert reading == again[0] and ranking.notes == again[1].notes
    assert 2 <= (model.calls - before) / 2 <= 5
    assert not ranking.sure
    for lower, upper in ((reading.rooms, reading.floors), (reading.locations, reading.rooms)):
        assert all(house.nodes[one].parent in upper for one in lower)
    for one in reading.targets + reading.anchors:
        assert house.room_of(one) in reading.rooms
    kept = [note for note in ranking.notes if "kept" in note]
    assert kept and all(": " in note for note in kept)  # with the model's reason
    if reading.anchors:
        assert "left, right, front and behind are meant from the asker" in ranking.notes


def test_a_graph_of_5000_objects_in_one_room(model, names, places, thing_of):
    kinds = ("lamp", "sofa", "<|im_end|>", "x" * 400, *(f"thing {i}" for i in range(96)))
    things = [
        thing_of(
            i, "R0", kinds[i % 100], (i % 70 / 8, i // 70 / 8, 1), (0.1, 0.1, 0.1), (9, 9, 9), [("part " * 40, 4.0)]
        )
        for i in range(5000)
    ]
    graph, before = SceneGraph.of([*places, *things]), model.calls
    reading, ranking = deduce(model, ProgramExecutor(graph, names, NOWHERE), "the lamp left of the sofa")
    assert model.calls - before <= MAX_CALLS + 1
    # the 100 that are called lamp or sofa come before all others, and more than are shown bear the names
    assert all(int(one[1:]) % 100 < 2 for one in reading.targets + reading.anchors)
    assert any(note.startswith(f"of 5000 objects those {MAX_LISTED} named most like") for note in ranking.notes)
