"""One line for a refused setting: the key, the reason, and for an unknown key the key that may be meant."""

from __future__ import annotations

import difflib
import typing

from pydantic import BaseModel, ValidationError

from placegraph.runtime.renamed_settings import REMOVED_SETTINGS, RENAMED_SETTINGS


def first_problem(error: ValidationError, model: type[BaseModel]) -> tuple[tuple[str, ...], str]:
    """The path of keys of the first refused setting of a model, and the reason; an unknown key comes first."""
    problems = error.errors(include_url=False)  # a misspelt key is unknown, and the right one may be missing
    first = next((problem for problem in problems if problem["type"] == "extra_forbidden"), problems[0])
    path = tuple(map(str, first["loc"]))
    if first["type"] != "extra_forbidden":
        return path, first["msg"]
    return path, "unknown key" + _suggestion(path[-1], _known_keys(model, path[:-1]))


def node_setting_error(node: str, error: ValidationError, model: type[BaseModel]) -> str:
    """`[nodes.<node>] key: reason` of the first refused setting of a node; of a renamed key its new name."""
    path, reason = first_problem(error, model)
    key = ".".join(path)
    new = RENAMED_SETTINGS.get(f"{node}.{key}")
    if new is not None:
        new_node, _, new_key = new.partition(".")
        reason = f"this setting is now called {new_key}" + (f" of [nodes.{new_node}]" if new_node != node else "")
    elif (why := REMOVED_SETTINGS.get(f"{node}.{key}")) is not None:
        reason = f"this setting was removed, delete it: {why}"
    return f"[nodes.{node}] {key}: {reason}"


def _known_keys(model: type[BaseModel], path: tuple[str, ...]) -> list[str]:
    """The keys of the settings model at a path of keys below `model`."""
    for key in path:
        field = model.model_fields.get(key)
        annotation = field.annotation if field else None
        candidates = [annotation, *typing.get_args(annotation)]  # also of `Settings | None`
        nested = [kind for kind in candidates if isinstance(kind, type) and issubclass(kind, BaseModel)]
        if not nested:
            return []
        model = nested[0]
    return list(model.model_fields)


def _suggestion(key: str, known_keys: list[str]) -> str:
    nearest = difflib.get_close_matches(key, known_keys, n=1)
    if nearest:
        return f", did you mean {nearest[0]}?"
    return f"; there are: {', '.join(sorted(known_keys))}" if known_keys else ""
