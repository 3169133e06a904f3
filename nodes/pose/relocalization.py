"""Find a lost camera again: views of the past with their poses, to one of which the lost camera's view is matched.

Source: ours; a view is matched by ORB features with depth, as a loop closure is.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

from pydantic import BaseModel, Field

from placegraph.nodes.pose.feature_tracker import RgbdView
from placegraph.runtime.arrays import F64
from placegraph.runtime.vision.features import FeatureConfig, ViewFeatures, match_views
from placegraph.runtime.vision.geometry import nearest_rigid


class RelocalizationConfig(BaseModel, frozen=True, strict=True, extra="forbid"):
    """How many views are remembered, and how many a lost camera's view is compared with; both chosen by hand."""

    max_remembered_views: int = Field(default=200, ge=1)  # the newest
    max_candidates: int = Field(default=12, ge=1)  # remembered views compared with each frame of a lost camera
    features: FeatureConfig = FeatureConfig()


class Relocalizer:
    """Views with their poses (4, 4) start_from_camera, metres, oldest first."""

    def __init__(self, config: RelocalizationConfig) -> None:
        self._config = config
        self._views: deque[tuple[ViewFeatures, F64]] = deque(maxlen=config.max_remembered_views)
        self._next_candidate = 0  # where the search through all views goes on

    def remember(self, view: RgbdView, pose: F64) -> None:
        """Add a view whose pose is trusted; the oldest is forgotten when there are too many."""
        self._views.append((view.features, pose))

    def match_newest(self, view: RgbdView) -> F64 | None:
        """The pose of a view by the newest remembered views; None when it matches none of them."""
        return self._match(view, list(self._views)[: -self._config.max_candidates - 1 : -1])

    def relocalize(self, view: RgbdView) -> F64 | None:
        """The pose of a lost camera's view by remembered views, half of them the newest and half all others in turn.

        None when it matches none of them; the next call goes on with others.
        """
        views, max_candidates = list(self._views), self._config.max_candidates
        newest = views[: -(max_candidates // 2) - 1 : -1]
        others = [views[(self._next_candidate + k) % len(views)] for k in range(max_candidates - len(newest))]
        self._next_candidate += len(others)
        return self._match(view, [*newest, *others])

    def _match(self, view: RgbdView, candidates: Sequence[tuple[ViewFeatures, F64]]) -> F64 | None:
        for features, pose in candidates:
            match = match_views(features, view.features, self._config.features)
            if match is not None:
                return nearest_rigid(pose @ match.reference_from_camera)
        return None
