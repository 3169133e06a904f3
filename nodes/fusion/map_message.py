"""The objects of a Map message: those that are there and those that are gone."""

from __future__ import annotations

from collections.abc import Callable

from placegraph.nodes.fusion.mask_lifting import LiftConfig
from placegraph.nodes.fusion.object_association import ObjectMap, Retired
from placegraph.nodes.fusion.object_instance import Instance, Solid
from placegraph.runtime.messages import MapObject, RetiredObject


def map_objects(
    objects: ObjectMap, is_stable: Callable[[Instance], bool], lift: LiftConfig
) -> tuple[list[MapObject], list[RetiredObject]]:
    """The stable objects of a map and the stable ones that are gone, by id."""
    present = [instance for _, instance in sorted(objects.instances.items()) if is_stable(instance)]
    gone = [retired for _, retired in sorted(objects.retired.items()) if is_stable(retired.instance)]
    return [_map_object(instance, lift) for instance in present], [_retired_object(retired, lift) for retired in gone]


def _map_object(instance: Instance, lift: LiftConfig) -> MapObject:
    solid = _solid(instance, lift)
    return MapObject(
        id=instance.number,
        box=solid.box,
        oriented_box=solid.oriented_box,
        color=solid.color,
        observations=instance.observations,
        first_frame=instance.first_frame,
        last_frame=instance.last_frame,
        points=solid.points,
        tags=tuple(instance.tags()),
    )


def _retired_object(retired: Retired, lift: LiftConfig) -> RetiredObject:
    instance = retired.instance
    return RetiredObject(
        id=instance.number,
        box=_solid(instance, lift).box,
        last_frame=instance.last_frame,
        gone_frame=retired.gone_frame,
        tags=tuple(instance.tags()),
    )


def _solid(instance: Instance, lift: LiftConfig) -> Solid:
    return instance.solid(lift.cluster_eps_m, lift.cluster_min_points)
