"""Fusion: join keyframes with their segments, keep the voxel map and the objects, and give the whole Map."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from placegraph.models_onnx.text import TextEncoder
from placegraph.nodes.fusion.instance import Instance
from placegraph.nodes.fusion.lift import LiftConfig, lift
from placegraph.nodes.fusion.objects import AssociationConfig, ObjectMap
from placegraph.nodes.fusion.voxels import FreeSpace, VoxelMap, depth_edges
from placegraph.runtime.errors import SchemaError
from placegraph.runtime.geometry import backproject, bounding_box, is_rigid, transform, yaw_box
from placegraph.runtime.join import Join
from placegraph.runtime.messages import Keyframe, LastKeyframe, Map, Message, Segments
from placegraph.runtime.node import Context, Node, NodeConfig


class FusionConfig(NodeConfig):
    """Settings of the map."""

    map_every: int = Field(default=10, ge=1)  # keyframes between maps
    voxel_m: float = Field(default=0.05, gt=0)  # METHOD section 2
    stride: int = Field(default=4, ge=1)  # every 4th pixel each way: 2 cm apart at 3 m, under half a voxel
    max_depth_m: float = Field(default=5.0, gt=0)
    edge_ratio: float = Field(default=0.05, gt=0)  # see depth_edges
    free_cell_m: float = Field(default=0.1, gt=0)  # in plan
    free_height_m: float = Field(default=0.5, gt=0)
    free_clearance_m: float = Field(default=0.15, ge=0)  # rays stop short of the surface by more than the depth noise
    min_observations: int = Field(default=3, ge=1)  # ConceptGraphs; an object seen less often is not in the Map
    lift: LiftConfig = LiftConfig()
    association: AssociationConfig = AssociationConfig()


class FusionNode(Node):
    """Keyframes and segments to Maps: one every `map_every` keyframes, and a final one."""

    config_type = FusionConfig
    takes = (Keyframe, Segments, LastKeyframe)
    gives = (Map,)
    config: FusionConfig

    def __init__(self, config: FusionConfig, context: Context) -> None:
        super().__init__(config, context)
        self._join = Join(Keyframe, Segments)
        self._voxels = VoxelMap(config.voxel_m)
        self._free = FreeSpace(config.free_cell_m, config.free_height_m, config.free_clearance_m)
        self._objects = ObjectMap(TextEncoder().encode, config.lift.voxel_m, config.association)
        self._camera_positions: list[NDArray[np.float64]] = []
        self._latest: Message | None = None  # whose frame id and stamp the next Map carries
        self._last: LastKeyframe | None = None
        self._revision = 0
        self._ended = False

    def step(self, message: Message) -> Sequence[Message]:
        """Fuse what has become complete. Raises SchemaError for a pose that is not rigid, or a keyframe too many."""
        if self._ended:
            raise SchemaError(f"fusion: {type(message).__name__} of frame {message.frame_id} after the last keyframe")
        maps: list[Message] = []
        if isinstance(message, LastKeyframe):
            self._last = message
        else:
            joined = self._join.add(message)
            if joined is None:
                return maps
            self._fuse(*joined)
            if len(self._camera_positions) % self.config.map_every == 0:
                maps.append(self._map(final=False))
        fused = -1 if self._latest is None else self._latest.frame_id
        if self._last is not None and fused >= self._last.frame_id:
            self._objects.tidy(len(self._camera_positions) - 1)
            maps.append(self._map(final=True))
            self._ended = True
        return maps

    def _fuse(self, keyframe: Message, segments: Message) -> None:
        assert isinstance(keyframe, Keyframe) and isinstance(segments, Segments)
        if not is_rigid(keyframe.world_from_camera):
            raise SchemaError(f"Keyframe {keyframe.frame_id}: world_from_camera is not a finite rigid transform")
        c = self.config
        depth_m = keyframe.depth.astype(np.float32) * np.float32(keyframe.depth_unit_m)
        edges = depth_edges(depth_m, c.edge_ratio)
        clean = np.where(edges, np.float32(0), depth_m)
        thin = clean[:: c.stride, :: c.stride]
        xyz = transform(keyframe.world_from_camera, backproject(clean, keyframe.intrinsics, c.stride))
        near = (thin <= c.max_depth_m)[thin > 0]  # in the order of backproject: row by row
        self._voxels.add(xyz[near], keyframe.color[:: c.stride, :: c.stride][thin > 0][near])
        origin = keyframe.world_from_camera[:3, 3]
        # what lies beyond the trusted range still proves that the space before it is free
        shorten = np.minimum(1.0, c.max_depth_m / thin[thin > 0])[:, None]
        self._free.carve(origin, origin + (xyz - origin) * shorten)
        seen = lift(keyframe, depth_m, edges, segments, c.lift)
        self._objects.add(seen, len(self._camera_positions), keyframe.frame_id)
        self._camera_positions.append(origin)
        self._latest = keyframe

    def _map(self, final: bool) -> Map:
        c = self.config
        stable = [i for _, i in sorted(self._objects.instances.items()) if i.observations >= c.min_observations]
        source = self._latest or self._last
        assert source is not None
        revision, self._revision = self._revision, self._revision + 1
        return Map(
            frame_id=source.frame_id,
            stamp_ns=source.stamp_ns,
            revision=revision,
            final=final,
            keyframes=len(self._camera_positions),
            voxel_m=c.voxel_m,
            points_world=self._voxels.points(),
            point_colors=self._voxels.colors(),
            free_cell_m=c.free_cell_m,
            free_points_world=self._free.points(),
            camera_positions_world=np.array(self._camera_positions, np.float32).reshape(-1, 3),
            **_object_fields(stable, c.lift),
        )


def _object_fields(stable: list[Instance], lift_config: LiftConfig) -> dict[str, Any]:
    solid = [i.solid(lift_config.cluster_eps_m, lift_config.cluster_min_points) for i in stable]
    points = [xyz for xyz, _ in solid]
    tags = [i.tags() for i in stable]
    return {
        "object_ids": np.array([i.number for i in stable], np.int64),
        "object_boxes_world": np.array([bounding_box(xyz) for xyz in points], np.float32).reshape(-1, 2, 3),
        "object_oriented_boxes": np.array([yaw_box(xyz) for xyz in points], np.float32).reshape(-1, 7),
        "object_colors": np.array([color for _, color in solid], np.uint8).reshape(-1, 3),
        "object_observations": np.array([i.observations for i in stable], np.int64),
        "object_first_frames": np.array([i.first_frame for i in stable], np.int64),
        "object_last_frames": np.array([i.last_frame for i in stable], np.int64),
        "object_points_world": np.concatenate([*points, np.zeros((0, 3), np.float32)]),
        "object_point_offsets": np.cumsum([0, *(len(xyz) for xyz in points)], dtype=np.int64),
        "tag_names": tuple(name for votes in tags for name, _ in votes),
        "tag_votes": np.array([vote for votes in tags for _, vote in votes], np.float32),
        "tag_offsets": np.cumsum([0, *(len(votes) for votes in tags)], dtype=np.int64),
    }


NODE = FusionNode
