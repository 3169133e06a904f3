"""Steps of nodes kept in a file: messages taken and given, the language model's replies, and how to compare them."""

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

# Integers, names and order are exact: taken messages are the recorded ones bit by bit, so only the last bits of a sum
# can differ between machines. KISS-ICP stops when a step is under 1e-4, and one step more or less moves a pose so far.
TOLERANCE = 1e-3  # m, px, rad, shares
JSON_LENGTH_TOLERANCE_M = 2e-3  # the canonical JSON rounds to 1 mm, which can add one step to TOLERANCE
MAX_REPORTED = 5  # of one node


@dataclass(frozen=True, repr=False)
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


@contextmanager
def language_model_replies(replies: dict[str, Any], ask: bool) -> Iterator[None]:
    """Cut at the language model: `ask` it and keep its replies, or give the kept ones without loading it.

    Without `ask` a call that was not kept raises SchemaError: a prompt, a grammar or a list of options has changed.
    """
    kept = {name: getattr(LanguageModel, name) for name in ("load", "complete", "log_probabilities")}

    def cut(name: str) -> Callable[..., Any]:
        def reply(self: LanguageModel, *arguments: Any, **named: Any) -> Any:
            key = json.dumps([name, *arguments, *([named] if named else [])], ensure_ascii=False)
            if ask:
                found = kept[name](self, *arguments, **named)
                replies[key] = asdict(found) if isinstance(found, Completion) else found.tolist()
            elif key not in replies:
                raise SchemaError(f"the reference holds no reply of the language model to {_short(key)}; {REMAKE}")
            else:
                self.calls += 1
            return Completion(**replies[key]) if name == "complete" else np.array(replies[key])

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
    """Step a fresh node through its reference; where what it gives is not what it gave, at most MAX_REPORTED lines.

    `changed` settings replace the recorded ones. An error of ours is a difference; it ends the node's steps.
    """
    kinds = {type(reference.messages[taken]).__name__ for taken, _ in reference.steps[name]}
    node = build_node(name, reference.settings[name] | changed, Context(given=tuple(sorted(kinds))))
    found: list[str] = []
    with language_model_replies(reference.replies, ask=False):
        try:
            node.start()
            for taken, given in reference.steps[name]:
                message = reference.messages[taken]
                where = f"{name}: {type(message).__name__} of frame {message.frame_id}"
                found += _step_differences(where, [reference.messages[i] for i in given], node.step(message))
                if len(found) >= MAX_REPORTED:
                    break
        except PlacegraphError as error:
            found.append(f"{name}: {type(error).__name__}: {error}")
        finally:
            node.stop()
    return found[:MAX_REPORTED]


def _step_differences(where: str, expected: Sequence[Message], given: Sequence[Message]) -> list[str]:
    kinds = [[type(message).__name__ for message in side] for side in (expected, given)]
    if kinds[0] != kinds[1]:
        return [f"{where} gave {kinds[0]}, gives {kinds[1]}"]
    found = []
    for old, new in zip(expected, given, strict=True):
        new.check()
        for name in (*old.array_specs(), *old.scalar_types()):
            text = _field_difference(getattr(old, name), getattr(new, name), is_json=name == "json")
            found += [f"{where} gives {type(old).__name__}({old.frame_id}).{name}{text}"] if text else []
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
    graphs = [message for message in reference.messages if isinstance(message, m.NamedGraph)][-1:]
    for message in graphs:
        lines += ["== the last graph", _indented(message.json)]
    return "\n".join([*lines, ""])


def _indented(text: str) -> str:
    spread = json.dumps(json.loads(text), indent=1, sort_keys=True, ensure_ascii=False)
    # numbers of a list on one line, so that a diff shows what moved
    return re.sub(r"\[[^][{}]*\]", lambda found: " ".join(found[0].split()), spread)


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
