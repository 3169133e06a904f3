"""The data model of a house, shared by floor plan, furniture, renderer and ground truth.

World frame: metres, z up, the surface of the lowest floor at z = 0. Item frame: origin in the middle of the footprint
at the lowest point, x right, y to the back (the front of a sofa faces -y), z up. All values are frozen; random
generators are passed in.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from placegraph.runtime.arrays import F64, I32

Color = tuple[int, int, int]  # sRGB 0..255

ON_FLOOR, ON_WALL, ON_CEILING = -1, -2, -3  # PlacedItem.support where it is no other item
NOWHERE = -1  # PlacedItem.location of an item that belongs to no group

TEXTURES = (
    "plain", "noise", "wood", "fabric", "stripes", "checks", "tiles", "bricks", "marble", "leaves", "books", "picture",
    "screen", "grille",
)  # fmt: skip


@dataclass(frozen=True)
class Material:
    """How a surface looks: a texture of two colours, repeated every `scale_m`, or stretched over the part when 0."""

    color: Color
    texture: str = "plain"  # one of TEXTURES
    second: Color = (128, 128, 128)  # the texture's other colour; plain has none
    scale_m: float = 0.5
    seed: int = 0  # of the texture's own randomness
    gloss: float = 0.0  # 0 matt .. 1 mirror-like highlight
    glow: float = 0.0  # 0 lit by the room .. 1 shines by itself (a screen, a lampshade, a window pane)


@dataclass(frozen=True, eq=False)
class Part:
    """A triangle mesh of one material: vertices (V, 3) in metres, faces (F, 3) counterclockwise from outside."""

    vertices: F64
    faces: I32
    material: Material


@dataclass(frozen=True)
class SupportSurface:
    """A level rectangle of an item on which small items may stand, item frame, with the free height above it."""

    x0: float
    y0: float
    x1: float
    y1: float
    z: float
    clearance_m: float = 1.0


@dataclass(frozen=True, eq=False)
class Item:
    """One designed object in its own frame."""

    name: str  # a class of object_classes.py
    parts: tuple[Part, ...]
    color_name: str = ""  # the word a person would use for its main colour; "" when it has none
    surfaces: tuple[SupportSurface, ...] = ()

    @property
    def extent(self) -> F64:
        """(2, 3) min and max of its vertices in metres, item frame."""
        vertices = np.concatenate([part.vertices for part in self.parts])
        return np.stack((vertices.min(axis=0), vertices.max(axis=0)))


@dataclass(frozen=True, eq=False)
class PlacedItem:
    """An item in the world: turned by `yaw` about z, then moved to (x, y, z)."""

    id: int  # counted from 0 in the house; the instance image holds id + 1
    item: Item
    x: float
    y: float
    z: float
    yaw: float  # radians
    room: int  # Room.id
    support: int = ON_FLOOR  # the id of the item it stands on, or ON_FLOOR, ON_WALL, ON_CEILING
    location: int = NOWHERE  # Location.id

    @property
    def world_from_item(self) -> F64:
        """(4, 4) rigid transform."""
        c, s = np.cos(self.yaw), np.sin(self.yaw)
        return np.array([[c, -s, 0, self.x], [s, c, 0, self.y], [0, 0, 1, self.z], [0, 0, 0, 1.0]])

    @property
    def vertices_world(self) -> F64:
        """(V, 3) of all parts."""
        local = np.concatenate([part.vertices for part in self.item.parts])
        pose = self.world_from_item
        return np.asarray(local @ pose[:3, :3].T + pose[:3, 3])

    @property
    def oriented_box(self) -> tuple[F64, F64, float]:
        """Centre (3,), size (3,) along its own axes, and yaw in -pi..pi; metres, world frame."""
        (low, high), pose = self.item.extent, self.world_from_item
        center = pose[:3, :3] @ ((low + high) / 2) + pose[:3, 3]
        return center, high - low, float(np.arctan2(np.sin(self.yaw), np.cos(self.yaw)))

    @property
    def box(self) -> F64:
        """(2, 3) axis-aligned min and max in metres, world frame."""
        vertices = self.vertices_world
        return np.stack((vertices.min(axis=0), vertices.max(axis=0)))

    @property
    def footprint(self) -> F64:
        """(4, 2) corners of the yaw-oriented box seen from above, counterclockwise, world frame."""
        (x0, y0, _), (x1, y1, _) = self.item.extent
        corners = np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])
        pose = self.world_from_item
        return np.asarray(corners @ pose[:2, :2].T + pose[:2, 3])


@dataclass(frozen=True)
class WallOpening:
    """A hole in a wall, from `start_m` to `end_m` along it and from `low_m` to `high_m` above the floor."""

    kind: str  # door, archway, window
    start_m: float
    end_m: float
    low_m: float
    high_m: float
    rooms: tuple[int, ...] = ()  # Room.ids that a door or archway joins


@dataclass(frozen=True)
class Wall:
    """An upright wall between two points of its middle line, in metres, world frame."""

    a: tuple[float, float]
    b: tuple[float, float]
    thickness_m: float
    openings: tuple[WallOpening, ...] = ()

    @property
    def direction(self) -> F64:
        """(2,) the unit vector from a to b."""
        way = np.array(self.b) - np.array(self.a)
        return np.asarray(way / np.linalg.norm(way))

    def middle_of(self, opening: WallOpening) -> F64:
        """(2,) the middle of an opening, world frame."""
        return np.asarray(np.array(self.a) + self.direction * (opening.start_m + opening.end_m) / 2)


@dataclass(frozen=True, eq=False)
class Room:
    """One room: its type (bedroom, kitchen, ...) and polygon (N, 2) of the walls' inner faces, counterclockwise."""

    id: int  # counted from 0 in the house
    floor: int
    type: str
    polygon: F64

    @property
    def area_m2(self) -> float:
        """The area of the polygon."""
        x, y = self.polygon.T
        return abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1))) / 2


@dataclass(frozen=True, eq=False)
class Staircase:
    """A straight flight from `floor` to the floor above: foot and head (3,), the middles of its first and last edge."""

    floor: int
    foot: F64  # on the lower floor, metres, world frame
    head: F64  # on the upper floor
    width_m: float
    hole: F64  # (4, 2) corners of the hole in the upper slab, world frame


@dataclass(frozen=True, eq=False)
class Floor:
    """One floor: its surface at `z_m`, its ceiling `height_m` above, and its outline (N, 2)."""

    index: int
    z_m: float
    height_m: float
    outline: F64
    rooms: tuple[Room, ...]
    walls: tuple[Wall, ...]


@dataclass(frozen=True, eq=False)
class FurnitureLocation:
    """Furniture used together: kind, room, members (item ids) and outline (K, 2), world frame."""

    id: int
    kind: str  # sleeping area, dining area, ...
    room: int
    members: tuple[int, ...]
    outline: F64  # convex hull of the members' footprints


@dataclass(frozen=True, eq=False)
class House:
    """A whole building."""

    seed: int
    floors: tuple[Floor, ...]
    stairs: tuple[Staircase, ...]
    structure: tuple[Part, ...]  # walls, slabs, ceilings: no objects; vertices in the world frame
    items: tuple[PlacedItem, ...] = ()
    locations: tuple[FurnitureLocation, ...] = ()
    lights: tuple[tuple[float, float, float], ...] = field(default=())  # one below the middle of each room's ceiling

    @property
    def rooms(self) -> tuple[Room, ...]:
        """Rooms of all floors, by id."""
        return tuple(room for floor in self.floors for room in floor.rooms)
