"""One object of the map: its voxels, its votes for tags, when it was seen."""

from __future__ import annotations

from copy import copy
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from placegraph.nodes.fusion.clustering import main_clusters
from placegraph.nodes.fusion.mask_lifting import Observation
from placegraph.nodes.fusion.object_cloud import Cloud, Ground
from placegraph.nodes.fusion.spatial_index import nearer
from placegraph.nodes.fusion.visibility import SightConfig
from placegraph.runtime.arrays import F32, F64, I64, U8, Bool
from placegraph.runtime.vision.geometry import bounding_box, yaw_box

TRIM_PERCENT = 0.5  # departs: per axis and side, what a box may lose to stray points
CLAIMED_SHARE = 0.3  # departs: of the views that showed a point and the object, those whose mask must hold the point
MAIN_SHARE = 0.2  # departs: parts smaller than this share of the largest are leaks of masks onto the background
ALONE = Ground(voxel_m=0.025)


class Solid(NamedTuple):
    """What of an object can be believed: points (M, 3) m, world; median colour (3,); its boxes, see geometry."""

    points: F32
    color: U8
    box: F32
    oriented_box: F32


class Instance:
    """An object as fusion knows it; grows by observations and by merging with another."""

    def __init__(
        self, number: int, first: Observation, keyframe: int, frame_id: int, submap: int = 0, ground: Ground = ALONE
    ) -> None:
        self.number = number  # of its id, never reused
        self.cloud = Cloud(first.keys, first.values, submap, ground)
        self.votes: dict[str, float] = {first.name: first.score}
        self.observations = 1
        self.first_frame = self.last_frame = frame_id
        self.last_keyframe = keyframe  # counted from 0 over the run
        self.chances = 1  # keyframes that showed it, whether or not it was recognised
        self._in_sight: I64 = np.zeros(0, np.int64)  # its voxels that the latest keyframe saw
        self.absences = 0  # keyframes that saw through most of it since it was last seen
        self.gaps = 0  # views that showed two things with a gap between them, less those that showed one
        self.sides: tuple[F64, F64] = (np.zeros((0, 3)), np.zeros((0, 3)))  # as the last such view had them
        self.revision = 0
        self._refresh()

    def look_away(self) -> None:
        """The next keyframe may not show it: what the last one saw is no longer in sight."""
        self._in_sight = self._in_sight[:0]

    def update(self, seen: Observation, keyframe: int, frame_id: int, submap: int = 0) -> None:
        """Add one view; a second mask of the same keyframe adds points and votes but is no further observation."""
        if keyframe != self.last_keyframe:
            self.observations += 1
            self.cloud.show(self._in_sight)
        self.last_keyframe, self.last_frame = keyframe, frame_id
        self.absences = 0
        self.votes[seen.name] = self.votes.get(seen.name, 0.0) + seen.score
        self.cloud.add(seen.keys, seen.values, submap)
        self._refresh()

    def absorb(self, other: Instance) -> None:
        """Take over another instance's points, votes and views."""
        self.observations += other.observations
        self.chances = max(self.chances, other.chances)
        self.first_frame = min(self.first_frame, other.first_frame)
        self.last_frame = max(self.last_frame, other.last_frame)
        self.last_keyframe = max(self.last_keyframe, other.last_keyframe)
        self.absences = 0
        for name, votes in other.votes.items():
            self.votes[name] = self.votes.get(name, 0.0) + votes
        self.cloud.absorb(other.cloud)
        self._refresh()

    def split(self, number: int) -> Instance:
        """Give what lies nearer to the second of its sides to a new instance, with the same votes and views."""
        second = nearer(self.points, self.sides)
        other = copy(self)
        other.number, other.votes, other.cloud = number, dict(self.votes), self.cloud.copy()
        other.cloud.remove(~second)
        self.cloud.remove(second)
        for one in (self, other):
            one.gaps = 0
            one._refresh()
        return other

    def follow(self) -> None:
        """Lie where the submaps lie now."""
        self.absences = 0
        self.cloud.place_again()
        self._refresh()

    def look(self, through: Bool, there: Bool, config: SightConfig) -> None:
        """Take what one keyframe says of each point (N,): most of what it can tell about is there, or has gone.

        Points of a thing that is there go when they have been seen through in so many keyframes: it has been moved by
        less than its size, or they never were part of it.
        """
        cloud = self.cloud
        self._in_sight = cloud.keys[there]
        self.chances += 2 * int(there.sum()) >= len(there)
        told = int(through.sum() + there.sum())
        if told < config.visible_share * len(through):
            return
        cloud.seen_through[through & (cloud.seen_through < config.views)] += 1
        cloud.seen_through[there & (cloud.seen_through > 0)] -= 1
        if through.sum() >= config.through_share * told:
            self.absences += 1
            return
        self.absences = 0
        gone = cloud.seen_through >= config.views
        if gone.any() and not gone.all():
            cloud.remove(gone)
            self._refresh()

    def tags(self) -> list[tuple[str, float]]:
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
        self._solid: Solid | None = None

    @property
    def tree(self) -> cKDTree:
        """KD-tree of all points, built when first asked for."""
        if self._tree is None:
            self._tree = cKDTree(self.points)
        return self._tree

    def solid(self, eps: float, min_points: int) -> Solid:
        """The points that can be believed, their colour and boxes.

        Points go that few of the masks held though the camera saw them, then parts far smaller than the main one, then
        `TRIM_PERCENT` at each end of each axis.
        """
        if self._solid is None:
            # colour and depth of most cameras are a few pixels apart: what masks drag in from behind changes with the
            # viewpoint, the thing itself does not
            kept = np.flatnonzero(self.cloud.claimed() >= CLAIMED_SHARE)
            kept = kept if len(kept) else np.arange(len(self.points))
            main = main_clusters(self.points[kept], eps, min_points, MAIN_SHARE)
            kept = kept[main] if len(main) else kept
            low, high = np.percentile(self.points[kept], (TRIM_PERCENT, 100 - TRIM_PERCENT), axis=0)
            kept = kept[((self.points[kept] >= low) & (self.points[kept] <= high)).all(axis=1)]
            colors = self.values[kept, 3:6] / self.values[kept, 6:7]
            points = self.points[kept].astype(np.float32)
            color = np.median(colors, axis=0).round().astype(np.uint8)
            self._solid = Solid(points, color, bounding_box(points), yaw_box(points))
        return self._solid
