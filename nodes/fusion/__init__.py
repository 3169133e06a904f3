"""Node `fusion`: keyframes and their segments to the voxel map and the objects, published as a whole Map."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from pydantic import Field

from placegraph.models_onnx.text_encoder import TextEncoder
from placegraph.nodes.fusion.map_message import map_objects
from placegraph.nodes.fusion.mask_lifting import LiftConfig, lift_masks
from placegraph.nodes.fusion.object_association import AssociationConfig, ObjectMap
from placegraph.nodes.fusion.object_cloud import VoxelContext
from placegraph.nodes.fusion.object_instance import KeyframeStamp, ObjectInstance
from placegraph.nodes.fusion.submaps import SubmapConfig, Submaps
from placegraph.nodes.fusion.visibility import DepthVisibility, VisibilityConfig
from placegraph.nodes.fusion.voxel_map import FreeSpace, VoxelMap, depth_edges
from placegraph.runtime.arrays import F32
from placegraph.runtime.errors import SchemaError
from placegraph.runtime.messages import Correction, Keyframe, LastKeyframe, Map, Message, Segments, pack_objects
from placegraph.runtime.messages.synchronizer import FrameSynchronizer
from placegraph.runtime.node import Context, Node, NodeConfig
from placegraph.runtime.vision.geometry import backproject, is_rigid, transform


class FusionConfig(NodeConfig):
    """Settings of the map."""

    # Between two Maps are at least so many keyframes, and at least this share of all keyframes so far: a Map of a long
    # run costs more.
    map_every_keyframes: int = Field(default=10, ge=1)
    map_share: float = Field(default=0.05, ge=0)
    voxel_m: float = Field(default=0.05, gt=0)  # chosen by hand; also the cell of the room layer
    stride: int = Field(default=4, ge=1)  # every 4th pixel each way: 2 cm apart at 3 m, under half a voxel
    max_depth_m: float = Field(default=5.0, gt=0)
    edge_ratio: float = Field(default=0.05, gt=0)  # see depth_edges
    free_cell_m: float = Field(default=0.1, gt=0)  # in plan
    free_height_m: float = Field(default=0.5, gt=0)
    free_clearance_m: float = Field(default=0.15, ge=0)  # rays stop short of the surface by more than the depth noise
    min_observations: int = Field(default=3, ge=1)  # ConceptGraphs; an object seen less often is not in the Map
    # Minimum share of the keyframes that showed an object in which it was recognised. 18 of house 9002's 156 objects
    # have less, and 17 of these are wrong.
    recognized_share: float = Field(default=0.5, ge=0, le=1)
    # Minimum score of an object's strongest name, as the mean over the views that recognised it. Detectors differ in
    # their scores, so the dataflow file sets the value.
    min_score: float = Field(default=0.0, ge=0, le=1)
    lift: LiftConfig = LiftConfig()
    association: AssociationConfig = AssociationConfig()
    visibility: VisibilityConfig = VisibilityConfig()
    submap: SubmapConfig = SubmapConfig()


class FusionNode(Node):
    """Publishes a Map every `map_every_keyframes` keyframes, more rarely in a long run, and a final one.

    With a pose graph, keyframes are fused at its corrected poses, and the map moves when it corrects earlier ones.
    """

    config_type = FusionConfig
    inputs: tuple[type[Message], ...] = (Keyframe, Segments, Correction, LastKeyframe)
    optional = (Correction,)
    outputs = (Map,)
    config: FusionConfig

    def __init__(self, config: FusionConfig, context: Context) -> None:
        super().__init__(config, context)
        takes_corrections = Correction.__name__ in context.produced_kinds
        self.inputs = tuple(kind for kind in type(self).inputs if takes_corrections or kind is not Correction)
        self._synchronizer = FrameSynchronizer(*(kind for kind in self.inputs if kind is not LastKeyframe))
        self._submaps = Submaps(config.submap)
        self._voxels = VoxelMap(config.voxel_m, takes_corrections)
        self._free = FreeSpace(config.free_cell_m, config.free_height_m, config.free_clearance_m, takes_corrections)
        voxel_context = VoxelContext(config.lift.voxel_m, takes_corrections)
        self._objects = ObjectMap(TextEncoder().encode, voxel_context, config.association)
        self._pending_corrections: list[Correction] = []  # not yet applied, in order
        self._latest: Message | None = None  # the keyframe whose frame id and stamp the next Map carries
        self._last: LastKeyframe | None = None
        self._revision = 0
        self._next_map = config.map_every_keyframes  # keyframes from the start to the next Map
        self._ended = False

    def step(self, message: Message) -> Sequence[Message]:
        """Fuse the keyframes that are complete.

        Raises SchemaError for a pose that is not rigid, and for a message after the last keyframe.
        """
        if self._ended:
            raise SchemaError(f"fusion: {type(message).__name__} of frame {message.frame_id} after the last keyframe")
        maps: list[Message] = []
        if isinstance(message, LastKeyframe):
            self._last = message
        else:
            if isinstance(message, Correction) and len(message.moved_frame_ids):
                self._pending_corrections.append(message)
            joined = self._synchronizer.add(message)
            if joined is None:
                return maps
            self._fuse_keyframe(*joined)
            if len(self._submaps) >= self._next_map:
                maps.append(self._make_map(final=False))
        fused_frame = -1 if self._latest is None else self._latest.frame_id
        if self._last is not None and fused_frame >= self._last.frame_id:
            self._objects.merge_duplicates(len(self._submaps) - 1)
            maps.append(self._make_map(final=True))
            self._ended = True
        return maps

    def _fuse_keyframe(self, keyframe: Message, segments: Message, correction: Message | None = None) -> None:
        assert isinstance(keyframe, Keyframe) and isinstance(segments, Segments)
        if isinstance(correction, Correction):
            self._apply_corrections_until(correction.frame_id)
            keyframe = replace(keyframe, world_from_camera=correction.world_from_camera)
        pose = keyframe.world_from_camera
        if not is_rigid(pose):
            raise SchemaError(f"Keyframe {keyframe.frame_id}: world_from_camera is not a finite rigid transform")
        depth_m = keyframe.depth_m
        edges = depth_edges(depth_m, self.config.edge_ratio)
        visibility = DepthVisibility(depth_m, edges, keyframe.intrinsics, pose, self.config.visibility)
        self._voxels.remove_seen_through(visibility)
        self._objects.apply_visibility(visibility)
        submap = self._submaps.add_keyframe(keyframe.frame_id, pose)
        stamp = KeyframeStamp(len(self._submaps) - 1, keyframe.frame_id, submap)
        self._fuse_points(keyframe, np.where(edges, np.float32(0), depth_m), submap)
        self._objects.add(lift_masks(keyframe, depth_m, edges, segments, self.config.lift), stamp)
        self._objects.retire_absent(self.config.visibility.views, keyframe.frame_id)
        self._latest = keyframe

    def _apply_corrections_until(self, frame_id: int) -> None:
        """Apply all corrections so far, also of keyframes whose segments were lost with a process in a live run."""
        due = [correction for correction in self._pending_corrections if correction.frame_id <= frame_id]
        self._pending_corrections = self._pending_corrections[len(due) :]
        for correction in due:
            moves = self._submaps.apply_correction(correction)
            for layer in (self._voxels, self._free):
                for submap, world_from_fused in moves.items():
                    layer.move_submap(submap, world_from_fused)
            if moves:
                self._objects.move_submaps(moves, len(self._submaps) - 1)

    def _fuse_points(self, keyframe: Keyframe, clean_m: F32, submap: int) -> None:
        c, pose = self.config, keyframe.world_from_camera
        sampled_m = clean_m[:: c.stride, :: c.stride]
        xyz = transform(pose, backproject(clean_m, keyframe.intrinsics, c.stride))
        near = (sampled_m <= c.max_depth_m)[sampled_m > 0]  # in the order of backproject: row by row
        self._voxels.integrate(xyz[near], keyframe.color[:: c.stride, :: c.stride][sampled_m > 0][near], submap)
        origin = pose[:3, 3]
        # readings beyond the trusted range still prove that the space before them is free
        shorten = np.minimum(1.0, c.max_depth_m / sampled_m[sampled_m > 0])[:, None]
        self._free.carve(origin, origin + (xyz - origin) * shorten, submap)

    def _is_stable(self, instance: ObjectInstance) -> bool:
        c = self.config
        min_observations = max(c.min_observations, c.recognized_share * instance.times_visible)
        return (
            instance.observations >= min_observations
            and max(instance.votes.values()) >= c.min_score * instance.observations
        )

    def _make_map(self, final: bool) -> Map:
        c = self.config
        self._next_map = len(self._submaps) + max(c.map_every_keyframes, round(c.map_share * len(self._submaps)))
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
