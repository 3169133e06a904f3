"""Object lists of other programs: a JSON list of named boxes, read without any image (docs/asking.md#other-data).

    {"objects": [{"id": 7, "tags": ["chair"], "center": [1, 2, 0.5], "size": [0.5, 0.5, 1],
                  "color": "red", "front": [0, 1], "room": "r1"}],
     "rooms": [{"id": "r1", "name": "kitchen", "floor": 0, "outline": [[0, 0], [4, 0], [4, 3]]}],
     "floors": [{"id": 0, "name": "ground floor", "bottom": 0, "top": 2.6}]}

Metres, z up. Only `objects` with `id`, `tags`, `center` and `size` are needed; fields of other names are not read.
Ids are those of the other program, texts or whole numbers. `object_list_import.py` makes the scene graph.
"""

from __future__ import annotations

import json
import logging
import math
import reprlib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import BaseModel, ConfigDict, PlainValidator, ValidationError, model_validator

from placegraph.runtime.arrays import F64
from placegraph.runtime.errors import SchemaError
from placegraph.runtime.scene_graph import Tag
from placegraph.runtime.validation import MAX_COORDINATE_M, first_error, is_unicode

logger = logging.getLogger(__name__)

SourceId = str | int  # an id in the list

# all chosen by hand
MAX_TEXT = 200  # characters of an id or a name
SECONDARY_NAME_WEIGHT = 0.5  # of the names after the first, where the list has no weights


def _text(value: object, what: str) -> str:
    if not isinstance(value, str) or not value.strip() or len(value) > MAX_TEXT:
        raise ValueError(f"expected {what}: text that is not empty, at most {MAX_TEXT} characters")
    if not is_unicode(value):
        raise ValueError(f"expected {what}; half of a surrogate pair is no character")
    return value


def _id(value: object) -> SourceId:
    return value if type(value) is int else _text(value, "an id, text or a whole number")


def _numbers(
    value: object, counts: Sequence[int], what: str, low: float = -MAX_COORDINATE_M, high: float = MAX_COORDINATE_M
) -> list[float]:
    numbers = value if isinstance(value, list) else []
    if len(numbers) not in counts or not all(type(v) in (int, float) and low <= v <= high for v in numbers):
        raise ValueError(f"expected {what}, each from {low:g} to {high:g}, got {reprlib.repr(value)}")
    return [float(v) for v in numbers]


def _tags(value: object) -> tuple[Tag, ...]:
    what = "a list of names, strongest first, or of [name, weight]"
    if not isinstance(value, list) or len({isinstance(entry, list) for entry in value}) > 1:
        raise ValueError(f"expected {what}")
    tags = []
    for i, entry in enumerate(value):
        name, weight = (
            entry if isinstance(entry, list) and len(entry) == 2 else (entry, SECONDARY_NAME_WEIGHT if i else 1.0)
        )
        tags.append(Tag(_text(name, what).lower(), _numbers([weight], (1,), "weights", 0.0)[0]))
    return tuple(sorted(tags, key=lambda tag: -tag.weight))


def _color(value: object) -> tuple[int, ...] | str:
    what = "an sRGB triple or a colour word"
    if isinstance(value, str):
        return _text(value, what).strip().lower().replace("grey", "gray")
    numbers = _numbers(value, (3,), what, 0, 255)
    if any(v % 1 for v in numbers) and max(numbers) <= 1:
        raise ValueError("expected sRGB from 0 to 255, these look like 0 to 1")
    return tuple(round(v) for v in numbers)


def _front(value: object) -> tuple[float, float]:
    x, y = _numbers(value, (2, 3), "a direction [x, y] or [x, y, z]")[:2]
    length = math.hypot(x, y)
    if length < 1e-6:
        raise ValueError("expected a direction that is not upright and not zero")
    return x / length, y / length


def _outline(value: object) -> F64:
    points = value if isinstance(value, list) else []
    if len(points) < 3:
        raise ValueError("expected 3 or more corners [x, y]")
    return np.array([_numbers(point, (2,), "corners [x, y]") for point in points])


def _center(value: object) -> list[float]:
    return _numbers(value, (3,), "3 metres")


def _size(value: object) -> list[float]:
    return _numbers(value, (3,), "3 metres", 0.0)


def _or_none(check: Callable[[object], Any]) -> PlainValidator:
    return PlainValidator(lambda value: None if value is None else check(value))


Id = Annotated[SourceId, PlainValidator(_id)]
MaybeId = Annotated[SourceId | None, _or_none(_id)]
Name = Annotated[str | None, _or_none(lambda value: _text(value, "a name"))]
Tags = Annotated[tuple[Tag, ...], PlainValidator(_tags)]
Metres = Annotated[float | None, _or_none(lambda value: _numbers([value], (1,), "metres")[0])]


class _Entry(BaseModel):
    model_config = ConfigDict(frozen=True, extra="allow", arbitrary_types_allowed=True)

    id: Id


class ListedObject(_Entry):
    """One object: its box lies along the axes."""

    tags: Tags
    center: Annotated[list[float], PlainValidator(_center)]
    size: Annotated[list[float], PlainValidator(_size)]
    color: Annotated[tuple[int, ...] | str | None, _or_none(_color)] = None
    front: Annotated[tuple[float, float] | None, _or_none(_front)] = None
    room: MaybeId = None

    @property
    def all_tags(self) -> tuple[Tag, ...]:
        """Its tags; a colour word adds one ("red chair"), with less weight than the name without the word."""
        if not isinstance(self.color, str):
            return self.tags
        noun, weight = (self.tags[0].name, self.tags[0].weight) if self.tags else ("object", 1.0)
        return (*self.tags, Tag(f"{self.color} {noun}", weight * SECONDARY_NAME_WEIGHT))


class ListedRoom(_Entry):
    """One room; its place is its outline, else its box, else that of the objects in it."""

    name: Name = None
    tags: Tags = ()
    floor: MaybeId = None
    outline: Annotated[F64 | None, _or_none(_outline)] = None  # (N, 2)
    center: Annotated[list[float] | None, _or_none(_center)] = None
    size: Annotated[list[float] | None, _or_none(_size)] = None

    @model_validator(mode="after")
    def _has_both(self) -> ListedRoom:
        if (self.center is None) != (self.size is None):
            raise ValueError("expected center and size, or neither")
        return self

    @property
    def all_tags(self) -> tuple[Tag, ...]:
        """Its name, then its tags."""
        first = (Tag(self.name, max([1.0, *(tag.weight for tag in self.tags)])),) if self.name else ()
        return first + tuple(tag for tag in self.tags if tag.name != self.name)


class ListedFloor(_Entry):
    """One floor; without a bottom it is where its rooms are."""

    name: Name = None
    bottom: Metres = None
    top: Metres = None

    @model_validator(mode="after")
    def _is_ordered(self) -> ListedFloor:
        if self.bottom is not None and self.top is not None and self.top < self.bottom:
            raise ValueError("expected a top that is not below the bottom")
        return self


class ObjectList(BaseModel):
    """The whole file. Without `rooms` (`floors`) they are those that the objects (rooms) name."""

    model_config = ConfigDict(frozen=True, extra="allow")

    objects: list[ListedObject]
    rooms: list[ListedRoom] | None = None
    floors: list[ListedFloor] | None = None


def parse_object_list(data: object, where: str) -> ObjectList:
    """Check the fields of a list and its ids; raises SchemaError naming `where`, the index and the field."""
    try:
        listed = ObjectList.model_validate(data)
    except ValidationError as error:
        raise SchemaError(f"{where}: {first_error(error)}") from None
    for layer in ("objects", "rooms", "floors"):
        seen: dict[SourceId, int] = {}
        for i, entry in enumerate(getattr(listed, layer) or ()):
            if (first_at := seen.setdefault(entry.id, i)) != i:
                raise SchemaError(f"{where}: {layer}[{i}].id: {entry.id!r} is also the id of {layer}[{first_at}]")
    for layer, up in (("objects", "room"), ("rooms", "floor")):
        parents = getattr(listed, f"{up}s")
        parent_ids = None if parents is None else {entry.id for entry in parents}
        for i, entry in enumerate(getattr(listed, layer) or ()):
            parent_id = getattr(entry, up)
            if parent_ids is not None and parent_id is not None and parent_id not in parent_ids:
                raise SchemaError(f"{where}: {layer}[{i}].{up}: {parent_id!r} is not the id of a {up}")
    _warn_of_unread_fields(listed, where)
    return listed


def _warn_of_unread_fields(listed: ObjectList, where: str) -> None:
    """Log the names of unknown fields: a misspelt field would go unnoticed."""
    unread = set(listed.model_extra or ())
    for layer in ("objects", "rooms", "floors"):
        unread |= {f"{layer}.{name}" for entry in getattr(listed, layer) or () for name in entry.model_extra or ()}
    if unread:
        logger.warning("%s: fields that are not read: %s", where, ", ".join(sorted(unread)))


def read_json_file(path: Path) -> Any:
    """Read a JSON file; raises SchemaError naming the file."""
    try:
        return json.loads(path.read_bytes().decode("utf-8-sig"))  # -sig: some editors write a mark first
    except (OSError, ValueError, RecursionError) as error:
        raise SchemaError(f"{path}: cannot read: {error}") from None
