"""A Map to the nodes of a scene graph: floors, their rooms, the rooms' locations, and the objects in them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel

from placegraph.models_onnx import LocationDetector
from placegraph.nodes.hierarchy.approach import Target
from placegraph.nodes.hierarchy.connections import FloorPlan, PlacedObject, PlaceGraph, PlaceGraphBuilder
from placegraph.nodes.hierarchy.floors import FloorConfig, FloorSpan, find_floors
from placegraph.nodes.hierarchy.ground import TravelConfig
from placegraph.nodes.hierarchy.identity import Identities, Place, span_footprint
from placegraph.nodes.hierarchy.locations import LocationConfig, find_locations
from placegraph.nodes.hierarchy.rooms import Grid, RoomArea, RoomConfig, find_rooms
from placegraph.runtime.errors import SchemaError
from placegraph.runtime.geometry import bounding_box, convex_footprint
from placegraph.runtime.messages import Map
from placegraph.runtime.scene_graph import Node, SceneGraph, Tag

F64 = NDArray[np.float64]
Points = NDArray[np.floating]


class LayerConfig(BaseModel, frozen=True, strict=True, extra="forbid"):
    """Parameters of all layers."""

    floors: FloorConfig = FloorConfig()
    rooms: RoomConfig = RoomConfig()
    locations: LocationConfig = LocationConfig()
    travel: TravelConfig = TravelConfig()


@dataclass(frozen=True, eq=False)
class _Room:
    id: str
    floor: str
    span: FloorSpan
    grid: Grid
    area: RoomArea


class GraphBuilder:
    """Builds a graph from each Map and remembers which place has which id."""

    def __init__(self, config: LayerConfig, detector: LocationDetector | None = None) -> None:
        """`detector` is the network that config.locations.model names; None where it names none."""
        self._config, self._detector = config, detector
        self._floors, self._rooms, self._locations = Identities("F"), Identities("R"), Identities("L")
        self._places = PlaceGraphBuilder(config.travel, config.floors, config.rooms)

    def build(self, world: Map) -> SceneGraph:
        """The graph of a Map; rooms and locations are without names. Deterministic in the sequence of maps.

        Raises SchemaError for points that are not finite and objects without points.
        """
        _check(world)
        objects = np.split(world.object_points_world, world.object_point_offsets[1:-1]) if len(world.object_ids) else []
        spans = find_floors(world.points_world, world.camera_positions_world, self._config.floors)
        if not spans and objects:  # objects without a cloud: the floor is what they stand on
            spans = find_floors(world.object_points_world, world.camera_positions_world, self._config.floors)
        points = world.points_world if len(world.points_world) else world.object_points_world
        floor_ids = self._floors.assign([Place(span_footprint(s.low, max(s.high, s.low + 0.1))) for s in spans])
        nodes = [_building(points)]
        rooms: list[_Room] = []
        for i, (span, floor_id) in enumerate(zip(spans, floor_ids, strict=True)):
            inside = _in_zone(points, span)
            nodes.append(_place(floor_id, "B0", span, convex_footprint(inside), (Tag(f"floor {i + 1}", 1.0),)))
            rooms += self._find_rooms(
                inside, _in_zone(world.free_points_world, span), world.free_cell_m, span, floor_id
            )
        nodes += [_place(room.id, room.floor, room.span, room.area.outline) for room in rooms]
        home = [_home(xyz, rooms) for xyz in objects]
        for room in rooms:
            nodes += self._fill(room, [i for i, at in enumerate(home) if at is room], objects, world)
        nodes = _with_frames(nodes)
        placed = _placed(nodes, {f"O{number}": room.id for number, room in zip(world.object_ids, home, strict=True)})
        places = self._connect(world, list(zip(spans, floor_ids, strict=True)), rooms, placed)
        nodes = [replace(node, approach=places.approaches.get(node.id)) for node in nodes]
        return SceneGraph.of(nodes, places.connections, places.ways)

    def _connect(
        self, world: Map, floors: list[tuple[FloorSpan, str]], rooms: list[_Room], objects: list[PlacedObject]
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
        self, points: Points, free_points: Points, free_cell_m: float, span: FloorSpan, floor_id: str
    ) -> list[_Room]:
        grid, areas = find_rooms(points, free_points, free_cell_m, span, self._config.rooms)
        ids = self._rooms.assign([Place(area.outline, floor_id) for area in areas])
        return [_Room(i, floor_id, span, grid, area) for i, area in zip(ids, areas, strict=True)]

    def _fill(self, room: _Room, members: list[int], objects: list[Points], world: Map) -> list[Node]:
        mine = [objects[i] for i in members]
        areas = find_locations(mine, room.span, self._config.locations, self._detector)
        ids = self._locations.assign([Place(area.outline, room.floor) for area in areas])
        parent = dict.fromkeys(members, room.id)
        nodes = []
        for location_id, area in zip(ids, areas, strict=True):
            held = [members[k] for k in area.members]
            parent.update(dict.fromkeys(held, location_id))
            box = bounding_box(world.object_boxes_world[held].reshape(-1, 3))
            nodes.append(_node(location_id, room.id, box, area.outline))
        return nodes + [_object(i, parent[i], objects[i], world) for i in members]


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
    empty = np.flatnonzero(np.diff(world.object_point_offsets) <= 0)
    if len(empty):
        raise SchemaError(f"Map {world.revision}: object {world.object_ids[empty[0]]} has no points")


def _in_zone(xyz: Points, span: FloorSpan) -> Points:
    return xyz[(xyz[:, 2] >= span.zone_low) & (xyz[:, 2] <= span.zone_high)]


def _home(xyz: Points, rooms: list[_Room]) -> _Room:
    """The room that holds most of an object's points; without any, the nearest one of its floor."""
    middle = xyz.mean(axis=0)
    # the zones of floors meet with a small gap, and an object may reach over it: its middle decides
    distance = [max(room.span.zone_low - middle[2], middle[2] - room.span.zone_high, 0.0) for room in rooms]
    floor = rooms[int(np.argmin(distance))].floor
    here = [room for room in rooms if room.floor == floor]
    counts = [int(room.area.mask[room.grid.cells(xyz)].sum()) for room in here]
    if max(counts) > 0:
        return here[int(np.argmax(counts))]

    def gap(room: _Room) -> float:
        rows, columns = np.nonzero(room.area.mask)
        cells = room.grid.origin + (np.stack((columns, rows), axis=1) + 0.5) * room.grid.cell_m
        return float(np.linalg.norm(cells - middle[:2], axis=1).min())

    return min(here, key=gap)


def _building(points: Points) -> Node:
    if not len(points):
        return _node("B0", "", np.zeros((2, 3)), np.zeros((0, 2)))
    return _node("B0", "", bounding_box(points), convex_footprint(points))


def _place(node_id: str, parent: str, span: FloorSpan, outline: Points, tags: tuple[Tag, ...] = ()) -> Node:
    box = np.array([[*outline.min(axis=0), span.low], [*outline.max(axis=0), span.high]])
    return _node(node_id, parent, box, outline, tags=tags)


def _object(i: int, parent: str, xyz: Points, world: Map) -> Node:
    votes = slice(int(world.tag_offsets[i]), int(world.tag_offsets[i + 1]))
    names, weights = world.tag_names[votes], world.tag_votes[votes].tolist()
    return _node(
        f"O{int(world.object_ids[i])}",
        parent,
        world.object_boxes_world[i],
        convex_footprint(xyz),
        tags=tuple(Tag(name, weight) for name, weight in zip(names, weights, strict=True)),
        first_frame=int(world.object_first_frames[i]),
        last_frame=int(world.object_last_frames[i]),
        observations=int(world.object_observations[i]),
        oriented_box=tuple(world.object_oriented_boxes[i].tolist()),
        color=tuple(world.object_colors[i].tolist()),
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
