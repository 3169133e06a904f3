"""Ground truth of a house and of the frames exported from it, as the JSON files of a folder's truth/.

Metres and radians, rounded to 1 mm and 1 mrad; world frame. Every file is validated when it is read.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Any, TypeVar

import numpy as np
from pydantic import ConfigDict, Field, PlainSerializer, PlainValidator, TypeAdapter, ValidationError

from placegraph.runtime.arrays import F64
from placegraph.runtime.errors import SourceError
from placegraph.tools.simulator.house_model import House, PlacedItem
from placegraph.tools.simulator.room_connections import room_connections

TRUTH = "truth"  # the folder beside rgb/ and depth/
BEFORE = "before.json"  # the former poses of moved items
QUESTIONS = "questions.json"  # read and written by questions.py
CLEAR_SHARE = 400 / (640 * 480)  # of the image: 20 x 20 px of 640 x 480
_STRICT = ConfigDict(strict=True, extra="forbid")
_AS_LISTS = PlainSerializer(lambda array: array.tolist())


def _shape(*shape: int) -> PlainValidator:
    """A check that a value is finite numbers of a shape, -1 for any length."""

    def check(value: object) -> F64:
        try:
            array = np.array(value, np.float64)
        except (TypeError, ValueError):
            raise ValueError("expected lists of numbers") from None
        if array.ndim != len(shape) or any(n not in (-1, m) for n, m in zip(shape, array.shape, strict=True)):
            raise ValueError(f"expected numbers of shape {shape}, found {array.shape}")
        if not np.isfinite(array).all():
            raise ValueError("expected finite numbers")
        return array

    return PlainValidator(check)


Point = Annotated[F64, _shape(3), _AS_LISTS]
Box = Annotated[F64, _shape(2, 3), _AS_LISTS]
Ends = Box  # two points
Footprint = Annotated[F64, _shape(4, 2), _AS_LISTS]
Polygon = Annotated[F64, _shape(-1, 2), _AS_LISTS]


@dataclass(frozen=True)
class HouseRun:
    """The order for a house and the generator version; equal values mean equal folders."""

    __pydantic_config__ = _STRICT
    seed: int
    floors_asked: int | None  # None: the seed chose
    limit: int  # frames at most; 0: the whole walk
    width: int
    height: int
    version: str  # house_frames.generator_version()
    frames: int  # number of frames
    moved: int = 0  # pieces of furniture between the two walks; 0: there is one walk
    frames_before: int = 0  # frames before the move; all of them when nothing was moved


@dataclass(frozen=True, eq=False)
class OrientedBox:
    """A box turned by `yaw` about z: centre (3,) and size (3,) along its own axes, metres."""

    __pydantic_config__ = _STRICT
    center: Point
    size: Point
    yaw: float


@dataclass(frozen=True, eq=False)
class TrueObject:
    """One object; room, support and location as in PlacedItem, `class_name` is one of object_classes.NAMES."""

    __pydantic_config__ = _STRICT
    id: int
    class_name: Annotated[str, Field(alias="class")]
    room: int
    floor: int
    location: int
    support: int
    color_name: str
    box: Box
    oriented_box: OrientedBox
    footprint: Footprint


@dataclass(frozen=True, eq=False)
class TrueRoom:
    """One room and its polygon (N, 2)."""

    __pydantic_config__ = _STRICT
    id: int
    floor: int
    type: str
    polygon: Polygon


@dataclass(frozen=True, eq=False)
class TrueFloor:
    """One floor and its outline (N, 2)."""

    __pydantic_config__ = _STRICT
    index: int
    z_m: float
    height_m: float
    outline: Polygon


@dataclass(frozen=True, eq=False)
class TrueLocation:
    """A group of objects that are used together, and its outline (K, 2)."""

    __pydantic_config__ = _STRICT
    id: int
    kind: str
    room: int
    members: tuple[int, ...]
    outline: Polygon


@dataclass(frozen=True, eq=False)
class TrueConnection:
    """A door, archway or stairs; fields as in passages.Passage."""

    __pydantic_config__ = _STRICT
    id: int
    kind: str
    rooms: tuple[int, int]
    ends: Ends
    width_m: float
    travel_m: tuple[tuple[int, float], ...]


@dataclass(frozen=True)
class FrameCounts:
    """The number of frames that show an object, and that show it clearly: on `CLEAR_SHARE` of the image or more."""

    __pydantic_config__ = _STRICT
    id: int  # of the object
    frames: int
    clear_frames: int


@dataclass(frozen=True, eq=False)
class Truth:
    """The whole ground truth; each field is the file of that name in truth/."""

    house: HouseRun
    objects: tuple[TrueObject, ...]  # by id
    rooms: tuple[TrueRoom, ...]
    floors: tuple[TrueFloor, ...]
    locations: tuple[TrueLocation, ...]
    seen: tuple[FrameCounts, ...]  # one per object, by id; of moved objects at their last pose
    connections: tuple[TrueConnection, ...] | None = None  # None: the folder has no such file


Record = TypeVar("Record", TrueRoom, TrueFloor, TrueLocation, TrueConnection)
_FILES: dict[str, TypeAdapter[Any]] = {
    "house": TypeAdapter(HouseRun),
    "objects": TypeAdapter(tuple[TrueObject, ...]),
    "rooms": TypeAdapter(tuple[TrueRoom, ...]),
    "floors": TypeAdapter(tuple[TrueFloor, ...]),
    "locations": TypeAdapter(tuple[TrueLocation, ...]),
    "seen": TypeAdapter(tuple[FrameCounts, ...]),
    "connections": TypeAdapter(tuple[TrueConnection, ...]),
}


def truth_of(house: House, run: HouseRun, seen: tuple[FrameCounts, ...]) -> Truth:
    """The truth of a house; `seen` has one entry for each of its items, by id."""
    floor_of_room = {room.id: room.floor for room in house.rooms}
    return Truth(
        house=run,
        objects=tuple(_true_object(item, floor_of_room[item.room]) for item in house.items),
        rooms=tuple(_record(TrueRoom, room) for room in house.rooms),
        floors=tuple(_record(TrueFloor, floor) for floor in house.floors),
        locations=tuple(_record(TrueLocation, location) for location in house.locations),
        seen=seen,
        connections=tuple(_record(TrueConnection, connection) for connection in room_connections(house)),
    )


def _record(kind: type[Record], source: object) -> Record:
    """A record of a kind with the fields of the same names of a house's part."""
    return kind(**{field.name: getattr(source, field.name) for field in fields(kind)})  # type: ignore[arg-type]


def _true_object(placed: PlacedItem, floor: int) -> TrueObject:
    item = placed.item
    return TrueObject(
        id=placed.id,
        class_name=item.name,
        room=placed.room,
        floor=floor,
        location=placed.location,
        support=placed.support,
        color_name=item.color_name,
        box=placed.box,
        oriented_box=OrientedBox(*placed.oriented_box),
        footprint=placed.footprint,
    )


def write_truth(truth: Truth, folder: Path) -> None:
    """Writes truth/*.json with sorted keys and rounded numbers, so that equal truths are equal bytes."""
    (folder / TRUTH).mkdir(exist_ok=True)
    for name, adapter in _FILES.items():
        if getattr(truth, name) is None:
            continue
        _write(getattr(truth, name), adapter, folder / TRUTH / f"{name}.json")


def read_truth(dir: Path) -> Truth:
    """Reads what write_truth wrote; raises SourceError naming the file and the missing or damaged field."""
    files = {field.name: dir / TRUTH / f"{field.name}.json" for field in fields(Truth)}
    # older or foreign folders may lack connections
    existing = {name: file for name, file in files.items() if name != "connections" or file.exists()}
    truth = Truth(**{name: _read(file, name) for name, file in existing.items()})
    ids = [true_object.id for true_object in truth.objects]
    if ids != list(range(len(ids))) or [counts.id for counts in truth.seen] != ids:
        raise SourceError(f"{dir / TRUTH}: objects.json and seen.json do not hold the same objects, counted from 0")
    return truth


def write_before(before: House, ids: tuple[int, ...], folder: Path) -> None:
    """Write truth/before.json: the objects of these ids as they stood before they were moved."""
    floor_of_room = {room.id: room.floor for room in before.rooms}
    objects = tuple(_true_object(before.items[id], floor_of_room[before.items[id].room]) for id in ids)
    _write(objects, _FILES["objects"], folder / TRUTH / BEFORE)


def _write(value: Any, adapter: TypeAdapter[Any], file: Path) -> None:
    values = _rounded(adapter.dump_python(value, mode="json", by_alias=True))
    text = json.dumps(values, sort_keys=True, ensure_ascii=False, allow_nan=False, indent=1)
    file.write_text(text + "\n", encoding="utf-8")


def read_house_run(dir: Path) -> HouseRun | None:
    """The run of a house folder; None when it has no truth/house.json. Raises SourceError when damaged."""
    file = dir / TRUTH / "house.json"
    run: HouseRun | None = _read(file, "house") if file.exists() else None
    return run


def _read(file: Path, name: str) -> Any:
    try:
        return _FILES[name].validate_json(file.read_bytes())
    except OSError as error:
        raise SourceError(f"{file}: cannot be read: {error.strerror}") from None
    except ValidationError as error:
        first = error.errors()[0]
        field = ".".join(str(part) for part in first["loc"]) or "the file"
        raise SourceError(f"{file}: {field}: {first['msg']}") from None


def _rounded(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _rounded(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_rounded(item) for item in value]
    return round(value, 3) + 0.0 if isinstance(value, float) else value  # + 0.0: no -0.0
