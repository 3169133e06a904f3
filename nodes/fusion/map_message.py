"""The objects of a Map message: those that are there and those that are gone."""

from __future__ import annotations

from collections.abc import Callable

from placegraph.nodes.fusion.mask_lifting import LiftConfig
from placegraph.nodes.fusion.object_association import ObjectMap, RetiredInstance
from placegraph.nodes.fusion.object_instance import ObjectGeometry, ObjectInstance
from placegraph.runtime.messages import MapObject, RetiredObject


def map_objects(
    objects: ObjectMap, is_stable: Callable[[ObjectInstance], bool], config: LiftConfig
) -> tuple[list[MapObject], list[RetiredObject]]:
    """The stable objects of a map and the stable ones that are gone, by id."""
    present = [instance for _, instance in sorted(objects.instances.items()) if is_stable(instance)]
    retired = [item for _, item in sorted(objects.retired.items()) if is_stable(item.instance)]
    return [_map_object(instance, config) for instance in present], [_retired_object(item, config) for item in retired]


def _map_object(instance: ObjectInstance, config: LiftConfig) -> MapObject:
    geometry = _geometry(instance, config)
    return MapObject(
        id=instance.object_id,
        box=geometry.box,
        oriented_box=geometry.oriented_box,
        color=geometry.color,
        observations=instance.observations,
        first_frame=instance.first_frame,
        last_frame=instance.last_frame,
        points=geometry.points,
        tags=tuple(instance.ranked_votes()),
    )


def _retired_object(retired: RetiredInstance, config: LiftConfig) -> RetiredObject:
    instance = retired.instance
    return RetiredObject(
        id=instance.object_id,
        box=_geometry(instance, config).box,
        last_frame=instance.last_frame,
        gone_frame=retired.gone_frame,
        tags=tuple(instance.ranked_votes()),
    )


def _geometry(instance: ObjectInstance, config: LiftConfig) -> ObjectGeometry:
    return instance.geometry(config.cluster_eps_m, config.cluster_min_points)
