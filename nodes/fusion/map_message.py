"""The fields of a Map that describe objects: those that are there, and those that are gone."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from placegraph.nodes.fusion.mask_lifting import LiftConfig
from placegraph.nodes.fusion.object_association import ObjectMap
from placegraph.nodes.fusion.object_instance import ObjectGeometry, ObjectInstance


def object_fields(
    objects: ObjectMap, is_stable: Callable[[ObjectInstance], bool], config: LiftConfig
) -> dict[str, Any]:
    """The fields of all stable objects, ordered by id."""
    retired = [retired for _, retired in sorted(objects.retired.items()) if is_stable(retired.instance)]
    present = [instance for _, instance in sorted(objects.instances.items()) if is_stable(instance)]
    retired_boxes = [_geometry(item.instance, config).box for item in retired]
    return _present_fields(present, config) | {
        "retired_ids": np.array([item.instance.object_id for item in retired], np.int64),
        "retired_boxes_world": np.array(retired_boxes, np.float32).reshape(-1, 2, 3),
        "retired_last_frames": np.array([item.instance.last_frame for item in retired], np.int64),
        "retired_gone_frames": np.array([item.gone_frame for item in retired], np.int64),
        **{f"retired_{name}": value for name, value in _tag_fields([item.instance for item in retired]).items()},
    }


def _geometry(instance: ObjectInstance, config: LiftConfig) -> ObjectGeometry:
    return instance.geometry(config.cluster_eps_m, config.cluster_min_points)


def _present_fields(instances: list[ObjectInstance], config: LiftConfig) -> dict[str, Any]:
    geometries = [_geometry(instance, config) for instance in instances]
    points = [geometry.points for geometry in geometries]
    return {
        "object_ids": np.array([instance.object_id for instance in instances], np.int64),
        "object_boxes_world": np.array([item.box for item in geometries], np.float32).reshape(-1, 2, 3),
        "object_oriented_boxes": np.array([item.oriented_box for item in geometries], np.float32).reshape(-1, 7),
        "object_colors": np.array([item.color for item in geometries], np.uint8).reshape(-1, 3),
        "object_observations": np.array([instance.observations for instance in instances], np.int64),
        "object_first_frames": np.array([instance.first_frame for instance in instances], np.int64),
        "object_last_frames": np.array([instance.last_frame for instance in instances], np.int64),
        "object_points_world": np.concatenate([*points, np.zeros((0, 3), np.float32)]),
        "object_point_offsets": np.cumsum([0, *map(len, points)], dtype=np.int64),
        **_tag_fields(instances),
    }


def _tag_fields(instances: list[ObjectInstance]) -> dict[str, Any]:
    votes = [instance.ranked_votes() for instance in instances]
    return {
        "tag_names": tuple(name for ranked in votes for name, _ in ranked),
        "tag_votes": np.array([score for ranked in votes for _, score in ranked], np.float32),
        "tag_offsets": np.cumsum([0, *map(len, votes)], dtype=np.int64),
    }
