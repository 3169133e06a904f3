import json

import pytest

from placegraph.runtime.errors import SchemaError
from placegraph.runtime.query.reply import Reply
from placegraph.runtime.query.request import make_question
from placegraph.tools.query.offline_query import MAX_OPEN_FILES, OfflineQuery, with_own_ids

FAST = {"use_model": False}


def chairs(ids):
    things = [{"id": own, "tags": ["chair"], "center": [i, 0, 0], "size": [0.5, 0.5, 1]} for i, own in enumerate(ids)]
    return json.dumps({"objects": things, "rooms": [{"id": "k 1", "name": "kitchen"}]})


@pytest.fixture
def answerer():
    with OfflineQuery(FAST) as made:
        yield made


def test_a_map_folder_and_its_graph_file_answer_alike(answerer, mapped) -> None:
    question = make_question("the refrigerator", question_id="Q1")
    replies = [answerer.ask(path, question) for path in (mapped, mapped / "graph.json")]
    assert all(Reply.model_validate(reply).status == "found" for reply in replies)
    assert [reply | {"ms": 0} for reply in replies[:1]] == [reply | {"ms": 0} for reply in replies[1:]]


def test_each_file_is_answered_from_its_own_graph_and_ids(answerer, tmp_path) -> None:
    paths = [tmp_path / f"{i}.json" for i in range(MAX_OPEN_FILES + 2)]
    for i, path in enumerate(paths):
        path.write_text(chairs([100 + i]))
    for _ in range(2):
        for i, path in enumerate(paths):
            reply = answerer.ask(path, make_question("the chair"))
            assert (reply["object_id"], reply["candidates"][0]["id"]) == (100 + i, 100 + i)
            assert reply["evidence"] == [f"chair {100 + i} is called chair"] and reply["path"][-1]["id"] == 100 + i


def test_a_file_that_cannot_be_asked(answerer, tmp_path) -> None:
    with pytest.raises(SchemaError, match=r"no graph\.json here"):
        answerer.check(tmp_path)
    (tmp_path / "x.json").write_text("{}")
    with pytest.raises(SchemaError, match="expected a scene graph, or an object list"):
        answerer.ask(tmp_path / "x.json", make_question("the chair"))


def test_own_ids_stand_in_sentences_too() -> None:
    reply = {
        "object_id": None,
        "path": [],
        "route": ["R1", "C2"],
        "evidence": ["chair O1 is 0.5 m from chair O11, not O9", "looked in hall: hall R1", "CO1 and O01 are no ids"],
        "candidates": [{"id": "O1", "evidence": ["O1"], "score": 1.0}],
    }
    own = with_own_ids(reply, {"O1": 7, "O11": "a\\1", "R1": "hall 2"})
    assert own["evidence"] == [
        "chair 7 is 0.5 m from chair a\\1, not O9", "looked in hall: hall hall 2", "CO1 and O01 are no ids"
    ]  # fmt: skip
    assert own["candidates"] == [{"id": 7, "evidence": ["7"], "score": 1.0}]
    assert (own["object_id"], own["route"]) == (None, ["hall 2", "C2"])
    assert with_own_ids(reply, {}) is reply
