"""Every node gives today what it gave when house.rec was made. `placegraph references --update` remakes it."""

from pathlib import Path
from typing import Any

import pytest

from placegraph.runtime.messages import Correction, Graph, Map
from placegraph.runtime.node import NODES, available
from placegraph.runtime.scene_graph import SceneGraph
from placegraph.tools.graph import node_types
from placegraph.tools.references import RECORDING, SUMMARY
from placegraph.tools.references.recorded_steps import ReferenceRecording, differences, summary
from placegraph.tools.references.reference_runs import LEFT_OUT

HERE = Path(__file__).parent
CONSUMERS = sorted(name for name, kind in node_types().items() if kind.inputs)
# One setting of each node that must show in what it gives: proof that the comparison can fail.
CHANGED: dict[str, dict[str, Any]] = {
    "pose": {"rgbd": {"track": {"window_px": 15}}},
    "keyframe": {"translation_m": 0.16, "rotation_rad": 0.16},
    "instances": {"max_objects": 1},
    "tagger": {"max_tags": 1},
    "detector": {"max_objects": 1},
    "segmenter": {"max_objects": 1},
    "pose_graph": {"loop_sigma_m": 0.1, "loop_sigma_rad": 0.1},
    "fusion": {"edge_ratio": 0.06},
    "hierarchy": {"floors": {"bin_m": 0.02}},
    "naming": {"method": "none"},
    "grounding": {"use_model": False},
}


@pytest.fixture(scope="module")
def reference() -> ReferenceRecording:
    return ReferenceRecording.read(HERE / RECORDING)


def test_every_node_that_takes_something_has_a_reference_or_a_reason(reference: ReferenceRecording) -> None:
    assert set(reference.steps) | set(LEFT_OUT) == set(CONSUMERS)
    assert not set(reference.steps) & set(LEFT_OUT)
    assert set(CONSUMERS) <= set(available(NODES))
    assert all(LEFT_OUT.values())


@pytest.mark.parametrize("name", [name for name in CONSUMERS if name not in LEFT_OUT])
def test_a_fresh_node_gives_what_it_gave(reference: ReferenceRecording, name: str) -> None:
    assert any(given for _, given in reference.steps[name])
    found = differences(reference, name)
    assert found == [], "\n".join(["", *found, "meant? placegraph references --update, and say why in the commit"])


@pytest.mark.parametrize("name", [name for name in CONSUMERS if name not in LEFT_OUT])
def test_a_changed_setting_is_noticed(reference: ReferenceRecording, name: str) -> None:
    assert differences(reference, name, **CHANGED[name]) != []


def test_each_kind_that_a_node_gives_is_in_its_reference(reference: ReferenceRecording) -> None:
    for name, steps in reference.steps.items():
        given = {type(reference.messages[i]) for _, numbers in steps for i in numbers}
        assert given == set(node_types()[name].outputs), name


def test_the_language_model_is_asked_in_both_ways(reference: ReferenceRecording) -> None:
    assert {key.split('"')[1] for key in reference.replies} == {"complete", "log_probabilities"}


def test_it_holds_two_floors_with_stairs_keyframes_that_a_loop_moved_and_a_retired_object(
    reference: ReferenceRecording,
) -> None:
    graphs = [message for message in reference.messages if isinstance(message, Graph)]
    graph = SceneGraph.from_json(graphs[-1].json)
    assert len(graph.layer("floor")) == 2 and [c.kind for c in graph.connections.values()] == ["stairs"]
    moved = [
        message for message in reference.messages if isinstance(message, Correction) and len(message.moved_frame_ids)
    ]
    taken = {id(reference.messages[i]) for i, _ in reference.steps["fusion"]}
    assert moved and all(id(correction) in taken for correction in moved)
    retired = [m for m in reference.messages if isinstance(m, Map) and len(m.retired_ids)]
    assert retired and "vase" in retired[-1].retired_tag_names and "vase" not in retired[-1].tag_names


def test_the_summary_is_that_of_the_recording(reference: ReferenceRecording) -> None:
    assert (HERE / SUMMARY).read_text(encoding="utf-8") == summary(reference)


def test_the_folder_stays_small() -> None:
    assert sum(path.stat().st_size for path in HERE.iterdir() if path.is_file()) < 2_000_000
