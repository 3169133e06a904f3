"""The truth of any data set as one JSON file, for `placegraph evaluate MAP --against FILE`.

    {"version": 1,
     "floors": [{"bottom_m": 0.0, "top_m": 2.6}],
     "rooms": [{"id": "kitchen", "floor": 0, "polygon": [[0, 0], [4, 0], [4, 3], [0, 3]]}],
     "locations": [{"id": "dining", "floor": 0, "polygon": [[1, 1], [3, 1], [3, 2.5], [1, 2.5]]}],
     "objects": [{"id": "7", "name": "couch", "box": [[1, 1, 0], [2.8, 1.9, 0.8]], "seen": "well"}],
     "classes": {"couch": ["sofa", "settee"], "table": []},
     "names": "words",
     "trajectory": [[1305031102.16, 1.3, 0.6, 1.6, 0.0, 0.0, 0.0, 1.0]]}

Metres, z up. Only `version` must be there: a layer that is left out is not scored, an empty one says that there is
nothing. `id` is for people. `floor` counts the entries of `floors` from 0 (0 when left out). `seen` is "well" when left
out; what is "poorly" or "never" seen is not asked for, and a map object that lies on a poorly seen one is not wrong; a
room or location is asked for only when it is seen well. `classes` are all names that objects may have, with other words
for them; when left out, the names that occur. `names`: "words" compares names and those words, plurals alike;
"embedding" also takes another word for the class nearest in meaning (known.Words). A row of `trajectory` is seconds,
position, quaternion x y z w of the camera in the world, as in TUM's files, in the clock of the map. With it the map is
turned about z and shifted onto the truth; without it both frames are taken as equal.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError, model_validator

from placegraph.runtime.arrays import F64
from placegraph.runtime.errors import SourceError
from placegraph.runtime.vision.geometry import pose_from_quaternion, quaternion_xyzw
from placegraph.tools.evaluate.ground_truth import Known, KnownFloor, KnownObject, KnownPlace, Sight, Words

VERSION = 1
FARTHEST_M = 10_000.0  # from the origin: beyond it a file is taken for one in millimetres or in map coordinates
WIDEST_M = 200.0  # of one room or location

Number = Annotated[float, Field(ge=-FARTHEST_M, le=FARTHEST_M, allow_inf_nan=False)]
Xy = tuple[Number, Number]
Xyz = tuple[Number, Number, Number]
Row = tuple[Annotated[float, Field(ge=0, le=9e9)], Number, Number, Number, Number, Number, Number, Number]


def _room_sized(polygon: list[Xy]) -> list[Xy]:
    if np.ptp(np.array(polygon), axis=0).max() > WIDEST_M:
        raise ValueError(f"the polygon is wider than {WIDEST_M:g} m; metres are expected")
    return polygon


def _ordered(box: tuple[Xyz, Xyz]) -> tuple[Xyz, Xyz]:
    if any(low > high for low, high in zip(*box, strict=True)):
        raise ValueError("a lowest corner and then a highest one are expected")
    return box


def _rotated(row: Row) -> Row:
    if abs(np.linalg.norm(row[4:]) - 1) > 1e-2:
        raise ValueError("the last four numbers are no unit quaternion")
    return row


class _Strict(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid", frozen=True)


class _Floor(_Strict):
    id: str = ""
    bottom_m: Number
    top_m: Number
    seen: Sight = "well"

    @model_validator(mode="after")
    def _upright(self) -> _Floor:
        if self.top_m <= self.bottom_m:
            raise ValueError(f"top_m {self.top_m:g} is not above bottom_m {self.bottom_m:g}")
        return self


class _Place(_Strict):
    id: str = ""
    floor: Annotated[int, Field(ge=0)] = 0
    polygon: Annotated[list[Xy], Field(min_length=3), AfterValidator(_room_sized)]
    seen: Sight = "well"


class _Object(_Strict):
    id: str = ""
    name: Annotated[str, Field(min_length=1)]
    box: Annotated[tuple[Xyz, Xyz], AfterValidator(_ordered)]
    seen: Sight = "well"


class _File(_Strict):
    version: Literal[1]
    floors: list[_Floor] | None = None
    rooms: list[_Place] | None = None
    locations: list[_Place] | None = None
    objects: list[_Object] | None = None
    classes: dict[str, list[str]] | None = None
    names: Literal["words", "embedding"] = "words"
    trajectory: list[Annotated[Row, AfterValidator(_rotated)]] | None = None


def read_truth_file(file: Path) -> Known:
    """Read and check a truth file. Raises SourceError naming the file and the key that is wrong."""
    try:
        read = _File.model_validate_json(file.read_bytes())
        return _known(read)
    except OSError as error:
        raise SourceError(f"{file}: cannot be read: {error.strerror}") from None
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(str(part) for part in first["loc"]) or "the file"
        raise SourceError(f"{file}: {key}: {first['msg'].removeprefix('Value error, ')}") from None
    except ValueError as error:
        raise SourceError(f"{file}: {error}") from None


def _known(read: _File) -> Known:
    floors = None if read.floors is None else tuple(_floor(one) for one in read.floors)
    count = 1 if floors is None else len(floors)
    classes = read.classes
    if classes is None:
        classes = {one.name: [] for one in read.objects or []}
    for i, one in enumerate(read.objects or []):
        if one.name not in classes:
            raise ValueError(f"objects.{i}.name: {one.name!r} is not one of the classes")
    try:
        words = Words(classes, read.names == "embedding")
    except ValueError as error:
        raise ValueError(f"classes: {error}") from None
    return Known(
        floors=floors,
        rooms=_places("rooms", read.rooms, count),
        locations=_places("locations", read.locations, count),
        objects=None if read.objects is None else tuple(_object(one) for one in read.objects),
        words=words,
        trajectory=None if read.trajectory is None else _poses(read.trajectory),
    )


def _floor(one: _Floor) -> KnownFloor:
    return KnownFloor(one.bottom_m, one.top_m, one.seen == "well")


def _places(key: str, read: Sequence[_Place] | None, floors: int) -> tuple[KnownPlace, ...] | None:
    for i, one in enumerate(read or []):
        if one.floor >= floors:
            raise ValueError(f"{key}.{i}.floor: there is no floor {one.floor}; the first is 0 and there are {floors}")
    return None if read is None else tuple(KnownPlace(p.floor, np.array(p.polygon), p.seen == "well") for p in read)


def _object(one: _Object) -> KnownObject:
    return KnownObject(one.name, np.array(one.box), one.seen)


def _poses(rows: Sequence[Row]) -> dict[int, F64]:
    found: dict[int, F64] = {}
    for i, (seconds, *numbers) in enumerate(rows):
        stamp = round(seconds * 1e9)
        if stamp in found:
            raise ValueError(f"trajectory.{i}: the time {seconds!r} appears twice")
        found[stamp] = pose_from_quaternion(np.array(numbers[:3]), np.array(numbers[3:]))
    return found


def write_truth_file(known: Known, file: Path) -> None:
    """Write what read_truth_file reads: sorted keys, 1 mm. Raises SourceError when the file cannot be written."""

    def places(layer: Sequence[KnownPlace] | None) -> list[dict[str, object]] | None:
        if layer is None:
            return None
        return [{"floor": one.floor, "polygon": _rounded(one.outline), "seen": _seen(one.seen)} for one in layer]

    values = {
        "version": VERSION,
        "floors": None if known.floors is None else [_floor_row(one) for one in known.floors],
        "rooms": places(known.rooms),
        "locations": places(known.locations),
        "objects": None
        if known.objects is None
        else [{"name": one.name, "box": _rounded(one.box), "seen": one.seen} for one in known.objects],
        "classes": known.words.classes,
        "names": "embedding" if known.words.embedding else "words",
        "trajectory": None
        if known.trajectory is None
        else [_row(stamp, pose) for stamp, pose in sorted(known.trajectory.items())],
    }
    lines = [f"{json.dumps(key)}: {_lines(value)}" for key, value in values.items() if value is not None]
    try:
        file.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")
    except OSError as error:
        raise SourceError(f"{file}: cannot be written: {error.strerror}") from None


def _lines(value: object) -> str:
    """JSON with an entry of a list in each line: a truth is read by people, too."""
    if isinstance(value, list) and value:
        return "[\n" + ",\n".join(json.dumps(one, sort_keys=True, ensure_ascii=False) for one in value) + "\n]"
    return json.dumps(value, sort_keys=True, ensure_ascii=False)


def _floor_row(one: KnownFloor) -> dict[str, object]:
    return {"bottom_m": round(one.bottom_m, 3), "top_m": round(one.top_m, 3), "seen": _seen(one.seen)}


def _seen(seen: bool) -> Sight:
    return "well" if seen else "never"


def _row(stamp_ns: int, pose: F64) -> list[float]:
    numbers = [*pose[:3, 3].tolist(), *quaternion_xyzw(pose[:3, :3]).tolist()]
    return [stamp_ns / 1e9, *(round(value, 6) + 0.0 for value in numbers)]


def _rounded(array: F64) -> list[list[float]]:
    return [[round(value, 3) + 0.0 for value in row] for row in array.tolist()]  # + 0.0: no -0.0
