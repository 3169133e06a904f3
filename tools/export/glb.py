"""A GLB scene for 3D viewers: the coloured cloud, and a box for each object, named by its id and tag."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from placegraph.runtime.errors import ConfigError
from placegraph.runtime.scene_graph import Node, SceneGraph
from placegraph.tools.map_folder import read_cloud

Y_UP = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])  # glTF's up is +y, ours +z
ALPHA = 110  # of 255: the cloud shows through the boxes


def write(folder: Path, graph: SceneGraph, out: Path) -> list[Path]:
    """Write the file. Raises ConfigError without the extra `export`, SchemaError when the folder holds no cloud."""
    try:
        import trimesh
    except ImportError:
        raise ConfigError("export glb: needs trimesh: pip install 'placegraph[export]'") from None
    xyz, rgb = read_cloud(folder)
    scene = trimesh.Scene()
    scene.add_geometry(trimesh.PointCloud(xyz, colors=rgb), node_name="cloud", geom_name="cloud")
    for thing in graph.layer("object"):
        size, pose = _placed(thing)
        box = trimesh.creation.box(np.maximum(size, 0.01), pose)
        box.visual.face_colors = [*(thing.color or (128, 128, 128)), ALPHA]
        name = f"{thing.id} {thing.name}"
        scene.add_geometry(box, node_name=name, geom_name=name)
    scene.apply_transform(Y_UP)
    out.write_bytes(scene.export(file_type="glb"))
    return [out]


def _placed(thing: Node) -> tuple[np.ndarray, np.ndarray]:
    """Size (3,) and pose (4, 4) of an object's box, turned about z."""
    centre, size, yaw = thing.turned_box[:3], thing.turned_box[3:6], thing.turned_box[6]
    pose = np.eye(4)
    pose[:3, 3] = centre
    pose[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
    return np.array(size), pose
