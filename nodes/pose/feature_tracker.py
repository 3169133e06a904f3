"""Corners tracked from image to image against the landmarks of a local map, and the surface of a reference view.

Each landmark is a corner with a position in the start frame, the mean of what its views say. Where an image has few
corners, large patches of the last one are found again by their shades. Source: ours, after Nister 2004 (visual
odometry), Lucas-Kanade tracks and KinectFusion's surface. Departs: KISS-ICP, by shape alone, slides along walls and
drifts on a stereo camera's depth (README, "Results").
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from pydantic import BaseModel, Field

from placegraph.runtime.arrays import F32, F64, I64, U8, Bool
from placegraph.runtime.vision.geometry import transform
from placegraph.runtime.vision.point_to_plane import Surface, SurfaceConfig, coarse_depth, scan_points
from placegraph.runtime.vision.registration import (
    Corners,
    Laid,
    Registered,
    RegistrationConfig,
    inverse_depth_at,
    project,
    rays,
    register,
)


class TrackConfig(BaseModel, frozen=True, strict=True, extra="forbid"):
    """Distances and patches are those of an image 640 pixels wide and scale with it; windows of the search do not."""

    corners: int = Field(default=400, ge=20)
    corner_distance_px: float = 14.0
    corner_quality: float = 0.005  # of the strongest corner
    window_px: int = 21  # Lucas-Kanade
    levels: int = 3
    back_px: float = 1.0  # tracked back, a corner must come out so near to where it was
    patches_below: int = 80  # corners that agree; with fewer, patches help
    patch_px: int = 50
    motion_sigma_m: float = 0.03  # a frame's motion departs from the last one's by so much
    turn_sigma_rad: float = 0.02
    reference_share: float = 0.6  # of a view's points that must meet the reference, or it becomes the next one
    registration: RegistrationConfig = RegistrationConfig()
    surface: SurfaceConfig = SurfaceConfig()


@dataclass(frozen=True, eq=False)
class View:
    """One image: gray (H, W), depth (H, W) in metres with 0 = no reading, intrinsics fx fy cx cy in px."""

    gray: U8
    depth_m: F32
    intrinsics: F64

    @cached_property
    def coarse_m(self) -> F32:
        """Its depth on the grid of surfaces."""
        return coarse_depth(self.depth_m)


@dataclass(frozen=True, eq=False)
class Track:
    """A view's pose (4, 4) start_from_camera, how many corners and patches agree with it and their share."""

    start_from_camera: F64
    inliers: int
    share: float
    met: float  # share of the view's points that lie on the reference's surface
    uv: F32  # (N, 2) of the landmarks that agree
    landmarks: I64  # (N,) which those are


class Tracker:
    """Landmarks where the last image showed them; `track` looks for them in a view, `accept` takes the view in."""

    def __init__(self, config: TrackConfig) -> None:
        self._config = config
        self._last: tuple[View, F64] | None = None  # with its pose
        self._reference: tuple[Surface, F64] | None = None
        self._uv = np.zeros((0, 2), np.float32)
        self._xyz = np.zeros((0, 3))  # metres, start frame
        self._information = np.zeros(0)  # of the position: sum of 1 / depth^4 over views

    def __len__(self) -> int:
        return len(self._uv)

    def track(self, view: View, guess: F64) -> Track:
        """The pose of a view, near the predicted `guess` (4, 4) start_from_camera."""
        c = self._config
        uv, kept = self._follow(view, guess)
        corners = Corners(self._xyz[kept], uv[kept], inverse_depth_at(view.depth_m, uv[kept]))
        laid = self._reference and Laid(scan_points(view.coarse_m, view.intrinsics), *self._reference)
        found = self._register(corners, laid, view, guess)
        if found.inlier.sum() < c.patches_below:
            corners_and_patches = corners.and_also(self._patches(view, guess))
            found = self._register(corners_and_patches, laid, view, guess)
        inlier = found.inlier[: len(corners)]
        return Track(
            start_from_camera=found.reference_from_camera,
            inliers=int(found.inlier.sum()),
            share=float(found.inlier.mean()) if len(found.inlier) else 0.0,
            met=found.met,
            uv=uv[kept][inlier],
            landmarks=np.flatnonzero(kept)[inlier],
        )

    def accept(self, view: View, start_from_camera: F64, track: Track | None = None) -> bool:
        """Take in a view at its pose; without `track` the old landmarks are forgotten. Is it the new reference?"""
        self._uv, kept = (track.uv, track.landmarks) if track else (self._uv[:0], np.zeros(0, np.int64))
        self._xyz, self._information = self._xyz[kept], self._information[kept]
        self._update(view, start_from_camera)
        self._add_corners(view, start_from_camera)
        self._last = view, start_from_camera
        if track is not None and track.met >= self._config.reference_share:
            return False
        self._reference = Surface(view.coarse_m, view.intrinsics, self._config.surface), start_from_camera
        return True

    def _register(self, corners: Corners, laid: Laid | None, view: View, guess: F64) -> Registered:
        c = self._config
        return register(corners, laid, view.intrinsics, guess, c.registration, (c.motion_sigma_m, c.turn_sigma_rad))

    def _follow(self, view: View, guess: F64) -> tuple[F32, Bool]:
        c = self._config
        if self._last is None or self._last[0].gray.shape != view.gray.shape or not len(self._uv):
            return self._uv, np.zeros(len(self._uv), bool)
        expected = project(self._xyz, view.intrinsics, guess)
        start = np.where(np.isfinite(expected), expected, self._uv).astype(np.float32)
        return _tracked(self._last[0].gray, view.gray, self._uv, start, c.window_px, c)

    def _patches(self, view: View, guess: F64) -> Corners:
        """Patches of the last view, on a grid, found again in this one: a bare wall has shades but no corners."""
        c = self._config
        if self._last is None or self._last[0].gray.shape != view.gray.shape:
            return Corners(np.zeros((0, 3)), np.zeros((0, 2), np.float32), np.zeros(0))
        last, pose = self._last
        height, width = view.gray.shape
        side = max(8, round(c.patch_px * width / 640))  # half of it is the least window that OpenCV takes
        v, u = np.mgrid[side // 2 : height : side, side // 2 : width : side]
        uv = np.stack((u.ravel(), v.ravel()), axis=1).astype(np.float32)
        inverse_depth = inverse_depth_at(last.depth_m, uv)
        uv, z = uv[inverse_depth > 0], 1 / inverse_depth[inverse_depth > 0]
        xyz = transform(pose, rays(uv, last.intrinsics) * z[:, None])
        if not len(uv):
            return Corners(xyz, uv, z)
        expected = project(xyz, view.intrinsics, guess)
        start = np.where(np.isfinite(expected), expected, uv).astype(np.float32) / np.float32(2)
        found, kept = _tracked(_shades(last.gray), _shades(view.gray), uv / np.float32(2), start, side // 2, c)
        found = found[kept] * np.float32(2)
        return Corners(xyz[kept], found, inverse_depth_at(view.depth_m, found))

    def _update(self, view: View, start_from_camera: F64) -> None:
        inverse_depth = inverse_depth_at(view.depth_m, self._uv)
        seen = inverse_depth > 1 / self._config.surface.max_depth_m
        z = 1 / inverse_depth[seen]
        xyz = transform(start_from_camera, rays(self._uv[seen], view.intrinsics) * z[:, None])
        total = self._information[seen] + z**-4.0
        self._xyz[seen] += (xyz - self._xyz[seen]) * (z**-4.0 / total)[:, None]
        self._information[seen] = total

    def _add_corners(self, view: View, start_from_camera: F64) -> None:
        c = self._config
        wanted = c.corners - len(self._uv)
        if wanted <= 0:
            return
        free = ((view.depth_m > 0) & (view.depth_m < c.surface.max_depth_m)).astype(np.uint8) * np.uint8(255)
        distance = max(2.0, c.corner_distance_px * view.gray.shape[1] / 640)
        for u, v in self._uv.tolist():
            cv2.circle(free, (round(u), round(v)), round(distance), 0, -1)
        found = cv2.goodFeaturesToTrack(view.gray, wanted, c.corner_quality, distance, mask=free)
        if found is None:
            return
        uv = found.reshape(-1, 2).astype(np.float32)
        inverse_depth = inverse_depth_at(view.depth_m, uv)
        uv, z = uv[inverse_depth > 0], 1 / inverse_depth[inverse_depth > 0]
        xyz = transform(start_from_camera, rays(uv, view.intrinsics) * z[:, None])
        self._uv, self._xyz = np.concatenate((self._uv, uv)), np.concatenate((self._xyz, xyz))
        self._information = np.concatenate((self._information, z**-4.0))


def _tracked(before: U8, now: U8, uv: F32, start: F32, window_px: int, c: TrackConfig) -> tuple[F32, Bool]:
    """Where points (N, 2) of one image are in the next, sought from `start`; and which of them come back out."""

    def flow(a: U8, b: U8, from_uv: F32, to_uv: F32) -> tuple[F32, Bool]:
        uv, found, _ = cv2.calcOpticalFlowPyrLK(
            a, b, from_uv, to_uv.copy(), winSize=(window_px, window_px), maxLevel=c.levels,
            flags=cv2.OPTFLOW_USE_INITIAL_FLOW,
        )  # fmt: skip
        return np.asarray(uv, np.float32), np.asarray(found).ravel() == 1

    found, is_found = flow(before, now, uv, start)
    back, is_back = flow(now, before, found, uv)
    height, width = now.shape
    inside = (found >= 0).all(axis=1) & (found[:, 0] <= width - 1) & (found[:, 1] <= height - 1)
    near = np.linalg.norm(back - uv, axis=1) <= c.back_px
    return found, is_found & is_back & inside & near


def _shades(gray: U8) -> U8:
    """Half the size: shades without grain and without what is wider than a patch, over the contrast around them.

    A lens' vignette would else stand still while the wall passes.
    """
    small = cv2.resize(gray, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA).astype(np.float32)
    high = cv2.GaussianBlur(small, (0, 0), 1.0) - cv2.GaussianBlur(small, (0, 0), 15.0)
    deviation = np.sqrt(cv2.GaussianBlur(high * high, (0, 0), 15.0)) + 0.5
    return np.asarray(np.clip(128 + 40 * high / deviation, 0, 255), np.uint8)
