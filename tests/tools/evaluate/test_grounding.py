import json

import numpy as np
import pytest

from placegraph.runtime.errors import SourceError
from placegraph.runtime.scene_graph import SceneGraph
from placegraph.tools.evaluate.grounding import GroundingResult, ask_all, eye_in_map, grounding_scores, read_questions
from placegraph.tools.simulator.questions import AskedQuestion, to_json

BOX = np.array([[0.0, 0, 0], [1, 1, 1]])


def question(form, text="find the chair", viewpoint=None):
    return AskedQuestion(text, 0, BOX, form, (), 0, 0, viewpoint)


def reply(object_id, status="found", calls=0, ms=2.0):
    return GroundingResult(status, object_id, calls, ms)


def moved(x):
    return BOX + np.array([x, 0, 0])


def write(folder, rows):
    (folder / "truth").mkdir(exist_ok=True)
    (folder / "truth" / "questions.json").write_text(rows if isinstance(rows, str) else json.dumps(rows))


def test_no_questions() -> None:
    found = grounding_scores([], [], {})
    assert found["all"]["questions"] == 0 and np.isnan(found["all"]["acc_0.5"]) and found["forms"] == {}


def test_by_hand() -> None:
    # IoUs 1, 1/3 (moved by half), none, none
    boxes = {"O1": BOX, "O2": moved(0.5), "O3": moved(3)}
    asked = [question("near"), question("near"), question("left"), question("left")]
    replies = [reply("O1"), reply("O2", calls=2), reply("O3", ms=6), reply("", "not_in_map")]
    found = grounding_scores(asked, replies, boxes)
    assert [found["all"][f"acc_{t}"] for t in ("0.1", "0.25", "0.5", "0.75")] == [0.5, 0.5, 0.25, 0.25]
    assert [found["forms"]["near"][f"acc_{t}"] for t in ("0.25", "0.5")] == [1, 0.5]
    assert found["forms"]["left"]["not_in_map"] == 1 and found["forms"]["left"]["acc_0.1"] == 0
    assert (found["all"]["ms"], found["all"]["calls"], found["all"]["errors"]) == (3, 0.5, 0)
    assert list(found["forms"]) == ["left", "near"]


def test_the_overlap_must_exceed_the_threshold() -> None:
    half = {"O1": np.array([[0.0, 0, 0], [1, 1, 0.5]])}
    found = grounding_scores([question("near")], [reply("O1")], half)
    assert found["all"]["acc_0.25"] == 1 and found["all"]["acc_0.5"] == 0


def test_an_error_is_wrong_and_counted() -> None:
    found = grounding_scores([question("near")], [reply("", "error")], {"": BOX})
    assert (found["all"]["errors"], found["all"]["acc_0.1"]) == (1, 0)


def test_questions_are_read_with_and_without_a_viewpoint(tmp_path) -> None:
    assert read_questions(tmp_path) is None
    write(tmp_path, to_json([question("near", viewpoint=np.array([1.0, 2, 3])), question("left", "the chair")]))
    first, second = read_questions(tmp_path)
    assert first.viewpoint.tolist() == [1, 2, 3] and second.viewpoint is None
    assert (second.text, second.form, second.box.tolist()) == ("the chair", "left", BOX.tolist())


@pytest.mark.parametrize("rows", ["", "[", "{}", "[3]", [{"text": "the chair"}]])
def test_a_damaged_file_is_named(tmp_path, rows) -> None:
    write(tmp_path, rows)
    with pytest.raises(SourceError, match=r"questions\.json: "):
        read_questions(tmp_path)


def test_a_stored_map_is_asked(mapped) -> None:
    name = SceneGraph.load(mapped / "graph.json").layer("object")[0].name
    replies = ask_all(mapped, [question("a", f"find the {name}"), question("b", "find the submarine")], np.eye(4))
    assert [one.status for one in replies] == ["found", "not_in_map"]
    assert replies[0].object_id.startswith("O") and replies[1].object_id == ""
    assert all(one.calls == 0 and one.ms > 0 for one in replies)


def test_the_asker_is_moved_into_the_frame_of_the_map() -> None:
    true_from_map = np.array([[0.0, -1, 0, 10], [1, 0, 0, 0], [0, 0, 1, 2], [0, 0, 0, 1]])
    assert eye_in_map(question("a", viewpoint=np.array([9.0, 3, 4])), true_from_map) == pytest.approx([3, 1, 2])
    assert eye_in_map(question("b"), true_from_map) is None
