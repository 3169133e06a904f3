"""Fusion: join keyframes with their segments, keep the voxel map and the objects, and give the whole Map."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from pydantic import Field

from placegraph.models_onnx.text_encoder import TextEncoder
from placegraph.nodes.fusion.map_message import map_objects
from placegraph.nodes.fusion.mask_lifting import LiftConfig, lift
from placegraph.nodes.fusion.object_association import AssociationConfig, Moment, ObjectMap
from placegraph.nodes.fusion.object_cloud import Ground
from placegraph.nodes.fusion.object_instance import Instance
from placegraph.nodes.fusion.submaps import SubmapConfig, Submaps
from placegraph.nodes.fusion.visibility import Sight, SightConfig
from placegraph.nodes.fusion.voxel_map import FreeSpace, VoxelMap, depth_edges
from placegraph.runtime.arrays import F32
from placegraph.runtime.errors import SchemaError
from placegraph.runtime.messages import Correction, Keyframe, LastKeyframe, Map, Message, Segments, pack_objects
from placegraph.runtime.messages.synchronizer import FrameSynchronizer
from placegraph.runtime.node import Context, Node, NodeConfig
from placegraph.runtime.vision.geometry import backproject, is_rigid, transform


class FusionConfig(NodeConfig):
    """Settings of the map."""

    map_every: int = Field(default=10, ge=1)  # keyframes between maps, at least
    map_share: float = Field(default=0.05, ge=0)  # ... and of all keyframes: what maps cost stays in proportion
    voxel_m: float = Field(default=0.05, gt=0)  # METHOD section 2
    stride: int = Field(default=4, ge=1)  # every 4th pixel each way: 2 cm apart at 3 m, under half a voxel
    max_depth_m: float = Field(default=5.0, gt=0)
    edge_ratio: float = Field(default=0.05, gt=0)  # see depth_edges
    free_cell_m: float = Field(default=0.1, gt=0)  # in plan
    free_height_m: float = Field(default=0.5, gt=0)
    free_clearance_m: float = Field(default=0.15, ge=0)  # rays stop short of the surface by more than the depth noise
    min_observations: int = Field(default=3, ge=1)  # ConceptGraphs; an object seen less often is not in the Map
    # departs: of the keyframes that showed an object, those that must have recognised it. Of house 9002's 156 objects
    # 18 have less, 17 of them wrong
    recognised_share: float = Field(default=0.5, ge=0, le=1)
    # of its strongest name, in the mean of the views that recognised it: scores are the detector's, so it is for a
    # dataflow to say from where on they are to be believed
    min_score: float = Field(default=0.0, ge=0, le=1)
    lift: LiftConfig = LiftConfig()
    association: AssociationConfig = AssociationConfig()
    sight: SightConfig = SightConfig()
    submap: SubmapConfig = SubmapConfig()


class FusionNode(Node):
    """Keyframes and segments to Maps: one every `map_every` keyframes, rarer in a long run, and a final one.

    Where a pose graph gives Corrections, keyframes are fused where it puts them, and the map moves when it does.
    """

    config_type = FusionConfig
    inputs: tuple[type[Message], ...] = (Keyframe, Segments, Correction, LastKeyframe)
    optional = (Correction,)
    outputs = (Map,)
    config: FusionConfig

    def __init__(self, config: FusionConfig, context: Context) -> None:
        super().__init__(config, context)
        moves = Correction.__name__ in context.produced_kinds
        self.inputs = tuple(kind for kind in type(self).inputs if moves or kind is not Correction)
        self._synchronizer = FrameSynchronizer(*(kind for kind in self.inputs if kind is not LastKeyframe))
        self._submaps = Submaps(config.submap)
        self._voxels = VoxelMap(config.voxel_m, moves)
        self._free = FreeSpace(config.free_cell_m, config.free_height_m, config.free_clearance_m, moves)
        ground = Ground(config.lift.voxel_m, self._submaps.world_from_fused if moves else None)
        self._objects = ObjectMap(TextEncoder().encode, ground, config.association)
        self._moves: list[Correction] = []  # that are not followed yet, in order
        self._latest: Message | None = None  # whose frame id and stamp the next Map carries
        self._last: LastKeyframe | None = None
        self._revision = 0
        self._next_map = config.map_every  # keyframes from the start to the next Map
        self._ended = False

    def step(self, message: Message) -> Sequence[Message]:
        """Fuse what has become complete. Raises SchemaError for a pose that is not rigid, or a keyframe too many."""
        if self._ended:
            raise SchemaError(f"fusion: {type(message).__name__} of frame {message.frame_id} after the last keyframe")
        maps: list[Message] = []
        if isinstance(message, LastKeyframe):
            self._last = message
        else:
            if isinstance(message, Correction) and len(message.moved_frame_ids):
                self._moves.append(message)
            joined = self._synchronizer.add(message)
            if joined is None:
                return maps
            self._fuse(*joined)
            if len(self._submaps) >= self._next_map:
                maps.append(self._map(final=False))
        fused = -1 if self._latest is None else self._latest.frame_id
        if self._last is not None and fused >= self._last.frame_id:
            self._objects.tidy(len(self._submaps) - 1)
            maps.append(self._map(final=True))
            self._ended = True
        return maps

    def _fuse(self, keyframe: Message, segments: Message, correction: Message | None = None) -> None:
        assert isinstance(keyframe, Keyframe) and isinstance(segments, Segments)
        if isinstance(correction, Correction):
            self._move_up_to(correction.frame_id)
            keyframe = replace(keyframe, world_from_camera=correction.world_from_camera)
        pose = keyframe.world_from_camera
        if not is_rigid(pose):
            raise SchemaError(f"Keyframe {keyframe.frame_id}: world_from_camera is not a finite rigid transform")
        depth_m = keyframe.depth_m
        edges = depth_edges(depth_m, self.config.edge_ratio)
        sight = Sight(depth_m, edges, keyframe.intrinsics, pose, self.config.sight)
        self._voxels.look(sight)
        self._objects.look(sight)
        moment = Moment(len(self._submaps), keyframe.frame_id, self._submaps.enter(keyframe.frame_id, pose))
        self._add_cloud(keyframe, np.where(edges, np.float32(0), depth_m), moment.submap)
        self._objects.add(lift(keyframe, depth_m, edges, segments, self.config.lift), moment)
        self._objects.retire(self.config.sight.views, keyframe.frame_id)
        self._latest = keyframe

    def _move_up_to(self, frame_id: int) -> None:
        """Follow all moves so far, also those told with a keyframe whose segments were lost with a process (live)."""
        due = [one for one in self._moves if one.frame_id <= frame_id]
        self._moves = self._moves[len(due) :]
        for correction in due:
            self._move(correction)

    def _move(self, correction: Correction) -> None:
        moves = self._submaps.move(correction)
        for layer in (self._voxels, self._free):
            for submap, world_from_fused in moves.items():
                layer.move(submap, world_from_fused)
        if moves:
            self._objects.move(moves, len(self._submaps) - 1)

    def _add_cloud(self, keyframe: Keyframe, clean_m: F32, submap: int) -> None:
        c, pose = self.config, keyframe.world_from_camera
        thin = clean_m[:: c.stride, :: c.stride]
        xyz = transform(pose, backproject(clean_m, keyframe.intrinsics, c.stride))
        near = (thin <= c.max_depth_m)[thin > 0]  # in the order of backproject: row by row
        self._voxels.fuse(xyz[near], keyframe.color[:: c.stride, :: c.stride][thin > 0][near], submap)
        origin = pose[:3, 3]
        # what lies beyond the trusted range still proves that the space before it is free
        shorten = np.minimum(1.0, c.max_depth_m / thin[thin > 0])[:, None]
        self._free.carve(origin, origin + (xyz - origin) * shorten, submap)

    def _is_stable(self, one: Instance) -> bool:
        c = self.config
        seen_enough = one.observations >= max(c.min_observations, c.recognised_share * one.chances)
        return seen_enough and max(one.votes.values()) >= c.min_score * one.observations

    def _map(self, final: bool) -> Map:
        c = self.config
        self._next_map = len(self._submaps) + max(c.map_every, round(c.map_share * len(self._submaps)))
        source = self._latest or self._last
        assert source is not None
        revision, self._revision = self._revision, self._revision + 1
        return Map(
            frame_id=source.frame_id,
            stamp_ns=source.stamp_ns,
            revision=revision,
            final=final,
            keyframes=len(self._submaps),
            voxel_m=c.voxel_m,
            points_world=self._voxels.points(),
            point_colors=self._voxels.colors(),
            free_cell_m=c.free_cell_m,
            free_points_world=self._free.points(),
            camera_positions_world=self._submaps.positions.astype(np.float32),
            **pack_objects(*map_objects(self._objects, self._is_stable, c.lift)),
        )


NODE = FusionNode
