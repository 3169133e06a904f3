"""The truth of any data set as one JSON file, for `placegraph evaluate map MAP --against FILE`.

    {"version": 1,
     "floors": [{"bottom_m": 0.0, "top_m": 2.6}],
     "rooms": [{"id": "kitchen", "floor": 0, "polygon": [[0, 0], [4, 0], [4, 3], [0, 3]]}],
     "locations": [{"id": "dining", "floor": 0, "polygon": [[1, 1], [3, 1], [3, 2.5], [1, 2.5]]}],
     "objects": [{"id": "7", "name": "couch", "box": [[1, 1, 0], [2.8, 1.9, 0.8]], "seen": "well"}],
     "classes": {"couch": ["sofa", "settee"], "table": []},
     "names": "words",
     "trajectory": [[1305031102.16, 1.3, 0.6, 1.6, 0.0, 0.0, 0.0, 1.0]]}

Metres, z up. Only `version` is required: a layer that is left out is not scored, an empty one says that there is
nothing. `id` is for people. `floor` is an index of `floors` (0 when left out). `seen` is "well" when left out; what is
"poorly" or "never" seen does not count for recall, and a map object that lies on a poorly seen one is not wrong; a room
or location counts only when it is seen well. `classes` are all names that objects may have, with synonyms; when left
out, the names that occur. `names`: "words" compares names and synonyms, plurals alike; "embedding" also takes any other
word for the class nearest in meaning (ClassVocabulary). A row of `trajectory` is seconds, position, quaternion x y z w
of the camera in the world, as in TUM's files, in the clock of the map. With it the map is rotated about z and shifted
onto the truth; without it both frames are taken as equal.
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
from placegraph.tools.evaluate.ground_truth import (
    ClassVocabulary,
    GroundTruth,
    GroundTruthFloor,
    GroundTruthObject,
    GroundTruthPlace,
    Visibility,
)

VERSION = 1
MAX_COORDINATE_M = 10_000.0  # a larger one suggests millimetres or map coordinates
MAX_PLACE_WIDTH_M = 200.0  # of a room or location; a wider one is probably not in metres

Number = Annotated[float, Field(ge=-MAX_COORDINATE_M, le=MAX_COORDINATE_M, allow_inf_nan=False)]
Xy = tuple[Number, Number]
Xyz = tuple[Number, Number, Number]
PoseRow = tuple[Annotated[float, Field(ge=0, le=9e9)], Number, Number, Number, Number, Number, Number, Number]


def _check_width(polygon: list[Xy]) -> list[Xy]:
    if np.ptp(np.array(polygon), axis=0).max() > MAX_PLACE_WIDTH_M:
        raise ValueError(f"the polygon is wider than {MAX_PLACE_WIDTH_M:g} m; metres are expected")
    return polygon


def _check_corners(box: tuple[Xyz, Xyz]) -> tuple[Xyz, Xyz]:
    if any(low > high for low, high in zip(*box, strict=True)):
        raise ValueError("a lowest corner and then a highest one are expected")
    return box


def _check_quaternion(row: PoseRow) -> PoseRow:
    if abs(np.linalg.norm(row[4:]) - 1) > 1e-2:
        raise ValueError("the last four numbers are no unit quaternion")
    return row


class _Strict(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid", frozen=True)


class _FloorEntry(_Strict):
    id: str = ""
    bottom_m: Number
    top_m: Number
    seen: Visibility = "well"

    @model_validator(mode="after")
    def _check_heights(self) -> _FloorEntry:
        if self.top_m <= self.bottom_m:
            raise ValueError(f"top_m {self.top_m:g} is not above bottom_m {self.bottom_m:g}")
        return self


class _PlaceEntry(_Strict):
    id: str = ""
    floor: Annotated[int, Field(ge=0)] = 0
    polygon: Annotated[list[Xy], Field(min_length=3), AfterValidator(_check_width)]
    seen: Visibility = "well"


class _ObjectEntry(_Strict):
    id: str = ""
    name: Annotated[str, Field(min_length=1)]
    box: Annotated[tuple[Xyz, Xyz], AfterValidator(_check_corners)]
    seen: Visibility = "well"


class _TruthFile(_Strict):
    version: Literal[1]
    floors: list[_FloorEntry] | None = None
    rooms: list[_PlaceEntry] | None = None
    locations: list[_PlaceEntry] | None = None
    objects: list[_ObjectEntry] | None = None
    classes: dict[str, list[str]] | None = None
    names: Literal["words", "embedding"] = "words"
    trajectory: list[Annotated[PoseRow, AfterValidator(_check_quaternion)]] | None = None


def read_truth_file(path: Path) -> GroundTruth:
    """Read and check a truth file. Raises SourceError naming the file and the key that is wrong."""
    try:
        return _ground_truth(_TruthFile.model_validate_json(path.read_bytes()))
    except OSError as error:
        raise SourceError(f"{path}: cannot be read: {error.strerror}") from None
    except ValidationError as error:
        first = error.errors()[0]
        key = ".".join(str(part) for part in first["loc"]) or "the file"
        raise SourceError(f"{path}: {key}: {first['msg'].removeprefix('Value error, ')}") from None
    except ValueError as error:
        raise SourceError(f"{path}: {error}") from None


def _ground_truth(file: _TruthFile) -> GroundTruth:
    objects = file.objects or []
    classes = file.classes if file.classes is not None else {entry.name: [] for entry in objects}
    for i, entry in enumerate(objects):
        if entry.name not in classes:
            raise ValueError(f"objects.{i}.name: {entry.name!r} is not one of the classes")
    try:
        vocabulary = ClassVocabulary(classes, file.names == "embedding")
    except ValueError as error:
        raise ValueError(f"classes: {error}") from None
    floors = 1 if file.floors is None else len(file.floors)
    return GroundTruth(
        floors=None
        if file.floors is None
        else tuple(GroundTruthFloor(entry.bottom_m, entry.top_m, entry.seen == "well") for entry in file.floors),
        rooms=_places("rooms", file.rooms, floors),
        locations=_places("locations", file.locations, floors),
        objects=None
        if file.objects is None
        else tuple(GroundTruthObject(entry.name, np.array(entry.box), entry.seen) for entry in objects),
        vocabulary=vocabulary,
        trajectory=None if file.trajectory is None else _poses(file.trajectory),
    )


def _places(key: str, entries: Sequence[_PlaceEntry] | None, floors: int) -> tuple[GroundTruthPlace, ...] | None:
    if entries is None:
        return None
    for i, entry in enumerate(entries):
        if entry.floor >= floors:
            raise ValueError(f"{key}.{i}.floor: there is no floor {entry.floor}; the first is 0 and there are {floors}")
    return tuple(GroundTruthPlace(entry.floor, np.array(entry.polygon), entry.seen == "well") for entry in entries)


def _poses(rows: Sequence[PoseRow]) -> dict[int, F64]:
    poses: dict[int, F64] = {}
    for i, (seconds, *numbers) in enumerate(rows):
        stamp_ns = round(seconds * 1e9)
        if stamp_ns in poses:
            raise ValueError(f"trajectory.{i}: the time {seconds!r} appears twice")
        poses[stamp_ns] = pose_from_quaternion(np.array(numbers[:3]), np.array(numbers[3:]))
    return poses


def write_truth_file(truth: GroundTruth, path: Path) -> None:
    """Write what read_truth_file reads: sorted keys, 1 mm. Raises SourceError when the file cannot be written."""

    def places(layer: Sequence[GroundTruthPlace] | None) -> list[dict[str, object]] | None:
        if layer is None:
            return None
        return [{"floor": p.floor, "polygon": _rounded(p.outline), "seen": _visibility(p.seen)} for p in layer]

    values = {
        "version": VERSION,
        "floors": None if truth.floors is None else [_floor_row(floor) for floor in truth.floors],
        "rooms": places(truth.rooms),
        "locations": places(truth.locations),
        "objects": None
        if truth.objects is None
        else [{"name": thing.name, "box": _rounded(thing.box), "seen": thing.seen} for thing in truth.objects],
        "classes": truth.vocabulary.classes,
        "names": "embedding" if truth.vocabulary.embedding else "words",
        "trajectory": None
        if truth.trajectory is None
        else [_pose_row(stamp_ns, pose) for stamp_ns, pose in sorted(truth.trajectory.items())],
    }
    lines = [f"{json.dumps(key)}: {_json_lines(value)}" for key, value in values.items() if value is not None]
    try:
        path.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")
    except OSError as error:
        raise SourceError(f"{path}: cannot be written: {error.strerror}") from None


def _json_lines(value: object) -> str:
    """JSON with one list entry a line, so that people can read and edit the file."""
    if isinstance(value, list) and value:
        return "[\n" + ",\n".join(json.dumps(entry, sort_keys=True, ensure_ascii=False) for entry in value) + "\n]"
    return json.dumps(value, sort_keys=True, ensure_ascii=False)


def _floor_row(floor: GroundTruthFloor) -> dict[str, object]:
    return {"bottom_m": round(floor.bottom_m, 3), "top_m": round(floor.top_m, 3), "seen": _visibility(floor.seen)}


def _visibility(seen: bool) -> Visibility:
    return "well" if seen else "never"


def _pose_row(stamp_ns: int, pose: F64) -> list[float]:
    numbers = [*pose[:3, 3].tolist(), *quaternion_xyzw(pose[:3, :3]).tolist()]
    return [stamp_ns / 1e9, *(round(value, 6) + 0.0 for value in numbers)]


def _rounded(array: F64) -> list[list[float]]:
    return [[round(value, 3) + 0.0 for value in row] for row in array.tolist()]  # + 0.0: no -0.0
