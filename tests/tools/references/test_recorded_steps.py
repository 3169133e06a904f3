import dataclasses
import json
import lzma
from pathlib import Path
from typing import Any

import msgpack
import numpy as np
import pytest

from placegraph.runtime.errors import SchemaError
from placegraph.runtime.language.language_model import Completion, LanguageModel
from placegraph.runtime.messages import Answer, Frame, Keyframe, NamedGraph, Pose
from placegraph.tools.references.recorded_steps import (
    ReferenceRecording,
    _json_differences,
    differences,
    language_model_replies,
    summary,
)


def frame(frame_id: int) -> Frame:
    return Frame(
        frame_id=frame_id,
        stamp_ns=frame_id,
        color=np.full((2, 3, 3), 7, np.uint8),
        depth=np.full((2, 3), 1500, np.uint16),
        depth_unit_m=0.001,
        intrinsics=np.array([5.0, 5, 1, 1]),
        given_world_from_camera=np.full((4, 4), np.nan),
        up_camera=np.full(3, np.nan),
    )


def pose(frame_id: int, x_m: float) -> Pose:
    matrix = np.eye(4)
    matrix[0, 3] = x_m
    return Pose(
        frame_id=frame_id,
        stamp_ns=frame_id,
        world_from_camera=matrix,
        trusted=True,
        quality=1.0,
        residual_m=float("nan"),
        innovation_m=0.0,
        reason="",
    )


def keyframe(frame_id: int, x_m: float) -> Keyframe:
    source, matrix = frame(frame_id), pose(frame_id, x_m).world_from_camera
    names = ("frame_id", "stamp_ns", "color", "depth", "depth_unit_m", "intrinsics")
    return Keyframe(**{name: getattr(source, name) for name in names}, world_from_camera=matrix)


@pytest.fixture
def reference() -> ReferenceRecording:
    messages = [frame(0), pose(0, 0), keyframe(0, 0), frame(1), pose(1, 0.05), frame(2), pose(2, 0.5), keyframe(2, 0.5)]
    steps = [(0, []), (1, [2]), (3, []), (4, []), (5, []), (6, [7])]
    return ReferenceRecording({"keyframe": {"rotation_rad": 0.5}}, messages, {"keyframe": steps}, {})


def tampered(reference: ReferenceRecording, number: int, **fields: Any) -> ReferenceRecording:
    messages = list(reference.messages)
    messages[number] = dataclasses.replace(messages[number], **fields)
    return dataclasses.replace(reference, messages=messages)


def test_what_was_written_is_read_back(reference: ReferenceRecording, tmp_path: Path) -> None:
    reference.write(tmp_path / "x.rec")
    again = ReferenceRecording.read(tmp_path / "x.rec")
    assert (again.settings, again.steps, again.replies) == (reference.settings, reference.steps, reference.replies)
    assert summary(again) == summary(reference)
    assert differences(again, "keyframe") == []
    again.write(tmp_path / "y.rec")
    assert (tmp_path / "y.rec").read_bytes() == (tmp_path / "x.rec").read_bytes()


def test_a_file_that_is_absent_or_something_else_is_named(reference: ReferenceRecording, tmp_path: Path) -> None:
    with pytest.raises(SchemaError, match=r"none\.rec: not a reference: .*--update"):
        ReferenceRecording.read(tmp_path / "none.rec")
    reference.write(tmp_path / "cut.rec")
    (tmp_path / "cut.rec").write_bytes((tmp_path / "cut.rec").read_bytes()[:-9])
    with pytest.raises(SchemaError, match=r"cut\.rec: not a reference"):
        ReferenceRecording.read(tmp_path / "cut.rec")
    (tmp_path / "other.rec").write_bytes(lzma.compress(msgpack.packb([{}, [["NoKind", b""]], {}, {}])))
    with pytest.raises(SchemaError, match=r"other\.rec: not a reference"):
        ReferenceRecording.read(tmp_path / "other.rec")


def test_a_changed_declaration_says_how_to_go_on(reference: ReferenceRecording, tmp_path: Path, monkeypatch) -> None:
    reference.write(tmp_path / "x.rec")
    monkeypatch.setattr(Keyframe, "checksum", classmethod(lambda cls: "00000000"))
    with pytest.raises(SchemaError, match=r"x\.rec: Keyframe: .*versions of placegraph; `placegraph references --upd"):
        ReferenceRecording.read(tmp_path / "x.rec")


def test_a_reference_without_steps_gives_an_empty_list(reference: ReferenceRecording) -> None:
    assert differences(dataclasses.replace(reference, steps={"keyframe": []}), "keyframe") == []


def test_a_small_difference_of_a_float_is_allowed_and_a_large_one_is_named(reference: ReferenceRecording) -> None:
    matrix = reference.messages[2].world_from_camera
    assert differences(tampered(reference, 2, world_from_camera=matrix + 5e-4), "keyframe") == []
    (line,) = differences(tampered(reference, 2, world_from_camera=matrix + 2e-3), "keyframe")
    assert line.startswith("keyframe: Pose of frame 0 gives Keyframe(0).world_from_camera[0, 0]: 16 of 16")
    assert line.endswith(" values differ, the first was 1.002, is 1.0")
    assert len(differences(tampered(reference, 2, world_from_camera=matrix * np.nan), "keyframe")) == 1
    (line,) = differences(tampered(reference, 2, depth_unit_m=0.003), "keyframe")
    assert line.endswith("gives Keyframe(0).depth_unit_m: was 0.003, is 0.001")


def test_integers_and_shapes_are_exact(reference: ReferenceRecording) -> None:
    color = reference.messages[2].color
    (line,) = differences(tampered(reference, 2, color=color + np.uint8(1)), "keyframe")
    assert "Keyframe(0).color[0, 0, 0]: 18 of 18 values differ, the first was 8, is 7" in line
    (line,) = differences(tampered(reference, 7, stamp_ns=3), "keyframe")
    assert line == "keyframe: Pose of frame 2 gives Keyframe(2).stamp_ns: was 3, is 2"
    (line,) = differences(tampered(reference, 2, color=color[:1], depth=np.zeros((1, 3), np.uint16)), "keyframe")[:1]
    assert "Keyframe(0).color: shape was (1, 3, 3), is (2, 3, 3)" in line


def test_what_is_given_at_another_step_differs(reference: ReferenceRecording) -> None:
    steps = [(0, [2]), (1, []), (3, []), (4, []), (5, []), (6, [7])]
    found = differences(dataclasses.replace(reference, steps={"keyframe": steps}), "keyframe")
    assert found == [
        "keyframe: Frame of frame 0 gave ['Keyframe'], gives []",
        "keyframe: Pose of frame 0 gave [], gives ['Keyframe']",
    ]


def test_a_changed_setting_and_an_error_of_ours_are_differences(reference: ReferenceRecording) -> None:
    assert differences(reference, "keyframe", translation_m=0.04) == [
        "keyframe: Pose of frame 1 gave [], gives ['Keyframe']"
    ]
    graph = NamedGraph(frame_id=0, stamp_ns=0, revision=0, final=True, place_types=(), json="[]")
    broken = ReferenceRecording({"grounding": {}}, [graph], {"grounding": [(0, [])]}, {})
    (line,) = differences(broken, "grounding")
    assert line.startswith("grounding: SchemaError: NamedGraph of revision 0: Input should be an object")


def test_only_the_first_differences_are_listed(reference: ReferenceRecording) -> None:
    steps = [(0, [2])] * 20
    assert len(differences(dataclasses.replace(reference, steps={"keyframe": steps}), "keyframe")) == 5


def test_json_is_compared_node_by_node() -> None:
    def node(x_m: float, weight: float, **other: Any) -> dict[str, Any]:
        return {"nodes": [{"id": "O5", "box": [x_m, 0.0], "tags": [["cup", weight]]} | other]}

    def found(old: Any, new: Any) -> list[str]:
        return list(_json_differences(old, new, 2e-3))

    assert found(node(1.0, 0.5), node(1.0019, 0.5009)) == []
    assert found(node(1.0, 0.5), node(1.0021, 0.5)) == [".nodes[O5].box[0]: was 1.0, is 1.0021"]
    assert found(node(1.0, 0.5), node(1.0, 0.5011)) == [".nodes[O5].tags[0][1]: was 0.5, is 0.5011"]
    assert found(node(1.0, 0.5, n=1), node(1.0, 0.5, n=2)) == [".nodes[O5].n: was 1, is 2"]
    assert len(found(node(1.0, 0.5), node(float("nan"), 0.5))) == 1
    assert found([1.0], [1]) == ["[0]: was 1.0, is 1"]
    assert found([], [1]) == [": was [], is [1]"]
    assert found({"a": "x" * 200}, {}) and len(found({"a": "x" * 200}, {})[0]) < 130


def test_replies_are_kept_and_given_without_a_model(monkeypatch) -> None:
    asked = []

    def complete(
        self: LanguageModel, text: str, grammar: str, max_tokens: int, use_adapter: bool = False
    ) -> Completion:
        asked.append(text)
        return Completion(text.upper(), -1.5 if use_adapter else 0.0)

    monkeypatch.setattr(LanguageModel, "complete", complete)
    monkeypatch.setattr(LanguageModel, "log_probabilities", lambda self, a, b, options: np.arange(len(options)) - 0.5)
    replies: dict[str, Any] = {}
    with language_model_replies(replies, ask=True):
        assert LanguageModel().complete("a", "g", 3) == Completion("A", 0.0)
        assert LanguageModel().complete("a", "g", 3, use_adapter=True) == Completion("A", -1.5)
        LanguageModel().log_probabilities("o", "t", [" x", " y"])
    assert json.loads(json.dumps(replies)) == replies  # nothing but what a file can hold
    with language_model_replies(replies, ask=False):
        model = LanguageModel(Path("no such file"))
        model.load()
        assert model.complete("a", "g", 3) == Completion("A", 0.0)
        assert model.complete("a", "g", 3, use_adapter=True) == Completion("A", -1.5)
        np.testing.assert_array_equal(model.log_probabilities("o", "t", [" x", " y"]), [-0.5, 0.5])
        assert (model.calls, asked) == (3, ["a", "a"])
        with pytest.raises(SchemaError, match=r'no reply of the language model to .*"b.*--update'):
            model.complete("b", "g", 3)
    assert LanguageModel.complete is complete


def test_the_model_is_whole_again_after_an_error() -> None:
    before = LanguageModel.load, LanguageModel.complete, LanguageModel.log_probabilities
    with pytest.raises(ZeroDivisionError), language_model_replies({}, ask=False):
        assert LanguageModel.load is not before[0]
        raise ZeroDivisionError
    assert (LanguageModel.load, LanguageModel.complete, LanguageModel.log_probabilities) == before


def test_the_summary_shows_steps_answers_and_the_graph(reference: ReferenceRecording) -> None:
    graph = NamedGraph(
        frame_id=2, stamp_ns=0, revision=0, final=True, place_types=(), json='{"nodes":[{"box":[1.0,2.5]}]}'
    )
    answer = Answer(frame_id=-1, stamp_ns=0, question_id="q7", json='{"status":"found"}')
    text = summary(dataclasses.replace(reference, messages=[*reference.messages, graph, answer]))
    lines = text.splitlines()
    assert lines[:2] == ['== keyframe {"rotation_rad": 0.5}', "Frame 0 -> nothing"]
    assert lines[2].startswith("Pose 0 -> Keyframe | frame_id 0 | depth_unit_m 0.001 | color [2, 3, 3] mean 7.000 | ")
    assert "== answer q7" in lines and ' "status": "found"' in lines
    assert '   "box": [ 1.0, 2.5 ]' in lines[lines.index("== the last graph") :]
    without = summary(reference)
    assert "graph" not in without
