"""What fusion tells of its objects: the fields of a Map, of those that are there and of those that have gone."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from placegraph.nodes.fusion.mask_lifting import LiftConfig
from placegraph.nodes.fusion.object_association import ObjectMap
from placegraph.nodes.fusion.object_instance import Instance, Solid


def object_fields(objects: ObjectMap, is_stable: Callable[[Instance], bool], lift: LiftConfig) -> dict[str, Any]:
    """The fields of all objects that are believed in, by id."""
    gone = [one for _, one in sorted(objects.retired.items()) if is_stable(one.instance)]
    present = [one for _, one in sorted(objects.instances.items()) if is_stable(one)]
    return _present(present, lift) | {
        "retired_ids": np.array([one.instance.number for one in gone], np.int64),
        "retired_boxes_world": np.array([_solid(one.instance, lift).box for one in gone], np.float32).reshape(-1, 2, 3),
        "retired_last_frames": np.array([one.instance.last_frame for one in gone], np.int64),
        "retired_gone_frames": np.array([one.gone_frame for one in gone], np.int64),
        **{f"retired_{name}": value for name, value in _tags([one.instance for one in gone]).items()},
    }


def _solid(instance: Instance, lift: LiftConfig) -> Solid:
    return instance.solid(lift.cluster_eps_m, lift.cluster_min_points)


def _present(stable: list[Instance], lift: LiftConfig) -> dict[str, Any]:
    solid = [_solid(one, lift) for one in stable]
    return {
        "object_ids": np.array([one.number for one in stable], np.int64),
        "object_boxes_world": np.array([one.box for one in solid], np.float32).reshape(-1, 2, 3),
        "object_oriented_boxes": np.array([one.oriented_box for one in solid], np.float32).reshape(-1, 7),
        "object_colors": np.array([one.color for one in solid], np.uint8).reshape(-1, 3),
        "object_observations": np.array([one.observations for one in stable], np.int64),
        "object_first_frames": np.array([one.first_frame for one in stable], np.int64),
        "object_last_frames": np.array([one.last_frame for one in stable], np.int64),
        "object_points_world": np.concatenate([*(one.points for one in solid), np.zeros((0, 3), np.float32)]),
        "object_point_offsets": np.cumsum([0, *(len(one.points) for one in solid)], dtype=np.int64),
        **_tags(stable),
    }


def _tags(instances: list[Instance]) -> dict[str, Any]:
    tags = [one.tags() for one in instances]
    return {
        "tag_names": tuple(name for votes in tags for name, _ in votes),
        "tag_votes": np.array([vote for votes in tags for _, vote in votes], np.float32),
        "tag_offsets": np.cumsum([0, *(len(votes) for votes in tags)], dtype=np.int64),
    }
