import json
import math
import shutil

import pytest

from placegraph.runtime.scene_graph import SceneGraph

KEYS = {
    "status", "question_id", "question", "object_id", "name", "box", "center", "path", "evidence", "candidates", "sure",
    "parse", "viewpoint", "revision", "llm_calls", "ms", "approach", "route", "travel_m",
}  # fmt: skip


def test_found_as_json(cli, mapped) -> None:
    done = cli("ask", mapped, "the refrigerator", "--json")
    assert (done.code, done.err) == (0, "") and done.out.count("\n") == 1
    reply = json.loads(done.out)
    assert set(reply) >= KEYS and reply["status"] == "found"
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
    assert lines[-1].startswith(f"candidates: {reply['object_id']} chair ")
    from_here = cli("ask", mapped, "a chair", "--viewpoint", "1,1,1.4").out.splitlines()
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
        json.loads(cli("ask", mapped, "the chair to the left of the table", "--viewpoint", at, "--json").out)
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
        (("",), "text: expected words that are not empty"),
        ((" \n\t",), "text: expected words that are not empty"),
        (("chair" * 101,), "text: at most 500 characters, got 505"),
        (("chair", "--viewpoint", "1,2"), "viewpoint: expected x,y,z in metres, world frame, got '1,2'"),
        (("chair", "--viewpoint", "1,2,3,4"), "viewpoint: expected x,y,z in metres, world frame, got '1,2,3,4'"),
        (("chair", "--viewpoint", "a,b,c"), "viewpoint: expected x,y,z in metres, world frame, got 'a,b,c'"),
        (("chair", "--viewpoint", f"1,2,{math.nan}"), "viewpoint: expected [x, y, z] in metres, world frame"),
        (("chair", "--k", "0"), "k: expected a whole number from 1 to 50"),
        (("chair", "--k", "51"), "k: expected a whole number from 1 to 50"),
    ],
)
@pytest.mark.parametrize("where", ["map", "live"])
def test_a_question_that_no_map_can_answer(cli, mapped, where, arguments, reason) -> None:
    done = cli("ask", mapped if where == "map" else "live", *arguments)
    assert (done.code, done.out, done.reason) == (1, "", reason)


def test_a_folder_without_a_map(cli, tmp_path) -> None:
    for path in (tmp_path, tmp_path / "absent"):
        done = cli("ask", path, "chair")
        assert done.code == 1 and done.reason.startswith(f"{path}: no graph.json here; expected a map folder")


def test_a_map_of_another_version(cli, mapped, tmp_path) -> None:
    (tmp_path / "graph.json").write_text('{"version": 99, "nodes": []}')
    done = cli("ask", tmp_path, "chair")
    assert (done.code, done.reason) == (1, f"{tmp_path / 'graph.json'}: expected graph version 2, found 99")
    shutil.copy(mapped / "graph.json", tmp_path / "graph.json")
    (tmp_path / "run.json").write_text('{"config": {"nodes": {"grounding": {}}, "walls": 1}}')
    done = cli("ask", tmp_path, "chair")
    assert done.code == 1 and done.reason.startswith(f"{tmp_path / 'run.json'}: config.walls: ")
