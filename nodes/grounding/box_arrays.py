"""The nodes of a scene graph as arrays of boxes, so that relations are computed for all pairs at once.

Row i is an object, a place, or a part of a room that people name although the map has no node for it (a corner, a wall,
the floor). Coordinates are metres in the building's frame: the world rotated about z by -`Layout.yaw`, so that the
walls are parallel to the axes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from functools import cached_property

import numpy as np

from placegraph.nodes.grounding.axis_alignment import building_yaw, rotated_box, rotation_z
from placegraph.runtime.arrays import F64, I64, Bool
from placegraph.runtime.scene_graph import GraphNode, SceneGraph

SHELL_M = 0.05  # thickness of a wall, floor or ceiling that the map does not hold; chosen by hand


class RoomPart(Enum):
    """A part of a room that people name although the map has no node for it; the value is its wording."""

    ROOM = "room {}"
    FLOOR = "the floor of room {}"
    CEILING = "the ceiling of room {}"
    WALL = "a wall of room {}"
    CORNER = "a corner of room {}"
    CENTER = "the middle of room {}"


@dataclass(frozen=True)
class Label:
    """What a box is: a node with its name, id and layer, or a part of the room whose id is `name`."""

    name: str
    node_id: str = ""  # "" for a part of a room
    layer: str = ""
    part: RoomPart | None = None

    def __str__(self) -> str:
        """The wording in evidence sentences: `chair O3`, `a corner of room R1`."""
        return self.part.value.format(self.name) if self.part else f"{self.name} {self.node_id}"

    @property
    def head_noun(self) -> str:
        """The last word of a node's name: `table` of a coffee table; "" for a part of a room."""
        return "" if self.part else self.name.rsplit(" ", 1)[-1]


@dataclass(frozen=True, eq=False)
class Boxes:
    """N boxes: `low`, `high` (N, 3) m; `yaw` (N,) rad; `front` (N, 2), NaN: unknown; `room` (N,) row of `Layout.rooms`.

    A room of -1 is the building: the box is in no room.
    """

    labels: tuple[Label, ...]
    low: F64
    high: F64
    yaw: F64
    front: F64
    room: I64

    def __len__(self) -> int:
        return len(self.labels)

    @cached_property
    def ids(self) -> tuple[str, ...]:
        """The nodes' ids; "" for a part of a room."""
        return tuple(label.node_id for label in self.labels)

    @cached_property
    def center(self) -> F64:
        """(N, 3) centres, m."""
        return (self.low + self.high) / 2

    @cached_property
    def size(self) -> F64:
        """(N, 3) extents, m, at least 1 cm so that thin things have a volume."""
        return np.maximum(self.high - self.low, 0.01)

    @cached_property
    def is_place(self) -> Bool:
        """(N,) whether it is a building, floor, room or location."""
        return np.array([label.layer not in ("", "object") for label in self.labels], bool)

    def is_part(self, *parts: RoomPart) -> Bool:
        """(N,) whether it is one of these parts of a room; without arguments: any part."""
        return np.array(
            [label.part is not None and label.part in (parts or (label.part,)) for label in self.labels], bool
        )

    def take(self, rows: I64 | Sequence[int]) -> Boxes:
        """The boxes of some rows, in the order given."""
        rows = np.asarray(rows, np.int64)
        listed = rows.tolist()
        return Boxes(
            tuple(self.labels[i] for i in listed), self.low[rows], self.high[rows],
            self.yaw[rows], self.front[rows], self.room[rows],
        )  # fmt: skip


def concatenate(parts: Sequence[Boxes]) -> Boxes:
    """One `Boxes` from one or more."""
    return Boxes(
        sum((part.labels for part in parts), ()),
        *(np.concatenate([getattr(part, name) for part in parts]) for name in ("low", "high", "yaw", "front", "room")),
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Layout:
    """A graph as arrays. Rows of `all` and `nodes`: objects by id, then floors, rooms and locations."""

    nodes: tuple[GraphNode, ...]
    all: Boxes
    rooms: tuple[GraphNode, ...]
    room_low: F64  # (R + 1, 3) m; the last row, index -1, is the building
    room_high: F64
    places: I64  # rows
    yaw: float = 0.0  # rad, of the building in the world

    def from_world(self, xyz: F64) -> F64:
        """(3,) from the world to the building's frame."""
        return rotation_z(-self.yaw) @ xyz

    def to_world(self, xyz: F64) -> F64:
        """(3,) from the building's frame to the world."""
        return rotation_z(self.yaw) @ xyz

    @cached_property
    def row(self) -> dict[str, int]:
        """The row of each node by id."""
        return {node.id: i for i, node in enumerate(self.nodes)}

    def room_center(self, room: I64) -> F64:
        """(N, 2) centres of rooms by their rows, m."""
        return np.asarray((self.room_low[room, :2] + self.room_high[room, :2]) / 2)

    def room_parts(self, part: RoomPart) -> Boxes:
        """All boxes of one part: of every room, or of the building when the graph has no rooms."""
        low, high = (self.room_low[:-1], self.room_high[:-1]) if self.rooms else (self.room_low, self.room_high)
        rows = np.arange(len(low)) if self.rooms else np.array([-1])
        ids = [room.id for room in self.rooms] or ["B0"]
        boxes = [_room_part_boxes(part, low[k], high[k]) for k in range(len(ids))]
        counts = [len(of_room) for of_room in boxes]
        bounds = np.array([box for of_room in boxes for box in of_room]).reshape(-1, 2, 3)
        return Boxes(
            tuple(Label(room_id, part=part) for room_id, of_room in zip(ids, boxes, strict=True) for _ in of_room),
            bounds[:, 0], bounds[:, 1], np.zeros(len(bounds)), np.full((len(bounds), 2), np.nan),
            np.repeat(rows, counts),
        )  # fmt: skip


def _room_part_boxes(part: RoomPart, low: F64, high: F64) -> list[tuple[F64, F64]]:
    """Low and high corner of each box of a part, for a room from low to high."""
    if part is RoomPart.ROOM:
        return [(low, high)]
    if part is RoomPart.CENTER:
        middle = (low + high) / 2
        return [(middle, middle)]
    if part in (RoomPart.FLOOR, RoomPart.CEILING):
        z = low[2] if part is RoomPart.FLOOR else high[2] + SHELL_M
        return [(np.array([*low[:2], z - SHELL_M]), np.array([*high[:2], z]))]
    if part is RoomPart.CORNER:
        xs, ys = (low[0], high[0]), (low[1], high[1])
        return [(np.array([x, y, low[2]]), np.array([x, y, high[2]])) for x in xs for y in ys]
    walls = []
    for axis in (0, 1):
        for value, sign in ((low[axis], -1), (high[axis], 1)):
            a, b = low.copy(), high.copy()
            a[axis], b[axis] = sorted((value, value + sign * SHELL_M))
            walls.append((a, b))
    return walls


def layout_of(graph: SceneGraph) -> Layout:
    """A graph's boxes as arrays, in the building's frame."""
    objects = graph.layer("object")
    places = [node for name in ("floor", "room", "location") for node in graph.layer(name)]
    nodes, rooms = (*objects, *places), tuple(graph.layer("room"))
    room_row = {room.id: i for i, room in enumerate(rooms)}
    yaw = building_yaw(graph)
    rotation = rotation_z(-yaw)[:2, :2]
    boxes = np.array([rotated_box(node, -yaw) if yaw else node.box for node in nodes]).reshape(-1, 2, 3)
    room_boxes = np.array([rotated_box(node, -yaw) if yaw else node.box for node in (*rooms, graph.building)])
    return Layout(
        nodes=nodes,
        all=Boxes(
            tuple(Label(node.name, node.id, node.layer) for node in nodes),
            boxes[:, 0], boxes[:, 1],
            np.array([node.oriented_box[6] - yaw if node.oriented_box else 0.0 for node in nodes]),
            np.array([node.front or (np.nan, np.nan) for node in nodes]).reshape(-1, 2) @ rotation.T,
            np.array([room_row.get(graph.room_of(node.id), -1) for node in nodes], np.int64),
        ),
        rooms=rooms,
        room_low=room_boxes[:, 0],
        room_high=room_boxes[:, 1],
        places=np.arange(len(objects), len(nodes)),
        yaw=yaw,
    )  # fmt: skip
