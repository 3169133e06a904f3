"""Make and check the references of tests/replay: what each node gave, step by step, for what it took."""

from __future__ import annotations

import dataclasses
import json
import lzma
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import msgpack
import numpy as np
import typer

from placegraph.nodes.grounding.llm import LanguageModel
from placegraph.runtime import messages as m
from placegraph.runtime.codec import decode, encode
from placegraph.runtime.config import Dataflow, RunConfig, build, read
from placegraph.runtime.errors import ConfigError, SchemaError
from placegraph.runtime.inline import Inline
from placegraph.runtime.messages import Keyframe, Message, Question
from placegraph.runtime.node import Context, Node, Source, build_node
from placegraph.tools.run import with_settings

FOLDER = Path(__file__).parents[1] / "tests" / "replay"
RECORDING, SUMMARY = "house.rec", "house.txt"
REMAKE = "`placegraph references --update` remakes it"

# What differs from configs/demo.toml, so that the whole walk through both rooms stays under 2 MB: small images, as few
# frames as odometry can follow, a coarser gate and a coarser cloud.
DATAFLOW = Path("demo.toml")
SETTINGS: dict[str, dict[str, Any]] = {
    "camera": {"settings": {"width": 80, "height": 60, "frames": 105}},
    "pose": {"method": "kiss_icp", "stride": 1},
    "keyframe": {"translation_m": 0.4, "rotation_rad": 0.4, "period_s": 5.0},
    "fusion": {"voxel_m": 0.1, "stride": 2, "min_observations": 2},
}
# The paper's three networks stand beside the one-pass node; the network of the drawn scene does the work of each.
THREE_NETWORKS: dict[str, dict[str, Any]] = {
    name: {"model": "drawn_scene"} for name in ("tagger", "detector", "segmenter")
}
QUESTIONS = (
    "which chair is closest to the sofa", "the cup on the table", "the lamp in the corner",
    "what is the largest table", "find the piano", "",
)  # fmt: skip
LEFT_OUT = {"recorder": "it gives nothing; tests/nodes/test_recorder.py reads back what it wrote"}

# Integers, names and order are exact: taken messages are the recorded ones bit by bit, so only the last bits of a sum
# can differ between machines. KISS-ICP stops when a step is under 1e-4, and one step more or less moves a pose so far.
TOLERANCE = 1e-3  # m, px, rad, shares
JSON_LENGTH_TOLERANCE_M = 2e-3  # the canonical JSON rounds to 1 mm, which can add one step to TOLERANCE
MOST_REPORTED = 5  # of one node


@dataclass(frozen=True)
class Reference:
    """One run: `steps` of each node as (index of the message taken, indices of those given, in order)."""

    settings: dict[str, dict[str, Any]]
    messages: list[Message]
    steps: dict[str, list[tuple[int, list[int]]]]
    replies: dict[str, Any]  # of the language model: the call as JSON -> text, or log-probabilities

    def write(self, path: Path) -> None:
        """Write the recording: msgpack of everything, messages as [kind, payload], LZMA."""
        packed = [[type(message).__name__, encode(message)] for message in self.messages]
        data = msgpack.packb([self.settings, packed, self.steps, self.replies])
        path.write_bytes(lzma.compress(data, preset=9))

    @classmethod
    def read(cls, path: Path) -> Reference:
        """Read what `write` wrote; raises SchemaError, also when a message was declared otherwise then."""
        try:
            settings, packed, steps, replies = msgpack.unpackb(lzma.decompress(path.read_bytes()))
            found = [decode(getattr(m, kind), payload) for kind, payload in packed]
        except SchemaError as error:
            raise SchemaError(f"{path}: {error}; {REMAKE}") from None
        except (OSError, lzma.LZMAError, ValueError, TypeError, AttributeError, msgpack.UnpackException) as error:
            raise SchemaError(f"{path}: not a reference: {error or type(error).__name__}; {REMAKE}") from None
        return cls(settings, found, {n: [(i, list(given)) for i, given in rows] for n, rows in steps.items()}, replies)


class _Tap(Node):
    """A node that also remembers each step."""

    def __init__(self, inner: Node) -> None:
        super().__init__(inner.config, inner.context)
        self.takes, self.gives, self._inner = inner.takes, inner.gives, inner
        self.start, self.stop = inner.start, inner.stop  # type: ignore[method-assign]
        self.seen: list[tuple[Message, list[Message]]] = []

    def step(self, message: Message) -> Sequence[Message]:
        """Step the node."""
        self.seen.append((message, list(self._inner.step(message))))
        return self.seen[-1][1]


@dataclass
class _Run:
    """Messages in the order of delivery, and each node's steps."""

    messages: list[Message] = field(default_factory=list)
    steps: dict[str, list[tuple[int, list[int]]]] = field(default_factory=dict)
    _index: dict[int, int] = field(default_factory=dict)  # by identity: `messages` keeps them alive

    def feed(self, dataflow: Dataflow, drive: Callable[[Inline], None]) -> None:
        """Run a dataflow and keep all of it."""
        nodes = {n: node if isinstance(node, Source) else _Tap(node) for n, node in dataflow.nodes.items()}
        with Inline(dataclasses.replace(dataflow, nodes=nodes), self._observe) as shell:
            drive(shell)
        for name, node in nodes.items():
            if isinstance(node, _Tap):
                self.steps[name] = [(self._index[id(t)], [self._index[id(g)] for g in given]) for t, given in node.seen]

    def _observe(self, message: Message) -> None:
        if id(message) not in self._index:
            self._index[id(message)] = len(self.messages)
            self.messages.append(message)


def make() -> Reference:
    """Run the drawn scene through every node, with the language model; the same code gives the same reference."""
    demo = with_settings(read(DATAFLOW), SETTINGS)
    demo = demo.model_copy(update={"nodes": {n: s for n, s in demo.nodes.items() if n not in LEFT_OUT}})
    run, replies = _Run(), dict[str, Any]()

    def drive_demo(shell: Inline) -> None:
        shell.run()
        for number, text in enumerate(QUESTIONS):
            shell.feed(_question(number, text))

    def drive_three(shell: Inline) -> None:
        for keyframe in [message for message in run.messages if isinstance(message, Keyframe)]:
            shell.feed(keyframe)

    with _replies(replies, ask=True):
        run.feed(build(demo), drive_demo)
        nodes = {name: build_node(name, settings, Context()) for name, settings in THREE_NETWORKS.items()}
        run.feed(Dataflow(RunConfig(nodes=THREE_NETWORKS), Context(), nodes), drive_three)
    return Reference(
        {n: s for n, s in (demo.nodes | THREE_NETWORKS).items() if n in run.steps}, run.messages, run.steps, replies
    )


def _question(number: int, text: str) -> Question:
    nowhere = np.full(3, np.nan)
    return Question(
        frame_id=-1, stamp_ns=0, question_id=f"q{number}", text=text, k=3, mode="program", viewpoint_world=nowhere
    )


@contextmanager
def _replies(replies: dict[str, Any], ask: bool) -> Iterator[None]:
    """Cut at the language model: `ask` it and keep its replies, or give the kept ones without loading it."""
    kept = {name: getattr(LanguageModel, name) for name in ("load", "complete", "log_probabilities")}

    def cut(name: str) -> Callable[..., Any]:
        def reply(self: LanguageModel, *arguments: Any) -> Any:
            key = json.dumps([name, *arguments], ensure_ascii=False)
            if ask:
                found = kept[name](self, *arguments)
                replies[key] = found if isinstance(found, str) else found.tolist()
            elif key not in replies:
                raise SchemaError(f"the reference holds no reply of the language model to {key}; {REMAKE}")
            return replies[key] if isinstance(replies[key], str) else np.array(replies[key])

        return reply

    try:
        for name in ("complete", "log_probabilities"):
            setattr(LanguageModel, name, cut(name))
        if not ask:
            LanguageModel.load = lambda self: None  # type: ignore[method-assign]
        yield
    finally:
        for name, method in kept.items():
            setattr(LanguageModel, name, method)


def differences(reference: Reference, name: str, **changed: Any) -> list[str]:
    """Step a fresh node through its reference; where what it gives is not what it gave, at most MOST_REPORTED lines.

    `changed` settings replace the recorded ones. Raises SchemaError when it asks the language model anything new.
    """
    node = build_node(name, reference.settings[name] | changed, Context())
    found: list[str] = []
    with _replies(reference.replies, ask=False):
        try:
            node.start()
            for taken, given in reference.steps[name]:
                message = reference.messages[taken]
                where = f"{name}: {type(message).__name__} of frame {message.frame_id}"
                found += _step_differences(where, [reference.messages[i] for i in given], node.step(message))
                if len(found) >= MOST_REPORTED:
                    break
        finally:
            node.stop()
    return found[:MOST_REPORTED]


def _step_differences(where: str, expected: Sequence[Message], given: Sequence[Message]) -> list[str]:
    kinds = [[type(message).__name__ for message in side] for side in (expected, given)]
    if kinds[0] != kinds[1]:
        return [f"{where} gave {kinds[0]}, gives {kinds[1]}"]
    found = []
    for old, new in zip(expected, given, strict=True):
        new.check()
        for name in (*old.array_specs(), *old.scalar_types()):
            text = _field_difference(getattr(old, name), getattr(new, name), is_json=name == "json")
            found += [f"{where} gives {type(old).__name__}.{name}{text}"] if text else []
    return found


def _field_difference(old: Any, new: Any, is_json: bool) -> str:
    """Empty when equal within the tolerance, else the rest of a sentence."""
    if is_json:
        return next(_json_differences(json.loads(old), json.loads(new), JSON_LENGTH_TOLERANCE_M), "")
    if isinstance(old, float):
        old, new = np.array(old), np.array(new)
    if not isinstance(old, np.ndarray):
        return "" if old == new else f": was {old!r}, is {new!r}"
    if old.shape != new.shape:
        return f": shape was {old.shape}, is {new.shape}"
    if old.dtype.kind != "f":
        wrong = np.asarray(old != new)
    else:
        wrong = ~np.isclose(new, old, rtol=0, atol=TOLERANCE, equal_nan=True)
    if not wrong.any():
        return ""
    first = tuple(int(i) for i in np.argwhere(wrong)[0])
    return f"{list(first)}: was {old[first]}, is {new[first]}; {wrong.sum()} of {wrong.size} values differ"


def _json_differences(old: Any, new: Any, tolerance: float, where: str = "") -> Iterator[str]:
    if isinstance(old, float) and isinstance(new, float):
        if abs(old - new) > tolerance:
            yield f"{where}: was {old}, is {new}"
    elif isinstance(old, dict) and isinstance(new, dict) and old.keys() == new.keys():
        for key, value in old.items():
            yield from _json_differences(value, new[key], TOLERANCE if key == "tags" else tolerance, f"{where}.{key}")
    elif isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        for i, (one, other) in enumerate(zip(old, new, strict=True)):
            label = one["id"] if isinstance(one, dict) and "id" in one else i
            yield from _json_differences(one, other, tolerance, f"{where}[{label}]")
    elif type(old) is not type(new) or old != new:
        yield f"{where}: was {_short(old)}, is {_short(new)}"


def _short(value: Any) -> str:
    text = json.dumps(value, ensure_ascii=False)
    return text if len(text) <= 100 else f"{text[:97]}..."


def summary(reference: Reference) -> str:
    """What a person compares: each step on a line with rounded values, every answer and the last graph as JSON."""
    lines: list[str] = []
    for name, steps in reference.steps.items():
        lines += [f"== {name} {json.dumps(reference.settings[name], sort_keys=True)}"]
        for taken, given in steps:
            message = reference.messages[taken]
            results = [reference.messages[i] for i in given]
            head = f"{type(message).__name__} {message.frame_id} ->"
            lines += [f"{head} {_line(result)}" for result in results] or [f"{head} nothing"]
    for message in reference.messages:
        if isinstance(message, m.Answer):
            lines += [f"== answer {message.question_id}", _indented(message.json)]
    graphs = [message for message in reference.messages if isinstance(message, m.Graph)]
    return "\n".join([*lines, "== the last graph", _indented(graphs[-1].json), ""])


def _indented(text: str) -> str:
    return json.dumps(json.loads(text), indent=1, sort_keys=True, ensure_ascii=False)


def _line(message: Message) -> str:
    parts = [type(message).__name__]
    for name in (*message.scalar_types(), *message.array_specs()):
        value = getattr(message, name)
        if name in ("stamp_ns", "json"):
            continue
        if isinstance(value, np.ndarray):
            parts.append(f"{name} {_rounded(value)}")
        else:
            parts.append(f"{name} {round(value, 3) + 0.0 if isinstance(value, float) else value}")
    return " | ".join(parts)


def _rounded(value: m.NDArray[Any]) -> str:
    if value.size <= 16:
        return str((np.round(value, 3) + 0 if value.dtype.kind == "f" else value).tolist())
    return f"{list(value.shape)} mean {float(value.mean(dtype=np.float64)):.3f}"


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
    reference = Reference.read(folder / RECORDING)
    found = {name: differences(reference, name) for name in reference.steps}
    for name, lines in found.items():
        print(f"{name:<10} {len(reference.steps[name]):>4} steps  {'differs' if lines else 'as recorded'}")
        print("".join(f"  {line}\n" for line in lines), end="")
    if any(found.values()):
        raise typer.Exit(1)
