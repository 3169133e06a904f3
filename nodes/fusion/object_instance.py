"""One object of the map: its voxels, its votes for names, and when it was seen."""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy, deepcopy
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from placegraph.nodes.fusion.mask_lifting import Observation
from placegraph.nodes.fusion.object_cloud import ObjectCloud, VoxelContext
from placegraph.nodes.fusion.spatial_index import is_nearer_to_second
from placegraph.nodes.fusion.visibility import VisibilityConfig
from placegraph.runtime.arrays import F32, F64, I64, U8, Bool
from placegraph.runtime.vision.clustering import main_clusters
from placegraph.runtime.vision.geometry import bounding_box, yaw_box

# All three were chosen by hand.
TRIM_PERCENT = 0.5  # of the points are left out of a box at each end of each axis, as strays
MIN_MASK_SHARE = 0.3  # a point is kept when it was in the mask in this share of the views that saw it
MIN_CLUSTER_SHARE = 0.2  # of the largest cluster's size; smaller clusters are leaks of masks onto the background


class KeyframeStamp(NamedTuple):
    """When something was seen: the keyframe, counted from 0 over the run, its frame id and its submap."""

    keyframe: int
    frame_id: int
    submap: int


class ObjectGeometry(NamedTuple):
    """The trusted part of an object: points (M, 3) m, world; median colour (3,); its boxes as in vision.geometry."""

    points: F32
    color: U8
    box: F32
    oriented_box: F32


class ObjectInstance:
    """An object as fusion knows it; it grows by observations and by merging with another."""

    def __init__(self, object_id: int, observation: Observation, stamp: KeyframeStamp, context: VoxelContext) -> None:
        self.object_id = object_id  # never reused
        self.cloud = ObjectCloud(observation.keys, observation.values, stamp.submap, context)
        self.votes: dict[str, float] = {observation.name: observation.score}
        self.observations = 1
        self.first_frame = self.last_frame = stamp.frame_id
        self.last_keyframe = stamp.keyframe  # counted from 0 over the run
        self.times_visible = 1  # keyframes that showed it, whether or not it was recognised
        self.times_absent = 0  # keyframes that saw through most of it since it was last seen
        self.split_votes = 0  # views that showed two objects with a gap between them, less those that showed one
        self.split_sides: tuple[F64, F64] = (np.zeros((0, 3)), np.zeros((0, 3)))  # the two, in the last such view
        self.revision = 0
        self._visible_keys: I64 = np.zeros(0, np.int64)  # its voxels that the latest keyframe saw
        self._refresh()

    def clear_visible(self) -> None:
        """Forget which voxels the last keyframe saw: the next one may not show the object."""
        self._visible_keys = self._visible_keys[:0]

    def update(self, observation: Observation, stamp: KeyframeStamp) -> None:
        """Add one view. A second mask of the same keyframe adds points and votes but counts as no further view."""
        if stamp.keyframe != self.last_keyframe:
            self.observations += 1
            self.cloud.count_visible(self._visible_keys)
        self.last_keyframe, self.last_frame = stamp.keyframe, stamp.frame_id
        self.times_absent = 0
        self.votes[observation.name] = self.votes.get(observation.name, 0.0) + observation.score
        self.cloud.add(observation.keys, observation.values, stamp.submap)
        self._refresh()

    def merge(self, duplicate: ObjectInstance) -> None:
        """Take over a duplicate's points, votes and views."""
        self.observations += duplicate.observations
        self.times_visible = max(self.times_visible, duplicate.times_visible)
        self.first_frame = min(self.first_frame, duplicate.first_frame)
        self.last_frame = max(self.last_frame, duplicate.last_frame)
        self.last_keyframe = max(self.last_keyframe, duplicate.last_keyframe)
        self.times_absent = 0
        for name, votes in duplicate.votes.items():
            self.votes[name] = self.votes.get(name, 0.0) + votes
        self.cloud.merge(duplicate.cloud)
        self._refresh()

    def split(self, object_id: int) -> ObjectInstance:
        """Move the points nearer to the second of `split_sides` to a new object with the same votes and views."""
        second = is_nearer_to_second(self.points, self.split_sides)
        new = copy(self)
        new.object_id, new.votes, new.cloud = object_id, dict(self.votes), deepcopy(self.cloud)
        new.cloud.remove(~second)
        self.cloud.remove(second)
        for instance in (self, new):
            instance.split_votes = 0
            instance._refresh()
        return new

    def move_submaps(self, moves: Mapping[int, F64]) -> None:
        """Follow submaps that have moved, see ObjectCloud."""
        self.times_absent = 0
        self.cloud.move_submaps(moves)
        self._refresh()

    def apply_visibility(self, seen_through: Bool, seen: Bool, config: VisibilityConfig) -> None:
        """Count what one keyframe shows of each point (N,): the object is there, or it is absent.

        Of an object that is there, points go that `config.views` more keyframes have seen through than seen: it was
        moved by less than its size, or they were never part of it.
        """
        cloud = self.cloud
        self._visible_keys = cloud.keys[seen]
        self.times_visible += 2 * int(seen.sum()) >= len(seen)
        observed = int(seen_through.sum() + seen.sum())
        if observed < config.visible_share * len(seen_through):
            return
        cloud.seen_through[seen_through & (cloud.seen_through < config.views)] += 1
        cloud.seen_through[seen & (cloud.seen_through > 0)] -= 1
        if seen_through.sum() >= config.through_share * observed:
            self.times_absent += 1
            return
        self.times_absent = 0
        removed = cloud.seen_through >= config.views
        if removed.any() and not removed.all():
            cloud.remove(removed)
            self._refresh()

    def ranked_votes(self) -> list[tuple[str, float]]:
        """Names with their summed scores, strongest first, then by name."""
        return sorted(self.votes.items(), key=lambda vote: (-vote[1], vote[0]))

    @property
    def values(self) -> F64:
        """(N, 8) sums of each voxel, see Observation; the last column counts views."""
        return self.cloud.values

    def _refresh(self) -> None:
        self.points: F64 = self.values[:, :3] / self.values[:, 6:7]  # (N, 3) m, world
        self.box: F32 = bounding_box(self.points)
        self.revision += 1
        self._tree: cKDTree | None = None
        self._geometry: ObjectGeometry | None = None

    @property
    def tree(self) -> cKDTree:
        """KD-tree of all points, built at the first request."""
        if self._tree is None:
            self._tree = cKDTree(self.points)
        return self._tree

    def geometry(self, eps: float, min_points: int) -> ObjectGeometry:
        """The points that can be trusted, their colour and boxes.

        Removed are points that the camera saw but few masks held, clusters far smaller than the main one, and
        `TRIM_PERCENT` of the points at each end of each axis.
        """
        if self._geometry is None:
            # Colour and depth of most cameras are a few pixels apart. What masks therefore take from the background
            # changes with the viewpoint, the object does not.
            kept = np.flatnonzero(self.cloud.mask_shares() >= MIN_MASK_SHARE)
            kept = kept if len(kept) else np.arange(len(self.points))
            main = main_clusters(self.points[kept], eps, min_points, MIN_CLUSTER_SHARE)
            kept = kept[main] if len(main) else kept
            low, high = np.percentile(self.points[kept], (TRIM_PERCENT, 100 - TRIM_PERCENT), axis=0)
            kept = kept[((self.points[kept] >= low) & (self.points[kept] <= high)).all(axis=1)]
            colors = self.values[kept, 3:6] / self.values[kept, 6:7]
            points = self.points[kept].astype(np.float32)
            color = np.median(colors, axis=0).round().astype(np.uint8)
            self._geometry = ObjectGeometry(points, color, bounding_box(points), yaw_box(points))
        return self._geometry
