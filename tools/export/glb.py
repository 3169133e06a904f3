"""A GLB scene for 3D viewers: the cloud, fences of rooms and locations, boxes of objects, named by id and tag."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from placegraph.runtime.errors import ConfigError
from placegraph.runtime.scene_graph import GraphNode, SceneGraph
from placegraph.tools.map_files.map_folder import read_cloud

Y_UP = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])  # glTF's up is +y, ours +z
ALPHA = 110  # of 255: the cloud shows through the boxes
FENCES = {"room": (0.4, (74, 72, 78)), "location": (0.1, (122, 143, 176))}  # height in metres, sRGB


def write(folder: Path, graph: SceneGraph, out: Path) -> list[Path]:
    """Write the file. Raises ConfigError without the extra `export`, SchemaError when the folder holds no cloud."""
    try:
        import trimesh
    except ImportError:
        raise ConfigError("export glb: needs trimesh: pip install 'placegraph[export]'") from None
    xyz, rgb = read_cloud(folder)
    scene = trimesh.Scene()
    scene.add_geometry(trimesh.PointCloud(xyz, colors=rgb), node_name="cloud", geom_name="cloud")

    def add(node: GraphNode, mesh: Any, color: tuple[int, ...]) -> None:
        mesh.visual.face_colors = [*color, ALPHA]
        name = f"{node.id} {node.name}"
        scene.add_geometry(mesh, node_name=name, geom_name=name)

    for layer, (height, color) in FENCES.items():
        for place in graph.layer(layer):
            vertices, faces = _fence(place, height)
            add(place, trimesh.Trimesh(vertices, faces, process=False), color)
    for thing in graph.layer("object"):
        size, pose = _placed(thing)
        add(thing, trimesh.creation.box(np.maximum(size, 0.01), pose), thing.color or (128, 128, 128))
    scene.apply_transform(Y_UP)
    out.write_bytes(scene.export(file_type="glb"))
    return [out]


def _fence(place: GraphNode, height: float) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (2 K, 3) and triangles (4 K, 3) of a strip along a place's outline, seen from both sides."""
    count = len(place.footprint)
    feet = np.column_stack((place.footprint, np.full(count, place.box[0, 2])))
    start, end = np.arange(count), np.roll(np.arange(count), -1)
    faces = np.concatenate(
        (np.column_stack((start, end, end + count)), np.column_stack((start, end + count, start + count)))
    )
    return np.concatenate((feet, feet + np.array([0, 0, height]))), np.concatenate((faces, faces[:, ::-1]))


def _placed(thing: GraphNode) -> tuple[np.ndarray, np.ndarray]:
    """Size (3,) and pose (4, 4) of an object's box, turned about z."""
    center, size, yaw = thing.turned_box[:3], thing.turned_box[3:6], thing.turned_box[6]
    pose = np.eye(4)
    pose[:3, 3] = center
    pose[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
    return np.array(size), pose
