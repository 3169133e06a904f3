"""Makes the reference recording: three small runs in which every node takes part, kept step by step.

1. `WALK`: a few images of the drawn flat in small steps, as odometry needs them, for pose and keyframe.
2. `NETWORKS`: a few larger images along the same walk, since networks need large things; first the network that gives
   boxes and masks in one pass, then the paper's three on the same keyframes. The drawn flat's network serves as each.
3. The walk of two_floor_walk.py for all other nodes: two floors, keyframes that a loop moves, an object that is taken
   away; then questions about its last graph.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from placegraph.runtime.config import Dataflow, RunConfig, build, read
from placegraph.runtime.inline import Inline
from placegraph.runtime.messages import Message, Question
from placegraph.runtime.node import Context, Node, build_node
from placegraph.tools.graph import node_types
from placegraph.tools.references import two_floor_walk
from placegraph.tools.references.recorded_steps import ReferenceRecording, language_model_replies
from placegraph.tools.run import with_settings

DATAFLOW = Path("flat.toml")
WALK: dict[str, dict[str, Any]] = {
    "camera": {"limit": 10, "settings": {"width": 160, "height": 120}},
    "pose": {"stride": 4},
    "keyframe": {"translation_m": 0.05},
}
NETWORKS: dict[str, dict[str, Any]] = {
    "camera": {"settings": {"width": 176, "height": 132, "frames": 5}},
    "pose": {"method": "given"},
}
THREE_NETWORKS: dict[str, dict[str, Any]] = {
    name: {"model": "drawn_scene"} for name in ("tagger", "detector", "segmenter")
}
TWO_FLOORS: dict[str, dict[str, Any]] = {}  # settings that are not the defaults
IN_WALK, IN_NETWORKS = ("pose", "keyframe"), ("instances",)
QUESTIONS = (
    "which chair is closest to the refrigerator", "the book on the table", "the lamp upstairs", "find the piano", "",
    # these need the language model: for a purpose, for a nested condition, and among equals
    "something to sleep in", "the table with a book and a lamp", "the chair that my grandmother likes",
)  # fmt: skip
LEFT_OUT = {"recorder": "it gives nothing; tests/nodes/test_recorder.py reads back what it wrote"}


class _RecordingNode(Node):
    """Wraps a node and keeps the input and the outputs of each step."""

    def __init__(self, inner: Node) -> None:
        super().__init__(inner.config, inner.context)
        self.inputs, self.outputs, self._inner = inner.inputs, inner.outputs, inner
        self.start, self.stop = inner.start, inner.stop  # type: ignore[method-assign]
        self.steps: list[tuple[Message, list[Message]]] = []

    def step(self, message: Message) -> Sequence[Message]:
        """Step the node."""
        self.steps.append((message, list(self._inner.step(message))))
        return self.steps[-1][1]


def make_recording() -> ReferenceRecording:
    """Run everything, with the language model; the same code gives the same recording."""
    replies: dict[str, Any] = {}
    with language_model_replies(replies, ask=True):
        recorded = _record(_part_of_flat(WALK, (*IN_WALK, "camera")), IN_WALK, Inline.run)
        networks = _record(_part_of_flat(NETWORKS, (*IN_WALK, *IN_NETWORKS, "camera")), IN_NETWORKS, Inline.run)
        keyframes = [keyframe for keyframe, _ in networks["instances"].steps]
        three = _built(THREE_NETWORKS, keyframes)
        settings = with_settings(read(DATAFLOW), TWO_FLOORS).nodes
        others = {
            name: values
            for name, values in settings.items()
            if name not in (*IN_WALK, *IN_NETWORKS, *LEFT_OUT, "camera")
        }
        walk = list(two_floor_walk.messages())
        recorded |= _record(_built(others, walk), others, lambda shell: _feed(shell, [*walk, *_questions()]))
        recorded |= networks | _record(three, THREE_NETWORKS, lambda shell: _feed(shell, keyframes))
    return _as_recording(recorded, replies)


def _part_of_flat(settings: dict[str, dict[str, Any]], names: Iterable[str]) -> Dataflow:
    config = with_settings(read(DATAFLOW), settings)
    return build(config.model_copy(update={"nodes": {name: config.nodes[name] for name in names}}))


def _built(settings: dict[str, dict[str, Any]], fed: Sequence[Message]) -> Dataflow:
    """A dataflow without a source, for nodes that are fed with these messages."""
    kinds = {type(message) for message in fed}.union(*(node_types()[name].outputs for name in settings))
    context = Context(produced_kinds=tuple(sorted(kind.__name__ for kind in kinds)))
    nodes = {name: build_node(name, values, context) for name, values in settings.items()}
    return Dataflow(RunConfig(nodes=settings), context, nodes)


def _record(dataflow: Dataflow, names: Iterable[str], drive: Callable[[Inline], None]) -> dict[str, _RecordingNode]:
    """Drive a dataflow to its end; returns the named nodes with their steps."""
    recorded = {name: _RecordingNode(dataflow.nodes[name]) for name in names}
    with Inline(dataclasses.replace(dataflow, nodes=dataflow.nodes | recorded)) as shell:
        drive(shell)
    return recorded


def _feed(shell: Inline, messages: Iterable[Message]) -> None:
    for message in messages:
        shell.feed(message)


def _questions() -> list[Question]:
    nowhere = np.full(3, np.nan)
    return [
        Question(
            question_id=f"q{i}", text=text, frame_id=-1, stamp_ns=0, k=3, mode="program", viewpoint_world=nowhere
        )
        for i, text in enumerate(QUESTIONS)
    ]  # fmt: skip


def _as_recording(recorded: dict[str, _RecordingNode], replies: dict[str, Any]) -> ReferenceRecording:
    messages: dict[int, Message] = {}  # by identity: most are an output of one node and an input of others
    for node in recorded.values():
        messages |= {id(message): message for taken, given in node.steps for message in (taken, *given)}
    index_of = {identity: index for index, identity in enumerate(messages)}
    steps = {
        name: [(index_of[id(taken)], [index_of[id(message)] for message in given]) for taken, given in node.steps]
        for name, node in recorded.items()
    }
    settings = {name: node.config.model_dump(mode="json", exclude_unset=True) for name, node in recorded.items()}
    return ReferenceRecording(settings, list(messages.values()), steps, replies)
