"""The nodes of a scene graph as arrays of boxes, so that relations are computed for all pairs at once.

Row i is an object, a place, or a part of a room that people name although the map has no node for it (a corner, a wall,
the floor). Coordinates are metres in the building's frame: the world rotated about z by -`Layout.yaw`, so that the
walls are parallel to the axes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from placegraph.nodes.grounding.axis_alignment import building_yaw, rotated_box, rotation_z
from placegraph.runtime.arrays import F64, I64, Bool
from placegraph.runtime.scene_graph import Node, SceneGraph

SHELL_M = 0.05  # departs: how thick a wall, floor or ceiling is drawn that the map does not hold
PLACES = "BFRL"  # the letters of ids that are places


@dataclass(frozen=True, eq=False)
class Boxes:
    """N boxes: `low`, `high` (N, 3) m; `yaw` (N,) rad; `front` (N, 2), NaN: unknown; `room` (N,) row of `Layout.rooms`.

    A room of -1 is the building: the box is in no room.
    """

    labels: tuple[str, ...]  # "chair O3"
    ids: tuple[str, ...]  # "" for a part of a room
    low: F64
    high: F64
    yaw: F64
    front: F64
    room: I64

    def __len__(self) -> int:
        return len(self.ids)

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
        return np.array([bool(node_id) and node_id[0] in PLACES for node_id in self.ids], bool)

    def take(self, rows: I64 | Sequence[int]) -> Boxes:
        """The boxes of some rows, in the order given."""
        rows = np.asarray(rows, np.int64)
        listed = rows.tolist()
        return Boxes(
            tuple(self.labels[i] for i in listed), tuple(self.ids[i] for i in listed), self.low[rows], self.high[rows],
            self.yaw[rows], self.front[rows], self.room[rows],
        )  # fmt: skip


def concatenate(parts: Sequence[Boxes]) -> Boxes:
    """One `Boxes` from one or more."""
    return Boxes(
        sum((part.labels for part in parts), ()), sum((part.ids for part in parts), ()),
        *(np.concatenate([getattr(part, name) for part in parts]) for name in ("low", "high", "yaw", "front", "room")),
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Layout:
    """A graph as arrays. Rows of `all` and `nodes`: objects by id, then floors, rooms and locations."""

    nodes: tuple[Node, ...]
    all: Boxes
    rooms: tuple[Node, ...]
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

    def room_parts(self, kind: str) -> Boxes:
        """Parts of all rooms, or of the building when there are none: floor, ceiling, wall, corner, center or room."""
        low, high = (self.room_low[:-1], self.room_high[:-1]) if self.rooms else (self.room_low, self.room_high)
        rows = np.arange(len(low)) if self.rooms else np.array([-1])
        names = [room.id for room in self.rooms] or ["B0"]
        parts: list[tuple[int, F64, F64, str]] = []
        for k, name in enumerate(names):
            parts += [(int(rows[k]), *box) for box in _room_part_boxes(kind, low[k], high[k], name)]
        count = len(parts)
        return Boxes(
            tuple(part[3] for part in parts), ("",) * count, np.array([part[1] for part in parts]).reshape(-1, 3),
            np.array([part[2] for part in parts]).reshape(-1, 3), np.zeros(count), np.full((count, 2), np.nan),
            np.array([part[0] for part in parts], np.int64),
        )  # fmt: skip


def _room_part_boxes(kind: str, low: F64, high: F64, room: str) -> list[tuple[F64, F64, str]]:
    if kind == "room":
        return [(low, high, f"room {room}")]
    if kind == "center":
        middle = (low + high) / 2
        return [(middle, middle, f"the middle of room {room}")]
    if kind in ("floor", "ceiling"):
        z = low[2] if kind == "floor" else high[2] + SHELL_M
        return [(np.array([*low[:2], z - SHELL_M]), np.array([*high[:2], z]), f"the {kind} of room {room}")]
    xs, ys = (low[0], high[0]), (low[1], high[1])
    if kind == "corner":
        return [
            (np.array([x, y, low[2]]), np.array([x, y, high[2]]), f"a corner of room {room}") for x in xs for y in ys
        ]
    walls = []
    for axis in (0, 1):
        for value, sign in ((low[axis], -1), (high[axis], 1)):
            a, b = low.copy(), high.copy()
            a[axis], b[axis] = sorted((value, value + sign * SHELL_M))
            walls.append((a, b, f"a wall of room {room}"))
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
            tuple(f"{node.name} {node.id}" for node in nodes), tuple(node.id for node in nodes),
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
