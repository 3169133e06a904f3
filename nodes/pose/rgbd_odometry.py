"""Odometry by colour and depth, judged frame by frame; a lost track is found again at a place seen before.

A frame is trusted when enough of what is tracked agrees on its pose. Through a frame or a few that are not (a bare
wall, a swift turn) the predicted motion is kept up, held by the surface. A camera that coasts for too long, or whose
frame shows another place altogether (it was carried), is lost until it recognises where it is.
"""

from __future__ import annotations

from collections import deque
from typing import Any

import numpy as np
from pydantic import BaseModel, Field

from placegraph.nodes.pose.feature_tracker import TrackConfig, Tracker, View
from placegraph.nodes.pose.motion_model import stretched
from placegraph.runtime.arrays import F64
from placegraph.runtime.vision.features import FeatureConfig, Features, describe, relate
from placegraph.runtime.vision.geometry import inverse, nearest_rigid

MIN_CELLS = 300  # of coarse depth, for the surface to have a say
NOTHING = {"quality": 0.0, "residual_m": float("nan"), "innovation_m": 0.0}  # measured of a frame that was not tracked


class RgbdConfig(BaseModel, frozen=True, strict=True, extra="forbid"):
    """When a pose is trusted. Departs: with these every wrong pose of a house's walk at 10 and 3.3 Hz was told."""

    min_inliers: int = Field(default=20, ge=6)  # corners and patches that agree
    min_share: float = Field(default=0.15, gt=0)  # of those tracked
    coast_s: float = Field(default=1.0, ge=0)  # a motion may be kept up so long
    # of the view's points on the reference's surface: what neither corners nor this explain is another place
    # On bare walls and in swift turns it was .43 at least
    min_met: float = Field(default=0.35, ge=0, le=1)
    places: int = Field(default=200, ge=1)  # views kept to be recognised, the newest
    tries: int = Field(default=12, ge=1)  # of them looked at for each frame of a lost track
    track: TrackConfig = TrackConfig()
    features: FeatureConfig = FeatureConfig()


class RgbdOdometry:
    """Poses of views, one after the other; the start frame is the first camera."""

    def __init__(self, config: RgbdConfig) -> None:
        self._config = config
        self._tracker = Tracker(config.track)
        self._pose = np.eye(4)
        self._delta = np.eye(4)  # the last motion
        self._stamp_ns: int | None = None
        self._span_ns = 0  # between the two frames that `_delta` lies between
        self._since_ns: int | None = None  # the last trusted frame's stamp, once one was not
        self._started = self._is_lost = False
        self._places: deque[tuple[Features, F64]] = deque(maxlen=config.places)
        self._turn = 0  # of the search through all places

    def register(self, view: View, stamp_ns: int) -> dict[str, Any]:
        """Fields of the Pose for one view."""
        span_ns, last_ns = stamp_ns - (self._stamp_ns or stamp_ns), self._stamp_ns
        self._stamp_ns = stamp_ns
        if not self._started:
            return self._start(view)
        if self._is_lost or (self._since_ns is not None and (stamp_ns - self._since_ns) * 1e-9 > self._config.coast_s):
            return self._search(view)
        guess = nearest_rigid(self._pose @ stretched(self._delta, span_ns, self._span_ns))
        track = self._tracker.track(view, guess)
        pose, c = track.start_from_camera, self._config
        measured = {
            "quality": track.share,
            "residual_m": float("nan"),
            "innovation_m": float(np.linalg.norm((inverse(guess) @ pose)[:3, 3])),
        }
        if track.inliers < c.min_inliers or track.share < c.min_share:
            is_blind = np.count_nonzero(view.coarse_m) < MIN_CELLS  # covered: tells nothing, and is not tracked from
            if track.met < c.min_met and not is_blind:
                return self._search(view)
            self._since_ns = last_ns if self._since_ns is None else self._since_ns
            self._move(pose, span_ns)
            if not is_blind:
                self._tracker.accept(view, pose, track)
            return self._untrusted(f"{track.inliers} of the tracked corners agree ({track.share:.0%})", measured)
        if self._since_ns is not None:  # coasted: does an earlier view tell how far it went astray?
            self._since_ns = None
            recognised = self._recognise(view, list(self._places)[: -c.tries - 1 : -1])
            if recognised is not None:
                self._pose, self._delta, self._span_ns = recognised, inverse(self._pose) @ pose, span_ns
                self._tracker.accept(view, recognised)
                return _trusted(recognised, measured)
        self._move(pose, span_ns)
        if self._tracker.accept(view, pose, track):
            self._remember(view)
        return _trusted(pose, measured)

    def _start(self, view: View) -> dict[str, Any]:
        self._tracker.accept(view, self._pose)
        if len(self._tracker) < self._config.min_inliers:
            return self._untrusted(f"{len(self._tracker)} corners with depth to begin with", NOTHING)
        self._started = True
        self._remember(view)
        return _trusted(self._pose, NOTHING | {"quality": 1.0})

    def _search(self, view: View) -> dict[str, Any]:
        """Look for a lost camera among the places: the newest ones first, then in turn through all of them."""
        places, c, self._is_lost = list(self._places), self._config, True
        newest = places[: -(c.tries // 2) - 1 : -1]
        others = [places[(self._turn + k) % len(places)] for k in range(c.tries - len(newest))]
        self._turn += len(others)
        pose = self._recognise(view, [*newest, *others])
        if pose is None:
            return self._untrusted("lost: no place seen before is recognised", NOTHING)
        jump_m = float(np.linalg.norm(pose[:3, 3] - self._pose[:3, 3]))
        self._pose, self._delta, self._span_ns, self._since_ns = pose, np.eye(4), 0, None
        self._is_lost = False
        self._tracker.accept(view, pose)
        return _trusted(pose, NOTHING | {"quality": 1.0, "innovation_m": jump_m})

    def _recognise(self, view: View, places: list[tuple[Features, F64]]) -> F64 | None:
        if not places:
            return None
        seen = describe(view.gray, view.depth_m, view.intrinsics, self._config.features)
        for features, pose in places:
            found = relate(features, seen, self._config.features)
            if found is not None:
                return nearest_rigid(pose @ found.reference_from_camera)
        return None

    def _remember(self, view: View) -> None:
        seen = describe(view.gray, view.depth_m, view.intrinsics, self._config.features)
        self._places.append((seen, self._pose))

    def _move(self, pose: F64, span_ns: int) -> None:
        self._delta, self._pose, self._span_ns = inverse(self._pose) @ pose, pose, span_ns

    def _untrusted(self, reason: str, measured: dict[str, float]) -> dict[str, Any]:
        return {"world_from_camera": self._pose, "trusted": False, "reason": reason, **measured}


def _trusted(pose: F64, measured: dict[str, float]) -> dict[str, Any]:
    return {"world_from_camera": pose, "trusted": True, "reason": "", **measured}
