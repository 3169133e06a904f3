"""One object of the map: its voxels, its votes for tags, when it was seen."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from placegraph.nodes.fusion.clusters import dbscan
from placegraph.nodes.fusion.lift import Observation
from placegraph.nodes.fusion.voxels import sum_by_key
from placegraph.runtime.geometry import bounding_box

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
I64 = NDArray[np.int64]
U8 = NDArray[np.uint8]

TRIM_PERCENT = 0.5  # departs: per axis and side, what a box may lose to stray points
REPEATED_SHARE = 0.2  # departs: of the views that its best seen points had, what a point needs
MAIN_SHARE = 0.2  # departs: parts smaller than this share of the largest are leaks of masks onto the background


class Instance:
    """An object as fusion knows it; grows by observations and by merging with another."""

    def __init__(self, number: int, first: Observation, keyframe: int, frame_id: int) -> None:
        self.number = number  # of its id, never reused
        self.keys: I64 = first.keys
        self.values: F64 = first.values  # (N, 8), see Observation; the last column counts views
        self.votes: dict[str, float] = {first.name: first.score}
        self.observations = 1
        self.first_frame = self.last_frame = frame_id
        self.last_keyframe = keyframe  # counted from 0 over the run
        self.revision = 0
        self._refresh()

    def update(self, seen: Observation, keyframe: int, frame_id: int) -> None:
        """Add one view; a second mask of the same keyframe adds points and votes but is no further observation."""
        self.observations += keyframe != self.last_keyframe
        self.last_keyframe, self.last_frame = keyframe, frame_id
        self.votes[seen.name] = self.votes.get(seen.name, 0.0) + seen.score
        self._add(seen.keys, seen.values)

    def absorb(self, other: Instance) -> None:
        """Take over another instance's points, votes and views."""
        self.observations += other.observations
        self.first_frame = min(self.first_frame, other.first_frame)
        self.last_frame = max(self.last_frame, other.last_frame)
        self.last_keyframe = max(self.last_keyframe, other.last_keyframe)
        for name, votes in other.votes.items():
            self.votes[name] = self.votes.get(name, 0.0) + votes
        self._add(other.keys, other.values)

    def tags(self) -> list[tuple[str, float]]:
        """Names with their summed scores, strongest first, then by name."""
        return sorted(self.votes.items(), key=lambda vote: (-vote[1], vote[0]))

    def _add(self, keys: I64, values: F64) -> None:
        self.keys, self.values = sum_by_key(np.r_[self.keys, keys], np.r_[self.values, values])
        self._refresh()

    def _refresh(self) -> None:
        self.points: F64 = self.values[:, :3] / self.values[:, 6:7]  # (N, 3) m, world
        self.box: F32 = bounding_box(self.points)
        self.revision += 1
        self._tree: cKDTree | None = None
        self._solid: tuple[F32, U8] | None = None

    @property
    def tree(self) -> cKDTree:
        """KD-tree of all points, built when first asked for."""
        if self._tree is None:
            self._tree = cKDTree(self.points)
        return self._tree

    def solid(self, eps: float, min_points: int) -> tuple[F32, U8]:
        """Points (M, 3) that can be believed and their median colour (3,).

        Of three or more views, points that few of them claim go unless that would cost over half (it is seen from all
        around); then parts far smaller than the main one; then `TRIM_PERCENT` at each end of each axis.
        """
        if self._solid is None:
            kept = np.arange(len(self.points))
            views = self.values[:, 7]
            # colour and depth of most cameras are a few pixels apart: what masks drag in from behind changes with the
            # viewpoint, the thing itself does not
            repeated = np.flatnonzero(views >= max(2.0, REPEATED_SHARE * float(np.percentile(views, 90))))
            if self.observations >= 3 and 2 * len(repeated) >= len(kept):
                kept = repeated
            kept = kept[_main_parts(self.points[kept], eps, min_points)]
            low, high = np.percentile(self.points[kept], (TRIM_PERCENT, 100 - TRIM_PERCENT), axis=0)
            kept = kept[((self.points[kept] >= low) & (self.points[kept] <= high)).all(axis=1)]
            colors = self.values[kept, 3:6] / self.values[kept, 6:7]
            self._solid = self.points[kept].astype(np.float32), np.median(colors, axis=0).round().astype(np.uint8)
        return self._solid


def _main_parts(points: F64, eps: float, min_points: int) -> I64:
    labels = dbscan(points, eps, min_points)
    if not (labels >= 0).any():
        return np.arange(len(points))
    sizes = np.bincount(labels[labels >= 0])
    return np.flatnonzero((labels >= 0) & (sizes >= MAIN_SHARE * sizes.max())[labels])
