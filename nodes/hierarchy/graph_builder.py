"""A Map to the nodes of a scene graph: floors, their rooms, the rooms' locations, and the objects in them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from pydantic import BaseModel

from placegraph.models_onnx import LocationDetector
from placegraph.nodes.hierarchy.approach_poses import Target
from placegraph.nodes.hierarchy.floors import FloorConfig, FloorSpan, find_floors
from placegraph.nodes.hierarchy.locations import LocationArea, LocationConfig, find_locations
from placegraph.nodes.hierarchy.memo import Unchanged, digest
from placegraph.nodes.hierarchy.object_rooms import HomeRoom, find_homes
from placegraph.nodes.hierarchy.persistent_ids import Identities, Place, span_footprint
from placegraph.nodes.hierarchy.place_graph_builder import FloorPlan, PlacedObject, PlaceGraph, PlaceGraphBuilder
from placegraph.nodes.hierarchy.rooms import Grid, RoomArea, RoomConfig, find_rooms
from placegraph.nodes.hierarchy.traversability import TravelConfig
from placegraph.runtime.arrays import F32, F64, Points
from placegraph.runtime.errors import SchemaError
from placegraph.runtime.messages import Map, MapObject
from placegraph.runtime.scene_graph import Node, SceneGraph, Tag
from placegraph.runtime.vision.geometry import bounding_box, convex_footprint


class LayerConfig(BaseModel, frozen=True, strict=True, extra="forbid"):
    """Parameters of all layers."""

    floors: FloorConfig = FloorConfig()
    rooms: RoomConfig = RoomConfig()
    locations: LocationConfig = LocationConfig()
    travel: TravelConfig = TravelConfig()


@dataclass(frozen=True, eq=False)
class _Extent:
    """Of all points of a floor: box (2, 3) and convex outline (K, 2), metres, world."""

    box: F64
    outline: F64


class GraphBuilder:
    """Builds a graph from each Map and remembers which place has which id."""

    def __init__(self, config: LayerConfig, detector: LocationDetector | None = None) -> None:
        """`detector` is the network that config.locations.model names; None where it names none."""
        self._config, self._detector = config, detector
        self._floors, self._rooms, self._locations = Identities("F"), Identities("R"), Identities("L")
        self._places = PlaceGraphBuilder(config.travel, config.floors, config.rooms)
        self._known_rooms: Unchanged[tuple[Grid, list[RoomArea], _Extent]] = Unchanged()
        self._known_locations: Unchanged[list[LocationArea]] = Unchanged()
        self._known_footprints: Unchanged[F32] = Unchanged()

    def build(self, world: Map) -> SceneGraph:
        """The graph of a Map; rooms and locations are without names. Deterministic in the sequence of maps.

        Raises SchemaError for points that are not finite and objects without points.
        """
        _check(world)
        items = world.objects()
        objects: list[Points] = [item.points for item in items]
        spans = find_floors(world.points_world, world.camera_positions_world, self._config.floors)
        if not spans and objects:  # objects without a cloud: the floor is what they stand on
            spans = find_floors(world.object_points_world, world.camera_positions_world, self._config.floors)
        points = world.points_world if len(world.points_world) else world.object_points_world
        floor_ids = self._floors.assign([Place(span_footprint(s.low, max(s.ceiling, s.low + 0.1))) for s in spans])
        nodes: list[Node] = []
        rooms: list[HomeRoom] = []
        extents: list[_Extent] = []
        for i, (span, floor_id) in enumerate(zip(spans, floor_ids, strict=True)):
            inside, free = _in_zone(points, span), _in_zone(world.free_points_world, span)
            grid, areas, extent = self._find_rooms(inside, free, world.free_cell_m, span)
            extents.append(extent)
            ids = self._rooms.assign([Place(area.outline, floor_id) for area in areas])
            nodes.append(_place(floor_id, "B0", span, extent.outline, (Tag(f"floor {i + 1}", 1.0),)))
            rooms += [HomeRoom(i, floor_id, span, grid, area) for i, area in zip(ids, areas, strict=True)]
        nodes += [_place(room.id, room.floor, room.span, room.area.outline) for room in rooms]
        home = find_homes(objects, rooms)
        nodes += self._fill(rooms, home, objects, items)
        for known in (self._known_rooms, self._known_locations, self._known_footprints):
            known.turn()
        nodes = _with_frames([_building(extents), *nodes])
        placed = _placed(nodes, {f"O{item.id}": room.id for item, room in zip(items, home, strict=True)})
        places = self._connect(world, list(zip(spans, floor_ids, strict=True)), rooms, placed)
        nodes = [replace(node, approach=places.approaches.get(node.id)) for node in nodes]
        return SceneGraph.of(nodes, places.connections, places.ways)

    def _connect(
        self, world: Map, floors: list[tuple[FloorSpan, str]], rooms: list[HomeRoom], objects: list[PlacedObject]
    ) -> PlaceGraph:
        points = world.points_world if len(world.points_world) else world.object_points_world
        plans = []
        for span, floor_id in floors:
            here = [room for room in rooms if room.floor == floor_id]
            if not here:
                continue
            inside, free = _in_zone(points, span), _in_zone(world.free_points_world, span)
            masks = tuple((room.id, room.area.mask) for room in here)
            plans.append(FloorPlan(floor_id, span, here[0].grid, inside, free, masks))
        return self._places.build(world, plans, objects)

    def _find_rooms(
        self, points: Points, free: Points, free_cell_m: float, span: FloorSpan
    ) -> tuple[Grid, list[RoomArea], _Extent]:
        """Rooms of a floor and its own outline, made again only when its points, free space or heights changed."""

        def make() -> tuple[Grid, list[RoomArea], _Extent]:
            extent = _Extent(np.asarray(bounding_box(points), float), np.asarray(convex_footprint(points), float))
            return *find_rooms(points, free, free_cell_m, span, self._config.rooms), extent

        return self._known_rooms.get(digest(points, free, free_cell_m, span.low, span.high), make)

    def _fill(
        self, rooms: list[HomeRoom], home: list[HomeRoom], objects: list[Points], items: list[MapObject]
    ) -> list[Node]:
        """Locations of all rooms, then the objects in them; a room's are found again only when its objects changed."""
        digests = [digest(xyz) for xyz in objects]
        members: dict[str, list[int]] = {room.id: [] for room in rooms}
        for i, room in enumerate(home):
            members[room.id].append(i)
        found = [(room, area) for room in rooms for area in self._find_locations(room, members, objects, digests)]
        # all of them at once: an id goes to one place, also when a room is split
        ids = self._locations.assign([Place(area.outline, room.floor) for room, area in found])
        parent = [room.id for room in home]
        nodes = []
        for location_id, (room, area) in zip(ids, found, strict=True):
            held = [members[room.id][k] for k in area.members]
            for i in held:
                parent[i] = location_id
            box = bounding_box(np.concatenate([items[i].box for i in held]))
            nodes.append(_node(location_id, room.id, box, area.outline))
        for i, key in enumerate(digests):
            footprint = self._known_footprints.get(key, partial(convex_footprint, objects[i]))
            nodes.append(_object(items[i], parent[i], footprint))
        return nodes

    def _find_locations(
        self, room: HomeRoom, members: dict[str, list[int]], objects: list[Points], digests: list[bytes]
    ) -> list[LocationArea]:
        mine = members[room.id]
        key = digest(room.span.low, room.span.ceiling, *(digests[i] for i in mine))
        return self._known_locations.get(
            key,
            lambda: find_locations([objects[i] for i in mine], room.span, self._config.locations, self._detector),
        )


def _placed(nodes: list[Node], room_of: dict[str, str]) -> list[PlacedObject]:
    return [
        PlacedObject(node.id, room_of[node.id], Target(node.footprint, node.center))
        for node in nodes
        if node.id in room_of
    ]


def _check(world: Map) -> None:
    for name in ("points_world", "free_points_world", "camera_positions_world", "object_points_world"):
        bad = np.flatnonzero(~np.isfinite(getattr(world, name)).all(axis=1))
        if len(bad):
            raise SchemaError(f"Map {world.revision}: {name}[{bad[0]}] is not finite")
    empty = [item.id for item in world.objects() if not len(item.points)]
    if empty:
        raise SchemaError(f"Map {world.revision}: object {empty[0]} has no points")


def _in_zone(xyz: Points, span: FloorSpan) -> Points:
    z = np.ascontiguousarray(xyz[:, 2])
    return xyz[(z >= span.zone_low) & (z <= span.zone_high)]


def _building(floors: list[_Extent]) -> Node:
    if not floors:
        return _node("B0", "", np.zeros((2, 3)), np.zeros((0, 2)))
    box = np.array([np.min([one.box[0] for one in floors], axis=0), np.max([one.box[1] for one in floors], axis=0)])
    return _node("B0", "", box, convex_footprint(np.concatenate([one.outline for one in floors])))


def _place(node_id: str, parent: str, span: FloorSpan, outline: Points, tags: tuple[Tag, ...] = ()) -> Node:
    box = np.array([[*outline.min(axis=0), span.low], [*outline.max(axis=0), span.ceiling]])
    return _node(node_id, parent, box, outline, tags=tags)


def _object(item: MapObject, parent: str, footprint: Points) -> Node:
    return _node(
        f"O{item.id}",
        parent,
        item.box,
        footprint,
        tags=tuple(Tag(name, votes) for name, votes in item.tags),
        first_frame=item.first_frame,
        last_frame=item.last_frame,
        observations=item.observations,
        oriented_box=tuple(item.oriented_box.tolist()),
        color=tuple(item.color.tolist()),
    )


def _node(node_id: str, parent: str, box: Points, footprint: Points, **fields: Any) -> Node:
    values: dict[str, Any] = {"tags": (), "first_frame": -1, "last_frame": -1} | fields
    return Node(id=node_id, parent=parent, box=np.asarray(box, float), footprint=np.asarray(footprint, float), **values)


def _with_frames(nodes: list[Node]) -> list[Node]:
    """Places are seen from the first to the last frame of the objects in them; -1 where there are none."""
    parents = {node.id: node.parent for node in nodes}
    frames: dict[str, list[int]] = {}
    for node in nodes:
        at = node.parent if node.layer == "object" else ""
        while at:
            frames.setdefault(at, []).extend((node.first_frame, node.last_frame))
            at = parents[at]
    return [
        _node(
            n.id, n.parent, n.box, n.footprint, tags=n.tags, first_frame=min(frames[n.id]), last_frame=max(frames[n.id])
        )
        if n.id in frames
        else n
        for n in nodes
    ]
