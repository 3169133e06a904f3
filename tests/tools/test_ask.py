import json
import math
import shutil

import pytest

from placegraph.runtime.query.reply import Reply
from placegraph.runtime.scene_graph import SceneGraph
from placegraph.tools.query.offline_query import OfflineQuery

POSE = "pose: expected x,y,z or x,y,z,yaw in metres and degrees, world frame"
KEYS = {
    "status", "question_id", "question", "object_id", "name", "box", "center", "path", "evidence", "candidates", "sure",
    "parse", "viewpoint", "revision", "llm_calls", "ms", "approach", "route", "travel_m", "error",
}  # fmt: skip


def test_found_as_json(cli, mapped) -> None:
    done = cli("ask", mapped, "the refrigerator", "--json")
    assert (done.code, done.err) == (0, "") and done.out.count("\n") == 1
    reply = json.loads(done.out)
    assert set(reply) == KEYS == set(Reply.model_validate(reply).model_dump()) and reply["status"] == "found"
    graph = SceneGraph.load(mapped / "graph.json")
    node = graph.nodes[reply["object_id"]]
    assert node.tags[0].name == reply["name"] == "refrigerator"
    assert reply["box"] == node.box.tolist() and reply["question"] == "the refrigerator"
    assert [step["id"] for step in reply["path"]] == [step.id for step in graph.path(node.id)]
    assert reply["llm_calls"] == 0 and reply["ms"] >= 0  # the run's own settings: no language model


def test_found_in_words(cli, mapped) -> None:
    reply = json.loads(cli("ask", mapped, "a chair", "--json").out)
    done = cli("ask", mapped, "a chair")
    lines = done.out.splitlines()
    assert lines[0].startswith(f"{reply['object_id']}  chair") and lines[1].startswith("where: building (B0) > ")
    assert lines[2] == f"box:   {reply['box'][0]} to {reply['box'][1]} m"
    assert "read:  chair" in lines
    assert lines[-1].startswith(f"candidates: {reply['object_id']} chair ")
    from_here = cli("ask", mapped, "a chair", "--pose", "1,1,1.4").out.splitlines()
    assert sum(line.startswith("way:   R") and line.endswith(" m") for line in from_here) == 1
    assert not any(line.startswith("way:") for line in lines)


def test_k_limits_the_candidates(cli, mapped) -> None:
    assert len(json.loads(cli("ask", mapped, "a chair", "--json", "--k", 2).out)["candidates"]) == 2
    assert len(json.loads(cli("ask", mapped, "a chair", "--json").out)["candidates"]) > 2


def test_not_in_the_map_is_3(cli, mapped) -> None:
    done = cli("ask", mapped, "the piano", "--json")
    reply = json.loads(done.out)
    assert (done.code, reply["status"], reply["object_id"], reply["box"]) == (3, "not_in_map", None, None)
    words = cli("ask", mapped, "the piano")
    assert words.code == 3 and words.out.startswith("not in the map\n") and words.err == ""


def test_a_viewpoint_decides_what_is_left(cli, mapped) -> None:
    replies = [
        json.loads(cli("ask", mapped, "the chair to the left of the table", "--pose", at, "--json").out)
        for at in ("0.2,1.6,1.5", "6,1.6,1.5")
    ]
    assert replies[0]["object_id"] != replies[1]["object_id"]
    assert "0.2" in json.dumps(replies[0]["viewpoint"])


def test_a_graph_file_alone_is_enough(cli, mapped, tmp_path) -> None:
    shutil.copy(mapped / "graph.json", tmp_path / "house.json")
    done = cli("ask", tmp_path / "house.json", "the refrigerator", "--json")
    assert done.code == 0
    assert (
        json.loads(done.out)["object_id"]
        == json.loads(cli("ask", mapped, "the refrigerator", "--json").out)["object_id"]
    )


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (("",), "text: expected words, not empty, at most 500 characters, got ''"),
        ((" \n\t",), "text: expected words, not empty, at most 500 characters, got ' \\n\\t'"),
        (("chair" * 101,), "text: expected words, not empty, at most 500 characters, got 505"),
        (("chair", "--pose", "1,2"), f"{POSE}, got '1,2'"),
        (("chair", "--pose", "1,2,3,4,5"), f"{POSE}, got '1,2,3,4,5'"),
        (("chair", "--pose", "a,b,c"), f"{POSE}, got 'a,b,c'"),
        (
            ("chair", "--pose", "1,2,nan"),
            "pose: expected [x, y, z] or [x, y, z, yaw]: metres and radians, world frame, finite, got nan",
        ),
        (("chair", "--k", "0"), "k: expected a whole number from 1 to 50, got 0"),
        (("chair", "--k", "51"), "k: expected a whole number from 1 to 50, got 51"),
        (("chair", "--mode", "model"), "mode: expected one of program, rules, deductive, got 'model'"),
    ],
)
@pytest.mark.parametrize("where", ["map", "live"])
def test_a_question_that_no_map_can_answer(cli, mapped, where, arguments, reason) -> None:
    done = cli("ask", mapped if where == "map" else "live", *arguments)
    assert (done.code, done.out, done.reason) == (1, "", reason)


def test_a_pose_has_a_heading_in_degrees(cli, mapped, monkeypatch) -> None:
    asked = []
    ask = OfflineQuery.ask
    monkeypatch.setattr(
        OfflineQuery, "ask", lambda self, path, question: asked.append(question) or ask(self, path, question)
    )
    assert cli("ask", mapped, "a chair", "--pose", "1,2,1.5,-90").code == 0
    assert asked[0].viewpoint_world.tolist() == [1, 2, 1.5] and asked[0].heading_rad == -math.pi / 2


def test_an_object_list_is_asked_like_a_map(cli, tmp_path) -> None:
    chair = {"id": "my chair", "tags": ["chair"], "center": [0, 0, 0], "size": [1, 1, 1]}
    (tmp_path / "list.json").write_text(json.dumps({"objects": [chair]}))
    done = cli("ask", tmp_path / "list.json", "the chair")
    assert done.code == 0 and done.out.startswith("my chair  chair\n")


def test_a_folder_without_a_map(cli, tmp_path) -> None:
    for path in (tmp_path, tmp_path / "absent"):
        done = cli("ask", path, "chair")
        assert done.code == 1 and done.reason.startswith(f"{path}: no graph.json here; expected a map folder")


def test_a_map_of_another_version(cli, mapped, tmp_path) -> None:
    (tmp_path / "graph.json").write_text('{"version": 99, "nodes": []}')
    done = cli("ask", tmp_path, "chair")
    assert (done.code, done.reason) == (1, f"{tmp_path / 'graph.json'}: version: expected graph version 2, found 99")
    shutil.copy(mapped / "graph.json", tmp_path / "graph.json")
    (tmp_path / "run.json").write_text('{"config": {"nodes": {"grounding": {}}, "walls": 1}}')
    done = cli("ask", tmp_path, "chair")
    assert done.code == 1 and done.reason.startswith(f"{tmp_path / 'run.json'}: config.walls: ")
