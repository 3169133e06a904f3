"""A map moved into the world frame of its ground truth, so that the two can be compared."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from placegraph.runtime.arrays import F64, Points
from placegraph.runtime.errors import SchemaError
from placegraph.runtime.scene_graph import GraphNode, SceneGraph, Tag
from placegraph.runtime.vision.geometry import bounding_box, transform
from placegraph.tools.map_files.map_folder import OBJECTS, read_object_clouds


@dataclass(frozen=True, eq=False)
class MapObject:
    """An object of the map: its tags, strongest first, and its axis-aligned box (2, 3) in metres, true world frame."""

    id: str
    tags: tuple[Tag, ...]
    box: F64


@dataclass(frozen=True, eq=False)
class MapPlace:
    """A room or location: the index of its floor in `AlignedMap.floors`, and its outline (N, 2), true world frame."""

    id: str
    floor: int
    outline: F64


@dataclass(frozen=True, eq=False)
class AlignedMap:
    """All layers of a map; floors (F, 2) are their lowest and highest height, true world frame."""

    floors: F64
    rooms: tuple[MapPlace, ...]
    locations: tuple[MapPlace, ...]
    objects: tuple[MapObject, ...]


EMPTY_MAP = AlignedMap(np.zeros((0, 2)), (), (), ())


def align_folder(folder: Path, graph: SceneGraph, true_from_map: F64) -> AlignedMap:
    """`align_map` with the graph of a map folder and the folder's object clouds."""
    return align_map(graph, read_object_clouds(folder), true_from_map, str(folder / OBJECTS))


def align_map(graph: SceneGraph, clouds: Mapping[str, Points], true_from_map: F64, source: str) -> AlignedMap:
    """A graph and the points (N, 3) of its objects by id, moved by a rotation about z and a shift (4, 4).

    A rotated box would be too large, so the boxes are computed again from the moved clouds. Raises SchemaError, which
    names the `source` of the points, when those of an object are missing.
    """
    floors = graph.layer("floor")
    floor_index = {floor.id: i for i, floor in enumerate(floors)}
    objects = []
    for node in graph.layer("object"):
        if node.id not in clouds or not len(clouds[node.id]):
            raise SchemaError(f"{source}: no points of {node.id}, which the graph holds; of another run?")
        box = bounding_box(transform(true_from_map, clouds[node.id].astype(np.float64)))
        objects.append(MapObject(node.id, node.tags, box.astype(np.float64)))

    def places(layer: str) -> tuple[MapPlace, ...]:
        return tuple(_place(graph, floor_index, node, true_from_map) for node in graph.layer(layer))

    heights = np.array([floor.box[:, 2] for floor in floors]).reshape(-1, 2) + true_from_map[2, 3]
    return AlignedMap(heights, places("room"), places("location"), tuple(objects))


def _place(graph: SceneGraph, floor_index: dict[str, int], node: GraphNode, true_from_map: F64) -> MapPlace:
    floor_id = next(ancestor.id for ancestor in graph.path(node.id) if ancestor.layer == "floor")
    outline = node.footprint @ true_from_map[:2, :2].T + true_from_map[:2, 3]
    return MapPlace(node.id, floor_index[floor_id], np.asarray(outline))
