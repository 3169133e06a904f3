"""Import a file that can be asked about: a scene graph, or an object list of another program, made into a scene graph.

A list without rooms is one room, without floors one floor. An object without a room is put into the smallest room that
contains its centre, else into a nameless room of its floor. Without `rooms` (or `floors`) in the file, the rooms are
those that objects name (the floors those that rooms name), and their ids are their names.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from placegraph.runtime.arrays import F64
from placegraph.runtime.errors import SchemaError
from placegraph.runtime.scene_graph import GraphNode, SceneGraph, Tag
from placegraph.runtime.scene_graph.object_list import (
    ListedFloor,
    ListedRoom,
    ObjectList,
    SourceId,
    parse_object_list,
    read_json_file,
)

logger = logging.getLogger(__name__)


SUNKEN_FLOOR_M = 0.3  # an object's centre may be so far below the bottom of its floor; chosen by hand


@dataclass(frozen=True)
class ImportedGraph:
    """A graph, and the ids of its nodes in the file it came from; a node without an entry has only its own id."""

    graph: SceneGraph
    ids: dict[str, SourceId] = field(default_factory=dict)


@dataclass
class _PlaceDraft:
    """A room or floor before its node is made; `source_id` None: not in the file, made for objects without a room."""

    source_id: SourceId | None = None
    tags: tuple[Tag, ...] = ()
    floor: int = -1  # of a room; -1: not known yet
    stated_box: F64 | None = None  # (2, 3) in metres; z may be NaN
    outline: F64 | None = None  # (N, 2)
    boxes: list[F64] = field(default_factory=list)  # of the objects or rooms in it

    @property
    def box(self) -> F64 | None:
        """(2, 3) metres: the stated box, unknown numbers from its contents; None when it has neither."""
        contents = np.concatenate(self.boxes) if self.boxes else None
        if self.stated_box is None:
            return None if contents is None else np.stack((contents.min(0), contents.max(0)))
        box = self.stated_box.copy()
        for end, extreme in ((0, np.min), (1, np.max)):
            unknown = np.isnan(box[end])
            substitute = box[1 - end] if contents is None else extreme(contents, axis=0)
            box[end, unknown] = np.nan_to_num(substitute)[unknown]
        return np.stack((box.min(0), box.max(0)))


def import_graph(path: Path) -> ImportedGraph:
    """Read a graph that `SceneGraph.save` wrote, or an object list; raises SchemaError."""
    data = read_json_file(path)
    if isinstance(data, dict) and "objects" in data and "nodes" not in data:
        return graph_from_object_list(parse_object_list(data, str(path)), str(path))
    if isinstance(data, dict) and "version" in data:
        return ImportedGraph(SceneGraph.load(path))
    raise SchemaError(f'{path}: expected a scene graph, or an object list {{"objects": [...]}}')


def graph_from_object_list(listed: ObjectList, where: str) -> ImportedGraph:
    """The scene graph of a checked list; objects are O0, O1, ... in its order."""
    boxes = _boxes([entry.center for entry in listed.objects], [entry.size for entry in listed.objects])
    floors, rooms, room_of = _places(listed, boxes)
    for i, box in zip(room_of, boxes, strict=True):
        rooms[i].boxes.append(box)
    for room in rooms:
        if (box := room.box) is not None:
            floors[room.floor].boxes.append(box)
    ids: dict[str, SourceId] = {}
    places: list[GraphNode] = []
    for letter, layer in (("F", floors), ("R", rooms)):
        for i, place in enumerate(layer):
            if (box := place.box) is None:
                if place.source_id is not None:
                    logger.warning(
                        "%s: left out %r: nothing is in it and nothing says where it is", where, place.source_id
                    )
                continue
            parent = "B0" if letter == "F" else f"F{place.floor}"
            places.append(_node(f"{letter}{i}", parent, place.tags, box, outline=place.outline))
            if place.source_id is not None:
                ids[f"{letter}{i}"] = place.source_id
    corners = np.concatenate([place.box for place in places] or [np.zeros((1, 3))])
    nodes = [_node("B0", "", (), np.stack((corners.min(0), corners.max(0)))), *places]
    for i, (entry, box) in enumerate(zip(listed.objects, boxes, strict=True)):
        color = entry.color if isinstance(entry.color, tuple) else ()
        nodes.append(_node(f"O{i}", f"R{room_of[i]}", entry.all_tags, box, color=color, front=entry.front or ()))
        ids[f"O{i}"] = entry.id
    return ImportedGraph(SceneGraph.of(nodes), ids)


def _boxes(centers: Sequence[Sequence[float]], sizes: Sequence[Sequence[float]]) -> F64:
    """(N, 2, 3) min and max in metres."""
    middle, half = np.array(centers).reshape(-1, 3), np.array(sizes).reshape(-1, 3) / 2
    return np.stack((middle - half, middle + half), axis=1)


def _node(
    node_id: str, parent: str, tags: tuple[Tag, ...], box: F64, outline: F64 | None = None, **fields: Any
) -> GraphNode:
    (x0, y0, _), (x1, y1, _) = box.tolist()
    footprint = np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]]) if outline is None else outline
    fields |= {"first_frame": -1, "last_frame": -1}
    return GraphNode(id=node_id, parent=parent, tags=tags, box=box, footprint=footprint, **fields)


def _places(listed: ObjectList, boxes: F64) -> tuple[list[_PlaceDraft], list[_PlaceDraft], list[int]]:
    """Floors, rooms, and the index of each object's room. boxes: (N, 2, 3) of the objects, metres."""
    listed_rooms = listed.rooms
    if listed_rooms is None:
        room_ids = _distinct(entry.room for entry in listed.objects)
        listed_rooms = [ListedRoom(id=room_id, name=_name_from_id(room_id)) for room_id in room_ids]
    listed_floors = listed.floors
    if listed_floors is None:
        floor_ids = _distinct(room.floor for room in listed_rooms)
        listed_floors = [ListedFloor(id=floor_id, name=_name_from_id(floor_id)) for floor_id in floor_ids]
    floors = [_floor(entry) for entry in listed_floors] or [_PlaceDraft()]
    floor_at = {floor.source_id: i for i, floor in enumerate(floors)}
    rooms = [_room(entry, floor_at) for entry in listed_rooms]
    room_at = {room.source_id: i for i, room in enumerate(rooms)}
    room_of = [-1 if entry.room is None else room_at[entry.room] for entry in listed.objects]
    bottoms = _assign_floors(floors, rooms, _lowest_z_of_rooms(rooms, room_of, boxes))
    centers = boxes.mean(axis=1)
    floor_of = [_floor_index(z, bottoms) for z in centers[:, 2].tolist()]
    containing = _rooms_containing(centers, floor_of, rooms)
    nameless_rooms: dict[int, int] = {}  # by floor
    for i, floor in enumerate(floor_of):
        if room_of[i] < 0:
            room_of[i] = containing[i]
        if room_of[i] < 0:
            if floor not in nameless_rooms:
                nameless_rooms[floor] = len(rooms)
                rooms.append(_PlaceDraft(floor=floor))
            room_of[i] = nameless_rooms[floor]
    return floors, rooms, room_of


def _distinct(ids: Iterable[SourceId | None]) -> list[SourceId]:
    return [source_id for source_id in dict.fromkeys(ids) if source_id is not None]


def _name_from_id(source_id: SourceId) -> str | None:
    return source_id if isinstance(source_id, str) and any(map(str.isalpha, source_id)) else None


def _floor(entry: ListedFloor) -> _PlaceDraft:
    stated_box = np.full((2, 3), np.nan)
    stated_box[:, 2] = [np.nan if z is None else z for z in (entry.bottom, entry.top)]
    tags = (Tag(entry.name, 1.0),) if entry.name else ()
    return _PlaceDraft(entry.id, tags, stated_box=None if np.isnan(stated_box).all() else stated_box)


def _room(entry: ListedRoom, floor_at: dict[SourceId | None, int]) -> _PlaceDraft:
    stated_box = None if entry.center is None or entry.size is None else _boxes([entry.center], [entry.size])[0]
    if entry.outline is not None:
        heights = [np.nan, np.nan] if stated_box is None else stated_box[:, 2]
        stated_box = np.column_stack((np.stack((entry.outline.min(0), entry.outline.max(0))), heights))
    floor = -1 if entry.floor is None else floor_at[entry.floor]
    return _PlaceDraft(entry.id, entry.all_tags, floor, stated_box, entry.outline)


def _lowest_z_of_rooms(rooms: Sequence[_PlaceDraft], room_of: Sequence[int], boxes: F64) -> list[float]:
    """The bottom of each room, stated or that of its lowest object, metres; NaN where unknown."""
    bottoms = [np.nan if room.stated_box is None else float(room.stated_box[0, 2]) for room in rooms]
    stated = ~np.isnan(bottoms)
    for i, object_bottom in zip(room_of, boxes[:, 0, 2].tolist(), strict=True):
        if i >= 0 and not stated[i]:
            bottoms[i] = float(np.fmin(bottoms[i], object_bottom))
    return bottoms


def _assign_floors(
    floors: Sequence[_PlaceDraft], rooms: Sequence[_PlaceDraft], room_bottoms: Sequence[float]
) -> list[float]:
    """Assign rooms without a floor to one by their height; returns the floors' bottoms, NaN where unknown."""

    def floor_bottoms() -> list[float]:
        bottoms = [np.nan if floor.stated_box is None else float(floor.stated_box[0, 2]) for floor in floors]
        unknown = np.isnan(bottoms)
        for room, room_bottom in zip(rooms, room_bottoms, strict=True):
            if room.floor >= 0 and unknown[room.floor]:
                bottoms[room.floor] = float(np.fmin(bottoms[room.floor], room_bottom))
        return bottoms

    bottoms_before = floor_bottoms()
    for room, room_bottom in zip(rooms, room_bottoms, strict=True):
        if room.floor < 0:
            room.floor = _floor_index(room_bottom, bottoms_before)
        floor_box = floors[room.floor].stated_box
        if room.stated_box is not None and floor_box is not None:
            room.stated_box[:, 2] = np.where(np.isnan(room.stated_box[:, 2]), floor_box[:, 2], room.stated_box[:, 2])
    return floor_bottoms()


def _floor_index(z: float, bottoms: Sequence[float]) -> int:
    """The index of the floor at a height: the highest whose bottom is not above it, else the lowest."""
    by_height = sorted((bottom, i) for i, bottom in enumerate(bottoms) if not np.isnan(bottom))
    below = [i for bottom, i in by_height if bottom <= z + SUNKEN_FLOOR_M]
    return (below[-1:] or [i for _, i in by_height[:1]] or [0])[0]


def _rooms_containing(centers: F64, floor_of: Sequence[int], rooms: Sequence[_PlaceDraft]) -> list[int]:
    """The index of the smallest room that contains each point (N, 3); -1 for those in none."""
    room_of = np.full(len(centers), -1)
    areas = [
        (float(np.prod(np.ptp(room.stated_box[:, :2], axis=0))), i)
        for i, room in enumerate(rooms)
        if room.stated_box is not None
    ]
    for _, i in sorted(areas):
        room = rooms[i]
        assert room.stated_box is not None
        low, high = np.nan_to_num(room.stated_box, nan=0.0)
        axes = slice(0, 3 if room.outline is None else 2)
        inside = ((centers >= low) & (centers <= high))[:, axes].all(axis=1) & (room_of < 0)
        if room.outline is not None:
            inside &= np.array(floor_of, int) == room.floor
            corners = room.outline.astype(np.float32)
            for k in np.flatnonzero(inside):
                inside[k] = cv2.pointPolygonTest(corners, centers[k, :2].tolist(), False) >= 0
        room_of[inside] = i
    return [int(i) for i in room_of]
