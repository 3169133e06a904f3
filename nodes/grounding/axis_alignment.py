"""Turn the map about z until the building's walls are parallel to the axes.

The world frame starts with the camera's first direction. In a rotated frame the axis-aligned box of a long sofa is far
too large, which spoils "next to", "against" and "in the corner". The paper compares centres and needs no such step.
"""

from __future__ import annotations

import numpy as np

from placegraph.runtime.arrays import F64
from placegraph.runtime.scene_graph import GraphNode, SceneGraph

STEP_RAD = np.radians(0.25)
SHARPNESS = 10.0  # a box 12 degrees off a direction votes for it with 0.04 of its weight
MIN_RAD = np.radians(1.0)  # less is within the error of the boxes' own directions


def building_yaw(graph: SceneGraph) -> float:
    """The walls' direction in rad, -pi/4 to pi/4, voted by the directions of long objects; 0 when there are none."""
    boxes = np.array([node.oriented_box for node in graph.layer("object") if node.oriented_box]).reshape(-1, 7)
    long = np.abs(boxes[:, 3] - boxes[:, 4])
    if not len(boxes) or long.sum() <= 0:
        return 0.0
    directions = np.arange(-np.pi / 4, np.pi / 4, STEP_RAD)
    alignment = np.cos(4 * (directions[:, None] - boxes[None, :, 6])) - 1
    best = float(directions[int((long * np.exp(SHARPNESS * alignment)).sum(axis=1).argmax())])
    return best if abs(best) >= MIN_RAD else 0.0


def rotation_z(yaw: float) -> F64:
    """(3, 3) rotation by yaw (rad) about z."""
    c, s = np.cos(yaw), np.sin(yaw)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def rotated_box(node: GraphNode, yaw: float) -> F64:
    """(2, 3) axis-aligned box of a node after a rotation by yaw (rad) about z, from its oriented box or footprint."""
    rotation = rotation_z(yaw)
    if node.oriented_box:
        center = rotation @ np.array(node.oriented_box[:3])
        reach = np.abs(rotation_z(node.oriented_box[6] + yaw)) @ np.array(node.oriented_box[3:6]) / 2
        return np.stack((center - reach, center + reach))
    outline = node.footprint
    if not len(outline):
        outline = np.array([[node.box[i, 0], node.box[j, 1]] for i in (0, 1) for j in (0, 1)])
    outline = outline @ rotation[:2, :2].T
    return np.array([[*outline.min(axis=0), node.box[0, 2]], [*outline.max(axis=0), node.box[1, 2]]])
