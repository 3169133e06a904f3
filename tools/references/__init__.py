"""Make and check the references of tests/replay: what each node gave, step by step, for what it took."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from placegraph.runtime.config import Dataflow, RunConfig, build, read
from placegraph.runtime.errors import ConfigError
from placegraph.runtime.inline import Inline
from placegraph.runtime.messages import Message, Question
from placegraph.runtime.node import Context, Node, build_node
from placegraph.tools.references.recorded_steps import ReferenceRecording, differences, language_model_replies, summary
from placegraph.tools.run import with_settings

FOLDER = Path(__file__).parents[2] / "tests" / "replay"
RECORDING, SUMMARY = "house.rec", "house.txt"

# Three runs, which stay under 2 MB together: some images of configs/flat.toml in small steps, which odometry needs;
# a few larger ones along the whole walk, since networks need large things; and on those again the paper's three
# networks in place of the one pass. The drawn scene's network does the work of each.
DATAFLOW = Path("flat.toml")
WALK: dict[str, dict[str, Any]] = {
    "camera": {"limit": 10, "settings": {"width": 160, "height": 120}},
    "pose": {"stride": 4},
    "keyframe": {"translation_m": 0.05},
    "pose_graph": {  # so that it closes loops within a few steps of small images
        "min_loop_error_m": 0.0,
        "min_loop_error_rad": 0.0,
        "loops": {"skip_newest": 1, "min_candidate_gap": 1, "features": {"min_inliers": 10}},
    },
}
HOUSE: dict[str, dict[str, Any]] = {
    "camera": {"settings": {"width": 176, "height": 132, "frames": 14}},
    "pose": {"method": "given"},
    "fusion": {"voxel_m": 0.1, "min_observations": 2},
}
IN_WALK, IN_HOUSE = ("pose", "keyframe", "pose_graph"), ("instances", "fusion", "hierarchy", "naming", "grounding")
THREE: dict[str, dict[str, Any]] = {name: {"model": "drawn_scene"} for name in ("tagger", "detector", "segmenter")}
QUESTIONS = (
    "which chair is closest to the refrigerator", "the book on the table", "the lamp in the corner", "find the piano",
    "",
    # these need the language model: for a purpose, for what is looked for, and among equals
    "something to drink from", "the table with a book and a lamp", "the chair that my grandmother likes",
)  # fmt: skip
LEFT_OUT = {"recorder": "it gives nothing; tests/nodes/test_recorder.py reads back what it wrote"}


class _Tap(Node):
    """A node that also remembers each step."""

    def __init__(self, inner: Node) -> None:
        super().__init__(inner.config, inner.context)
        self.inputs, self.outputs, self._inner = inner.inputs, inner.outputs, inner
        self.start, self.stop = inner.start, inner.stop  # type: ignore[method-assign]
        self.seen: list[tuple[Message, list[Message]]] = []

    def step(self, message: Message) -> Sequence[Message]:
        """Step the node."""
        self.seen.append((message, list(self._inner.step(message))))
        return self.seen[-1][1]


def _run(dataflow: Dataflow, kept: Iterable[str], drive: Callable[[Inline], None]) -> dict[str, _Tap]:
    """Drive a dataflow to its end; returns the nodes `kept` with their steps."""
    taps = {name: _Tap(dataflow.nodes[name]) for name in kept}
    with Inline(dataclasses.replace(dataflow, nodes=dataflow.nodes | taps)) as shell:
        drive(shell)
    return taps


def _part_of_flat(settings: dict[str, dict[str, Any]], *left_out: str) -> Dataflow:
    config = with_settings(read(DATAFLOW), settings)
    nodes = {name: node for name, node in config.nodes.items() if name not in (*LEFT_OUT, *left_out)}
    return build(config.model_copy(update={"nodes": nodes}))


def _feed(shell: Inline, messages: Iterable[Message]) -> None:
    for message in messages:
        shell.feed(message)


def _run_and_ask(shell: Inline) -> None:
    shell.run()
    rest: dict[str, Any] = {
        "frame_id": -1,
        "stamp_ns": 0,
        "k": 3,
        "mode": "program",
        "viewpoint_world": np.full(3, np.nan),
    }
    _feed(shell, [Question(question_id=f"q{i}", text=text, **rest) for i, text in enumerate(QUESTIONS)])


def make() -> ReferenceRecording:
    """Run the drawn scene through every node, with the language model; the same code gives the same reference."""
    replies: dict[str, Any] = {}
    walk, house = _part_of_flat(WALK, "fusion", "hierarchy", "naming", "grounding"), _part_of_flat(HOUSE)
    built = {name: build_node(name, settings, Context()) for name, settings in THREE.items()}
    three = Dataflow(RunConfig(nodes=THREE), Context(), built)
    with language_model_replies(replies, ask=True):
        taps = _run(walk, IN_WALK, Inline.run) | _run(house, IN_HOUSE, _run_and_ask)
        keyframes = [keyframe for keyframe, _ in taps["instances"].seen]
        taps |= _run(three, THREE, lambda shell: _feed(shell, keyframes))
    messages: dict[int, Message] = {}  # by identity: most are taken or given more than once
    for tap in taps.values():
        messages |= {id(one): one for taken, given in tap.seen for one in (taken, *given)}
    number_of = {identity: number for number, identity in enumerate(messages)}
    steps = {
        name: [(number_of[id(taken)], [number_of[id(one)] for one in given]) for taken, given in tap.seen]
        for name, tap in taps.items()
    }
    settings = {name: tap.config.model_dump(mode="json", exclude_unset=True) for name, tap in taps.items()}
    return ReferenceRecording(settings, list(messages.values()), steps, replies)


def references(
    update: Annotated[
        bool, typer.Option("--update", help="Remake the recording and its summary from this code.")
    ] = False,
    folder: Annotated[Path, typer.Option(help="Where they lie; by default in this source checkout.")] = FOLDER,
) -> None:
    """Compare every node with its recorded reference, or remake the references.

    Exit status: 0 as recorded, 1 something differs.
    """
    if not folder.is_dir():
        raise ConfigError(f"{folder}: no such folder; references belong to a source checkout (--folder)")
    if update:
        reference = make()
        reference.write(folder / RECORDING)
        (folder / SUMMARY).write_text(summary(reference), encoding="utf-8")
        print(f"{len(reference.messages)} messages, {(folder / RECORDING).stat().st_size / 1e6:.2f} MB in {folder}")
        return
    reference = ReferenceRecording.read(folder / RECORDING)
    found = {name: differences(reference, name) for name in reference.steps}
    for name, lines in found.items():
        print(f"{name:<10} {len(reference.steps[name]):>4} steps  {'differs' if lines else 'as recorded'}")
        print("".join(f"  {line}\n" for line in lines), end="")
    if any(found.values()):
        raise typer.Exit(1)
