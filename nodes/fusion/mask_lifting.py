"""Lift masks to 3D: the voxels that one view shows of one object.

Source: paper, object layer. Not as in the paper: masks are eroded and lose depth edges before they are lifted, since
edge points inflate boxes, and the mask of an object that lies on another is cut out of the larger one, since otherwise
a table swallows the cup on it.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from pydantic import BaseModel

from placegraph.nodes.fusion.voxel_index import sum_by_key, voxel_keys
from placegraph.runtime.arrays import F32, F64, I32, I64, Bool
from placegraph.runtime.errors import SchemaError
from placegraph.runtime.messages import Keyframe, Segments
from placegraph.runtime.vision.clustering import main_clusters
from placegraph.runtime.vision.geometry import bounding_box, transform


class LiftConfig(BaseModel, frozen=True, strict=True, extra="forbid"):
    """How a mask becomes points."""

    voxel_m: float = 0.025  # ConceptGraphs, HOV-SG
    max_depth_m: float = 5.0  # beyond, stereo and structured light err by more than a cup
    cluster_eps_m: float = 0.075  # ConceptGraphs: .05-.1
    cluster_min_points: int = 10  # ConceptGraphs
    # Not as in ConceptGraphs and HOV-SG: they keep the largest cluster only, which loses the legs of chairs, the poles
    # of lamps, and one half of whatever something stands before. What leaks onto the background is removed later, see
    # MIN_MASK_SHARE.
    cluster_share: float = 0.15
    depth_gap_m: float = 0.5  # chosen by hand: further from the mask's median depth lies another surface
    min_points: int = 8  # chosen by hand: a cup 4 m away still leaves about ten voxels
    erode_share: float = 0.03  # of the mask's shorter side, at least one pixel; chosen by hand
    erode_max_px: int = 4
    inside_share: float = 0.8  # ConceptGraphs subtracts contained boxes likewise


@dataclass(frozen=True, eq=False)
class Observation:
    """One view of one object."""

    name: str
    score: float
    keys: I64  # (N,) voxel keys, sorted
    values: F64  # (N, 8) of each voxel: sums of x y z (m, world) and r g b over its pixels, their count, and 1 (a view)
    points: F64  # (N, 3) centroids, metres, world
    box: F32  # (2, 3)


def exclusive_masks(boxes_px: I32, masks: list[Bool], inside_share: float) -> list[Bool]:
    """Cut the masks of smaller objects out of the mask they lie on.

    A mask is cut out if at least `inside_share` of it lies in the other and it has less than half the other's area.
    boxes_px: (N, 4) whole-pixel boxes, max exclusive; masks: box-sized. Returns new masks of the same sizes.
    """
    areas = [int(mask.sum()) for mask in masks]
    cut_masks = [mask.copy() for mask in masks]
    for i, (x0, y0, x1, y1) in enumerate(boxes_px.tolist()):
        for j, (u0, v0, u1, v1) in enumerate(boxes_px.tolist()):
            left, top, right, bottom = max(x0, u0), max(y0, v0), min(x1, u1), min(y1, v1)
            if i == j or 2 * areas[j] >= areas[i] or left >= right or top >= bottom:
                continue
            shared = (slice(top - y0, bottom - y0), slice(left - x0, right - x0))
            small = masks[j][top - v0 : bottom - v0, left - u0 : right - u0]
            if (masks[i][shared] & small).sum() >= inside_share * areas[j]:
                cut_masks[i][shared] &= ~small
    return cut_masks


def lift_masks(
    keyframe: Keyframe, depth_m: F32, edges: Bool, segments: Segments, config: LiftConfig
) -> list[Observation]:
    """Lift every mask of a keyframe, strongest detection first; masks that leave too few points are left out.

    depth_m: (H, W) metres, 0 = no reading; edges: (H, W) bool from `depth_edges`.
    Raises SchemaError for boxes outside the image.
    """
    height, width = depth_m.shape
    boxes = segments.boxes_px
    inside = (boxes[:, :2] >= 0).all(axis=1) & (boxes[:, 2] <= width) & (boxes[:, 3] <= height)
    bad = np.flatnonzero(~(inside & (boxes[:, :2] < boxes[:, 2:]).all(axis=1)))
    if len(bad):
        raise SchemaError(
            f"Segments of frame {segments.frame_id}: box {boxes[bad[0]].tolist()} is empty or outside {width}x{height}"
        )
    usable = (depth_m > 0) & (depth_m <= config.max_depth_m) & ~edges
    masks = exclusive_masks(boxes, list(segments.masks()), config.inside_share)
    observations = []
    for i in np.argsort(-segments.scores, kind="stable"):
        x0, y0, x1, y1 = boxes[i].tolist()
        mask = _erode(masks[i], config) & usable[y0:y1, x0:x1]
        voxels = _lift_mask(keyframe, depth_m, mask, (x0, y0), config)
        if voxels is not None:
            keys, values = voxels
            points = values[:, :3] / values[:, 6:7]
            name, score = segments.names[i], float(segments.scores[i])
            observations.append(Observation(name, score, keys, values, points, bounding_box(points)))
    return observations


def _erode(mask: Bool, config: LiftConfig) -> Bool:
    side = int(np.clip(round(config.erode_share * min(mask.shape)), 1, config.erode_max_px))
    kernel = np.ones((2 * side + 1, 2 * side + 1), np.uint8)
    return np.asarray(cv2.erode(mask.view(np.uint8), kernel, borderType=cv2.BORDER_CONSTANT, borderValue=0), bool)


def _lift_mask(
    keyframe: Keyframe, depth_m: F32, mask: Bool, corner: tuple[int, int], config: LiftConfig
) -> tuple[I64, F64] | None:
    v, u = np.nonzero(mask)
    if len(v) < config.min_points:
        return None
    fx, fy, cx, cy = keyframe.intrinsics
    v, u = v + corner[1], u + corner[0]
    # near objects have far more pixels than voxels: keep about two pixels a voxel each way
    stride = int(np.clip(config.voxel_m / 2 * fx / np.median(depth_m[v, u]), 1, 8))
    kept = (v % stride == 0) & (u % stride == 0)
    v, u = v[kept], u[kept]
    z = depth_m[v, u].astype(float)
    xyz = transform(keyframe.world_from_camera, np.stack(((u - cx) / fx * z, (v - cy) / fy * z, z), axis=1))
    values = np.concatenate((xyz, keyframe.color[v, u], np.ones((len(xyz), 2))), axis=1)
    keys, values = sum_by_key(voxel_keys(xyz, config.voxel_m), values)
    values[:, 7] = 1
    # a handful of voxels cannot have ten neighbours each
    min_points = min(config.cluster_min_points, max(3, len(keys) // 3))
    points = values[:, :3] / values[:, 6:7]
    cluster = main_clusters(points, config.cluster_eps_m, min_points, config.cluster_share)
    cluster = cluster[_near_median_depth(points[cluster], keyframe.world_from_camera, config)]
    if len(cluster) < config.min_points:
        return None
    return keys[cluster], values[cluster]


def _near_median_depth(points: F64, world_from_camera: F64, config: LiftConfig) -> Bool:
    """Mask (N,) of the points (N, 3) whose depth differs from the median by less than an object may reach."""
    depth = (points - world_from_camera[:3, 3]) @ world_from_camera[:3, 2]
    median = float(np.median(depth)) if len(depth) else 0.0
    spread = float(np.median(np.abs(depth - median))) if len(depth) else 0.0
    return np.asarray(np.abs(depth - median) <= config.depth_gap_m + 3 * spread)
