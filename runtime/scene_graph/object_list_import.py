"""What can be asked, from a file: a scene graph, or a plain object list made into one, with its maker's own ids.

A list without rooms is one room, without floors one floor. An object without a room is in the smallest one that holds
its middle, else in a room without a name on its floor. Rooms and floors that `rooms` and `floors` do not describe, but
objects and rooms name, have their ids as names.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np

from placegraph.runtime.arrays import F64
from placegraph.runtime.errors import SchemaError
from placegraph.runtime.scene_graph import Node, SceneGraph, Tag
from placegraph.runtime.scene_graph.object_list import (
    ListedFloor,
    ListedRoom,
    ObjectList,
    OwnId,
    read_json,
    read_listed,
)

logger = logging.getLogger(__name__)


STEP_DOWN_M = 0.3  # the middle of what lies in a sunken part of a floor may be so far below its bottom


@dataclass(frozen=True)
class Scene:
    """A graph, and by which ids its maker knows its nodes; a node without an entry has no other id than its own."""

    graph: SceneGraph
    ids: dict[str, OwnId] = field(default_factory=dict)


@dataclass
class _Place:
    """A room or a floor on its way into the graph; `own` None: made up, as nothing was said of where things are."""

    own: OwnId | None = None
    names: tuple[Tag, ...] = ()
    floor: int = -1  # of a room; -1: not known yet
    stated: F64 | None = None  # (2, 3) in metres; z may be NaN
    outline: F64 | None = None  # (N, 2)
    boxes: list[F64] = field(default_factory=list)  # of what is in it

    @property
    def box(self) -> F64 | None:
        """(2, 3): what was stated, the rest around its content; None when it is nowhere."""
        around = np.concatenate(self.boxes) if self.boxes else None
        if self.stated is None:
            return None if around is None else np.stack((around.min(0), around.max(0)))
        found = self.stated.copy()
        for end, extreme in ((0, np.min), (1, np.max)):
            unknown = np.isnan(found[end])
            other = found[1 - end] if around is None else extreme(around, axis=0)
            found[end, unknown] = np.nan_to_num(other)[unknown]
        return np.stack((found.min(0), found.max(0)))


def load_scene(path: Path) -> Scene:
    """Read a graph that `SceneGraph.save` wrote, or an object list; raises SchemaError."""
    data = read_json(path)
    if isinstance(data, dict) and "objects" in data and "nodes" not in data:
        return scene_of(read_listed(data, str(path)), str(path))
    if isinstance(data, dict) and "version" in data:
        return Scene(SceneGraph.load(path))
    raise SchemaError(f'{path}: expected a scene graph, or an object list {{"objects": [...]}}')


def scene_of(listed: ObjectList, where: str) -> Scene:
    """The scene graph of a checked list; objects are O0, O1, ... in its order."""
    boxes = _boxes([entry.center for entry in listed.objects], [entry.size for entry in listed.objects])
    floors, rooms, room_of = _places(listed, boxes)
    for i, box in zip(room_of, boxes, strict=True):
        rooms[i].boxes.append(box)
    for room in rooms:
        if (box := room.box) is not None:
            floors[room.floor].boxes.append(box)
    ids: dict[str, OwnId] = {}
    places: list[Node] = []
    for letter, layer in (("F", floors), ("R", rooms)):
        for i, place in enumerate(layer):
            if (box := place.box) is None:
                if place.own is not None:
                    logger.warning("%s: left out %r: nothing is in it and nothing says where it is", where, place.own)
                continue
            parent = "B0" if letter == "F" else f"F{place.floor}"
            places.append(_node(f"{letter}{i}", parent, place.names, box, outline=place.outline))
            if place.own is not None:
                ids[f"{letter}{i}"] = place.own
    around = np.concatenate([place.box for place in places] or [np.zeros((1, 3))])
    nodes = [_node("B0", "", (), np.stack((around.min(0), around.max(0)))), *places]
    for i, (entry, box) in enumerate(zip(listed.objects, boxes, strict=True)):
        color = entry.color if isinstance(entry.color, tuple) else ()
        nodes.append(_node(f"O{i}", f"R{room_of[i]}", entry.names, box, color=color, front=entry.front or ()))
        ids[f"O{i}"] = entry.id
    return Scene(SceneGraph.of(nodes), ids)


def _boxes(centers: Sequence[Sequence[float]], sizes: Sequence[Sequence[float]]) -> F64:
    """(N, 2, 3) min and max in metres."""
    middle, half = np.array(centers).reshape(-1, 3), np.array(sizes).reshape(-1, 3) / 2
    return np.stack((middle - half, middle + half), axis=1)


def _node(
    node_id: str,
    parent: str,
    tags: tuple[Tag, ...],
    box: F64,
    *,
    outline: F64 | None = None,
    color: tuple[int, ...] = (),
    front: tuple[float, ...] = (),
) -> Node:
    if outline is None:
        (x0, y0, _), (x1, y1, _) = box.tolist()
        outline = np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])
    return Node(
        id=node_id,
        parent=parent,
        tags=tags,
        box=box,
        footprint=outline,
        first_frame=-1,
        last_frame=-1,
        color=color,
        front=front,
    )


def _places(listed: ObjectList, boxes: F64) -> tuple[list[_Place], list[_Place], list[int]]:
    """Floors, rooms, and the index of each object's room. boxes: (N, 2, 3) of the objects, metres."""
    said_rooms = listed.rooms
    if said_rooms is None:
        said_rooms = [ListedRoom(id=own, name=_word(own)) for own in _distinct(one.room for one in listed.objects)]
    said_floors = listed.floors
    if said_floors is None:
        said_floors = [ListedFloor(id=own, name=_word(own)) for own in _distinct(one.floor for one in said_rooms)]
    floors = [_floor(said) for said in said_floors] or [_Place()]
    floor_at = {floor.own: i for i, floor in enumerate(floors)}
    rooms = [_room(said, floor_at) for said in said_rooms]
    room_at = {room.own: i for i, room in enumerate(rooms)}
    room_of = [-1 if one.room is None else room_at[one.room] for one in listed.objects]
    bottoms = _settled_floors(floors, rooms, _lows(rooms, room_of, boxes))
    centers = boxes.mean(axis=1)
    storeys = [_storey(z, bottoms) for z in centers[:, 2].tolist()]
    inside = _inside(centers, storeys, rooms)
    nameless: dict[int, int] = {}
    for i, storey in enumerate(storeys):
        if room_of[i] < 0:
            room_of[i] = inside[i]
        if room_of[i] < 0:
            if storey not in nameless:
                nameless[storey] = len(rooms)
                rooms.append(_Place(floor=storey))
            room_of[i] = nameless[storey]
    return floors, rooms, room_of


def _distinct(ids: Iterable[OwnId | None]) -> list[OwnId]:
    return [own for own in dict.fromkeys(ids) if own is not None]


def _word(own: OwnId) -> str | None:
    return own if isinstance(own, str) and any(map(str.isalpha, own)) else None


def _floor(said: ListedFloor) -> _Place:
    stated = np.full((2, 3), np.nan)
    stated[:, 2] = [np.nan if z is None else z for z in (said.bottom, said.top)]
    names = (Tag(said.name, 1.0),) if said.name else ()
    return _Place(said.id, names, stated=None if np.isnan(stated).all() else stated)


def _room(said: ListedRoom, floor_at: dict[OwnId | None, int]) -> _Place:
    stated = None if said.center is None or said.size is None else _boxes([said.center], [said.size])[0]
    if said.outline is not None:
        heights = [np.nan, np.nan] if stated is None else stated[:, 2]
        stated = np.column_stack((np.stack((said.outline.min(0), said.outline.max(0))), heights))
    floor = -1 if said.floor is None else floor_at[said.floor]
    return _Place(said.id, said.names, floor, stated, said.outline)


def _lows(rooms: Sequence[_Place], room_of: Sequence[int], boxes: F64) -> list[float]:
    """The lowest z that is known of each room, metres; NaN without any."""
    lows = [np.nan if room.stated is None else float(room.stated[0, 2]) for room in rooms]
    stated = ~np.isnan(lows)
    for i, low in zip(room_of, boxes[:, 0, 2].tolist(), strict=True):
        if i >= 0 and not stated[i]:
            lows[i] = float(np.fmin(lows[i], low))
    return lows


def _settled_floors(floors: Sequence[_Place], rooms: Sequence[_Place], lows: Sequence[float]) -> list[float]:
    """Find each room's floor by its height where it was not said; returns the floors' bottoms, NaN where unknown."""

    def bottoms() -> list[float]:
        found = [np.nan if floor.stated is None else float(floor.stated[0, 2]) for floor in floors]
        unknown = np.isnan(found)
        for room, low in zip(rooms, lows, strict=True):
            if room.floor >= 0 and unknown[room.floor]:
                found[room.floor] = float(np.fmin(found[room.floor], low))
        return found

    said = bottoms()
    for room, low in zip(rooms, lows, strict=True):
        if room.floor < 0:
            room.floor = _storey(low, said)
        floor = floors[room.floor].stated
        if room.stated is not None and floor is not None:
            room.stated[:, 2] = np.where(np.isnan(room.stated[:, 2]), floor[:, 2], room.stated[:, 2])
    return bottoms()


def _storey(z: float, bottoms: Sequence[float]) -> int:
    """The index of the floor at a height: the highest whose bottom is not above it, else the lowest."""
    by_height = sorted((bottom, i) for i, bottom in enumerate(bottoms) if not np.isnan(bottom))
    below = [i for bottom, i in by_height if bottom <= z + STEP_DOWN_M]
    return (below[-1:] or [i for _, i in by_height[:1]] or [0])[0]


def _inside(centers: F64, storeys: Sequence[int], rooms: Sequence[_Place]) -> list[int]:
    """The index of the smallest room that holds each point (N, 3); -1 for those in none."""
    found = np.full(len(centers), -1)
    areas = [
        (float(np.prod(np.ptp(room.stated[:, :2], axis=0))), i)
        for i, room in enumerate(rooms)
        if room.stated is not None
    ]
    for _, i in sorted(areas):
        room = rooms[i]
        assert room.stated is not None
        low, high = np.nan_to_num(room.stated, nan=0.0)
        axes = slice(0, 3 if room.outline is None else 2)
        held = ((centers >= low) & (centers <= high))[:, axes].all(axis=1) & (found < 0)
        if room.outline is not None:
            held &= np.array(storeys, int) == room.floor
            corners = room.outline.astype(np.float32)
            for k in np.flatnonzero(held):
                held[k] = cv2.pointPolygonTest(corners, centers[k, :2].tolist(), False) >= 0
        found[held] = i
    return [int(i) for i in found]
