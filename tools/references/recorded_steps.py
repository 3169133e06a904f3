"""A reference recording: the inputs and outputs of nodes, step by step, and the language model's replies."""

from __future__ import annotations

import json
import lzma
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import msgpack
import numpy as np
from numpy.typing import NDArray

from placegraph.runtime import messages as m
from placegraph.runtime.errors import PlacegraphError, SchemaError
from placegraph.runtime.language.language_model import Completion, LanguageModel
from placegraph.runtime.messages import Message
from placegraph.runtime.messages.codec import decode, encode
from placegraph.runtime.node import Context, build_node

REMAKE = "`placegraph references --update` remakes it"

# Integers, names and order must be equal: the inputs are the recorded ones bit by bit, so only the last bits of a sum
# can differ between machines. KISS-ICP stops when a step is below 1e-4, and one step more or less moves a pose by that.
TOLERANCE = 1e-3  # m, px, rad, shares
JSON_LENGTH_TOLERANCE_M = 2e-3  # the canonical JSON rounds to 1 mm, which can add one step to TOLERANCE
MAX_REPORTED = 5  # of one node


@dataclass(frozen=True, repr=False)
class ReferenceRecording:
    """One run: the steps of each node as (index of the input message, indices of its outputs in order)."""

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
    def read(cls, path: Path) -> ReferenceRecording:
        """Read what `write` wrote; raises SchemaError, also when a message's declaration has changed since."""
        try:
            settings, packed, steps, replies = msgpack.unpackb(lzma.decompress(path.read_bytes()))
            messages = [decode(getattr(m, kind), payload) for kind, payload in packed]
        except SchemaError as error:
            raise SchemaError(f"{path}: {error}; {REMAKE}") from None
        except (OSError, lzma.LZMAError, ValueError, TypeError, AttributeError, msgpack.UnpackException) as error:
            raise SchemaError(f"{path}: not a reference: {error or type(error).__name__}; {REMAKE}") from None
        return cls(settings, messages, {n: [(i, list(outs)) for i, outs in rows] for n, rows in steps.items()}, replies)


@contextmanager
def language_model_replies(replies: dict[str, Any], ask: bool) -> Iterator[None]:
    """Replace the language model: with `ask` keep its replies, without it give the kept ones and do not load it.

    Without `ask` a call that was not kept raises SchemaError: a prompt, a grammar or a list of options has changed.
    """
    methods = {name: getattr(LanguageModel, name) for name in ("load", "complete", "log_probabilities")}

    def replacement(name: str) -> Callable[..., Any]:
        def reply(self: LanguageModel, *arguments: Any, **named: Any) -> Any:
            key = json.dumps([name, *arguments, *([named] if named else [])], ensure_ascii=False)
            if ask:
                result = methods[name](self, *arguments, **named)
                replies[key] = asdict(result) if isinstance(result, Completion) else result.tolist()
            elif key not in replies:
                raise SchemaError(f"the reference holds no reply of the language model to {_short(key)}; {REMAKE}")
            else:
                self.calls += 1
            return Completion(**replies[key]) if name == "complete" else np.array(replies[key])

        return reply

    try:
        for name in ("complete", "log_probabilities"):
            setattr(LanguageModel, name, replacement(name))
        if not ask:
            LanguageModel.load = lambda self: None  # type: ignore[method-assign]
        yield
    finally:
        for name, method in methods.items():
            setattr(LanguageModel, name, method)


def differences(reference: ReferenceRecording, name: str, **changed: Any) -> list[str]:
    """Step a fresh node through its reference; returns where its outputs differ, at most MAX_REPORTED lines.

    `changed` settings replace the recorded ones. A PlacegraphError is a difference, too; it ends the node's steps.
    """
    kinds = {type(reference.messages[i]).__name__ for i, _ in reference.steps[name]}
    node = build_node(name, reference.settings[name] | changed, Context(produced_kinds=tuple(sorted(kinds))))
    lines: list[str] = []
    with language_model_replies(reference.replies, ask=False):
        try:
            node.start()
            for input_index, output_indices in reference.steps[name]:
                message = reference.messages[input_index]
                where = f"{name}: {type(message).__name__} of frame {message.frame_id}"
                lines += _step_differences(where, [reference.messages[i] for i in output_indices], node.step(message))
                if len(lines) >= MAX_REPORTED:
                    break
        except PlacegraphError as error:
            lines.append(f"{name}: {type(error).__name__}: {error}")
        finally:
            node.stop()
    return lines[:MAX_REPORTED]


def _step_differences(where: str, expected: Sequence[Message], outputs: Sequence[Message]) -> list[str]:
    kinds = [[type(message).__name__ for message in side] for side in (expected, outputs)]
    if kinds[0] != kinds[1]:
        return [f"{where} gave {kinds[0]}, gives {kinds[1]}"]
    lines = []
    for old, new in zip(expected, outputs, strict=True):
        new.check()
        for name in (*old.array_specs(), *old.scalar_types()):
            text = _field_difference(getattr(old, name), getattr(new, name), is_json=name == "json")
            lines += [f"{where} gives {type(old).__name__}({old.frame_id}).{name}{text}"] if text else []
    return lines


def _field_difference(old: Any, new: Any, is_json: bool) -> str:
    """The end of a sentence about a difference; empty when equal within the tolerance."""
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
    count = f"{list(first)}: {wrong.sum()} of {wrong.size} values differ, the first" if first else ":"
    return f"{count} was {old[first]}, is {new[first]}"


def _json_differences(old: Any, new: Any, tolerance: float, where: str = "") -> Iterator[str]:
    if isinstance(old, float) and isinstance(new, float):
        if not abs(old - new) <= tolerance and not (np.isnan(old) and np.isnan(new)):
            yield f"{where}: was {old}, is {new}"
    elif isinstance(old, dict) and isinstance(new, dict) and old.keys() == new.keys():
        for key, value in old.items():
            yield from _json_differences(value, new[key], TOLERANCE if key == "tags" else tolerance, f"{where}.{key}")
    elif isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        for i, (a, b) in enumerate(zip(old, new, strict=True)):
            label = a["id"] if isinstance(a, dict) and "id" in a else i
            yield from _json_differences(a, b, tolerance, f"{where}[{label}]")
    elif type(old) is not type(new) or old != new:
        yield f"{where}: was {_short(old)}, is {_short(new)}"


def _short(value: Any) -> str:
    text = json.dumps(value, ensure_ascii=False)
    return text if len(text) <= 100 else f"{text[:97]}..."


def summary(reference: ReferenceRecording) -> str:
    """The recording as text for review: each step on a line with rounded values, all answers and the last graph."""
    lines: list[str] = []
    for name, steps in reference.steps.items():
        lines += [f"== {name} {json.dumps(reference.settings[name], sort_keys=True)}"]
        for input_index, output_indices in steps:
            message = reference.messages[input_index]
            head = f"{type(message).__name__} {message.frame_id} ->"
            lines += [f"{head} {_line(reference.messages[i])}" for i in output_indices] or [f"{head} nothing"]
    for message in reference.messages:
        if isinstance(message, m.Answer):
            lines += [f"== answer {message.question_id}", _indented(message.json)]
    for message in [message for message in reference.messages if isinstance(message, m.NamedGraph)][-1:]:
        lines += ["== the last graph", _indented(message.json)]
    return "\n".join([*lines, ""])


def _indented(text: str) -> str:
    indented = json.dumps(json.loads(text), indent=1, sort_keys=True, ensure_ascii=False)
    # numbers of a list on one line, so that a diff shows what moved
    return re.sub(r"\[[^][{}]*\]", lambda match: " ".join(match[0].split()), indented)


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


def _rounded(value: NDArray[Any]) -> str:
    if value.size <= 16:
        return str((np.round(value, 3) + 0 if value.dtype.kind == "f" else value).tolist())
    return f"{list(value.shape)} mean {float(value.mean(dtype=np.float64)):.3f}"
