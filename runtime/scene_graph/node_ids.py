"""Ids of the nodes of a scene graph: a letter for the layer and a number."""

from __future__ import annotations

import re
from typing import Annotated

from pydantic import AfterValidator, WithJsonSchema

from placegraph.runtime.errors import SchemaError

LAYERS = {"B": "building", "F": "floor", "R": "room", "L": "location", "O": "object"}
PARENT_LAYERS = {
    "building": (),
    "floor": ("building",),
    "room": ("floor",),
    "location": ("room",),
    "object": ("room", "location"),
}
ID_PATTERN = re.compile(r"[BFRLO](0|[1-9][0-9]*)")


def _check_id(node_id: str) -> str:
    if not ID_PATTERN.fullmatch(node_id):
        raise ValueError(f"{node_id!r} is not an id (a letter of B F R L O and a number)")
    return node_id


NodeId = Annotated[
    str, AfterValidator(_check_id), WithJsonSchema({"type": "string", "pattern": f"^{ID_PATTERN.pattern}$"})
]


def id_key(node_id: str) -> tuple[int, int]:
    """Sort key: layer order from the building down, then number. Raises SchemaError for what is no id."""
    try:
        _check_id(node_id)
    except ValueError as error:
        raise SchemaError(f"scene graph: {error}") from None
    return list(LAYERS).index(node_id[0]), int(node_id[1:])
