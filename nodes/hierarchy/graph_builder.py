"""A Map to the nodes of a scene graph: floors, their rooms, the rooms' locations, and the objects in them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from pydantic import BaseModel

from placegraph.models_onnx import LocationDetector
from placegraph.nodes.hierarchy.approach_poses import ApproachTarget
from placegraph.nodes.hierarchy.floors import FloorConfig, FloorSpan, find_floors
from placegraph.nodes.hierarchy.locations import LocationArea, LocationConfig, find_locations
from placegraph.nodes.hierarchy.memo import Memo, digest
from placegraph.nodes.hierarchy.object_rooms import FloorRoom, assign_rooms
from placegraph.nodes.hierarchy.persistent_ids import PersistentIds, height_outline
from placegraph.nodes.hierarchy.place_graph_builder import FloorPlan, PlacedObject, PlaceGraphBuilder
from placegraph.nodes.hierarchy.plan_grid import PlanGrid
from placegraph.nodes.hierarchy.rooms import RoomArea, RoomConfig, find_rooms
from placegraph.nodes.hierarchy.traversability import TraversabilityConfig
from placegraph.runtime.arrays import F32, F64, Points
from placegraph.runtime.errors import SchemaError
from placegraph.runtime.messages import Map, MapObject
from placegraph.runtime.scene_graph import GraphNode, SceneGraph, Tag
from placegraph.runtime.vision.geometry import bounding_box, convex_footprint


class LayerConfig(BaseModel, frozen=True, strict=True, extra="forbid"):
    """Parameters of all layers."""

    floors: FloorConfig = FloorConfig()
    rooms: RoomConfig = RoomConfig()
    locations: LocationConfig = LocationConfig()
    traversability: TraversabilityConfig = TraversabilityConfig()


@dataclass(frozen=True, eq=False)
class _FloorExtent:
    """Of all points of a floor: box (2, 3) and convex outline (K, 2), metres, world."""

    box: F64
    outline: F64


class GraphBuilder:
    """Builds a graph from each Map and remembers which place has which id."""

    def __init__(self, config: LayerConfig, detector: LocationDetector | None = None) -> None:
        """`detector` is the network that config.locations.model names; None where it names none."""
        self._config, self._detector = config, detector
        self._floor_ids, self._room_ids, self._location_ids = (PersistentIds(letter) for letter in "FRL")
        self._places = PlaceGraphBuilder(config.traversability, config.floors, config.rooms)
        self._room_memo: Memo[tuple[PlanGrid, list[RoomArea], _FloorExtent]] = Memo()
        self._location_memo: Memo[list[LocationArea]] = Memo()
        self._footprint_memo: Memo[F32] = Memo()

    def build(self, map_: Map) -> SceneGraph:
        """The graph of a Map; rooms and locations are without names. Deterministic in the sequence of maps.

        Raises SchemaError for points that are not finite and objects without points.
        """
        _check(map_)
        items = map_.objects()
        objects: list[Points] = [item.points for item in items]
        spans = find_floors(map_.points_world, map_.camera_positions_world, self._config.floors)
        if not spans and objects:  # objects without a cloud: the floor is what they stand on
            spans = find_floors(map_.object_points_world, map_.camera_positions_world, self._config.floors)
        points = map_.points_world if len(map_.points_world) else map_.object_points_world
        floor_ids = self._floor_ids.assign(
            [("", height_outline(span.low_m, max(span.ceiling_m, span.low_m + 0.1))) for span in spans]
        )
        nodes: list[GraphNode] = []
        rooms: list[FloorRoom] = []
        extents: list[_FloorExtent] = []
        plans: list[FloorPlan] = []
        for i, (span, floor_id) in enumerate(zip(spans, floor_ids, strict=True)):
            floor_points, free = _in_zone(points, span), _in_zone(map_.free_points_world, span)
            key = digest(floor_points, free, map_.free_cell_m, span.low_m, span.high_m)
            grid, areas, extent = self._find_rooms(key, floor_points, free, map_.free_cell_m, span)
            extents.append(extent)
            ids = self._room_ids.assign([(floor_id, area.outline) for area in areas])
            nodes.append(_place_node(floor_id, "B0", span, extent.outline, (Tag(f"floor {i + 1}", 1.0),)))
            floor_rooms = [FloorRoom(i, floor_id, span, grid, area) for i, area in zip(ids, areas, strict=True)]
            rooms += floor_rooms
            masks = tuple((room.id, room.area.mask) for room in floor_rooms)
            plans.append(FloorPlan(floor_id, key, span, grid, floor_points, free, masks))
        nodes += [_place_node(room.id, room.floor_id, room.span, room.area.outline) for room in rooms]
        object_rooms = assign_rooms(objects, rooms)
        nodes += self._location_and_object_nodes(rooms, object_rooms, objects, items)
        for memo in (self._room_memo, self._location_memo, self._footprint_memo):
            memo.end_build()
        nodes = _with_frames([_building_node(extents), *nodes])
        room_ids = {f"O{item.id}": room.id for item, room in zip(items, object_rooms, strict=True)}
        placed = [
            PlacedObject(node.id, room_ids[node.id], ApproachTarget(node.footprint, node.center))
            for node in nodes
            if node.id in room_ids
        ]
        places = self._places.build(map_, plans, placed)
        nodes = [replace(node, approach=places.approaches.get(node.id)) for node in nodes]
        return SceneGraph.of(nodes, places.connections, places.route_segments)

    def _find_rooms(
        self, key: bytes, points: Points, free: Points, free_cell_m: float, span: FloorSpan
    ) -> tuple[PlanGrid, list[RoomArea], _FloorExtent]:
        """Rooms of a floor and its own outline, found again only when the key of the other arguments changed."""

        def compute() -> tuple[PlanGrid, list[RoomArea], _FloorExtent]:
            extent = _FloorExtent(np.asarray(bounding_box(points), float), np.asarray(convex_footprint(points), float))
            return *find_rooms(points, free, free_cell_m, span, self._config.rooms), extent

        return self._room_memo.get(key, compute)

    def _location_and_object_nodes(
        self, rooms: list[FloorRoom], object_rooms: list[FloorRoom], objects: list[Points], items: list[MapObject]
    ) -> list[GraphNode]:
        """Locations of all rooms, then all objects; a room's are found again only when its objects changed."""
        digests = [digest(xyz) for xyz in objects]
        in_room: dict[str, list[int]] = {room.id: [] for room in rooms}
        for i, room in enumerate(object_rooms):
            in_room[room.id].append(i)
        areas = [
            (room, area) for room in rooms for area in self._find_locations(room, in_room[room.id], objects, digests)
        ]
        # all of them at once: an id goes to one place, also when a room is split
        ids = self._location_ids.assign([(room.floor_id, area.outline) for room, area in areas])
        parents = [room.id for room in object_rooms]
        nodes = []
        for location_id, (room, area) in zip(ids, areas, strict=True):
            members = [in_room[room.id][k] for k in area.members]
            for i in members:
                parents[i] = location_id
            box = bounding_box(np.concatenate([items[i].box for i in members]))
            nodes.append(_node(location_id, room.id, box, area.outline))
        for i, key in enumerate(digests):
            footprint = self._footprint_memo.get(key, partial(convex_footprint, objects[i]))
            nodes.append(_object_node(items[i], parents[i], footprint))
        return nodes

    def _find_locations(
        self, room: FloorRoom, members: list[int], objects: list[Points], digests: list[bytes]
    ) -> list[LocationArea]:
        return self._location_memo.get(
            digest(room.span.low_m, room.span.ceiling_m, *(digests[i] for i in members)),
            lambda: find_locations([objects[i] for i in members], room.span, self._config.locations, self._detector),
        )


def _check(map_: Map) -> None:
    for name in ("points_world", "free_points_world", "camera_positions_world", "object_points_world"):
        bad = np.flatnonzero(~np.isfinite(getattr(map_, name)).all(axis=1))
        if len(bad):
            raise SchemaError(f"Map {map_.revision}: {name}[{bad[0]}] is not finite")
    empty = [item.id for item in map_.objects() if not len(item.points)]
    if empty:
        raise SchemaError(f"Map {map_.revision}: object {empty[0]} has no points")


def _in_zone(xyz: Points, span: FloorSpan) -> Points:
    z = np.ascontiguousarray(xyz[:, 2])
    return xyz[(z >= span.zone_low_m) & (z <= span.zone_high_m)]


def _building_node(floors: list[_FloorExtent]) -> GraphNode:
    if not floors:
        return _node("B0", "", np.zeros((2, 3)), np.zeros((0, 2)))
    boxes = np.stack([floor.box for floor in floors])
    box = np.array([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])
    return _node("B0", "", box, convex_footprint(np.concatenate([floor.outline for floor in floors])))


def _place_node(node_id: str, parent: str, span: FloorSpan, outline: Points, tags: tuple[Tag, ...] = ()) -> GraphNode:
    box = np.array([[*outline.min(axis=0), span.low_m], [*outline.max(axis=0), span.ceiling_m]])
    return _node(node_id, parent, box, outline, tags=tags)


def _object_node(item: MapObject, parent: str, footprint: Points) -> GraphNode:
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


def _node(node_id: str, parent: str, box: Points, footprint: Points, **fields: Any) -> GraphNode:
    values: dict[str, Any] = {"tags": (), "first_frame": -1, "last_frame": -1} | fields
    return GraphNode(
        id=node_id, parent=parent, box=np.asarray(box, float), footprint=np.asarray(footprint, float), **values
    )


def _with_frames(nodes: list[GraphNode]) -> list[GraphNode]:
    """Places are seen from the first to the last frame of the objects in them; -1 where there are none."""
    parents = {node.id: node.parent for node in nodes}
    frames: dict[str, list[int]] = {}
    for node in nodes:
        ancestor = node.parent if node.layer == "object" else ""
        while ancestor:
            frames.setdefault(ancestor, []).extend((node.first_frame, node.last_frame))
            ancestor = parents[ancestor]
    return [
        replace(node, first_frame=min(frames[node.id]), last_frame=max(frames[node.id])) if node.id in frames else node
        for node in nodes
    ]
