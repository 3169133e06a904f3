"""Odometry by shape alone: KISS-ICP, whose map never takes a scan that does not fit it (the only kiss_icp import).

Source: KISS-ICP (Vizzo 2023), the order of its pipeline. Not as there: each scan is judged before the map is updated.
"""

from __future__ import annotations

import numpy as np
from kiss_icp.config import KISSConfig
from kiss_icp.kiss_icp import KissICP
from pydantic import BaseModel, Field
from scipy.spatial import KDTree

from placegraph.nodes.pose.motion_model import extrapolate_motion
from placegraph.nodes.pose.odometry import DepthPointsConfig, PoseEstimate, depth_points
from placegraph.runtime.arrays import F32, F64
from placegraph.runtime.messages import Frame
from placegraph.runtime.vision.geometry import transform

# chosen by hand
TREE_PERIOD = 10  # frames between rebuilds of the search tree that judges the fit
MIN_FIT_OF_OLD_TREE = 0.8  # a worse fit is judged again with a tree of the whole map
MAX_JUDGED_POINTS = 1000


class KissIcpConfig(BaseModel, frozen=True, strict=True, extra="forbid"):
    """Values for an indoor depth camera, chosen on 7-Scenes (docs/results.md)."""

    voxel_m: float = Field(default=0.1, gt=0)
    max_points_per_voxel: int = 20
    initial_threshold_m: float = 0.3  # KISS-ICP's 2.0 is for cars
    min_motion_m: float = 0.02
    min_points: int = 200  # with fewer, the lens is covered or a white wall too near
    min_quality: float = 0.25  # share of the scan that must lie on the map; a step through a doorway leaves a third
    min_quality_after_loss: float = 0.7  # instead, after a lost track: a wrong place fits halfway, too
    max_innovation_m: float = 0.3  # in one frame, from constant motion; a hand-held camera changes its motion by less


class KissIcpOdometry:
    """Poses of successive scans; a scan that does not fit the local map is reported and left out of it."""

    def __init__(self, config: KissIcpConfig, points_config: DepthPointsConfig, threads: int) -> None:
        self._config, self._points_config = config, points_config
        self._kiss = KissICP(_kiss_config(config, points_config, threads))
        self._tree: KDTree | None = None
        self._tree_age = 0  # frames put into the map since the tree was built
        self._is_lost = False
        self._stamp_ns: int | None = None
        self._delta_span_ns = 0  # time between the two frames of `last_delta`
        self._random = np.random.default_rng(points_config.seed)

    def estimate(self, frame: Frame, depth_m: F32) -> PoseEstimate:
        """The pose of the next frame."""
        return self.register(depth_points(depth_m, frame.intrinsics, self._points_config), frame.stamp_ns)

    def register(self, points: F32, stamp_ns: int) -> PoseEstimate:
        """The pose of the next scan, (N, 3) metres, camera frame."""
        span_ns = 0 if self._stamp_ns is None else stamp_ns - self._stamp_ns
        self._stamp_ns = stamp_ns
        if len(points) < self._config.min_points:
            return self._lost(f"{len(points)} points, {self._config.min_points} needed")
        kiss = self._kiss
        scan = kiss.preprocessor.preprocess(points.astype(np.float64), np.zeros(len(points)), kiss.last_delta)
        source, downsampled = kiss.voxelize(scan)
        sigma = kiss.adaptive_threshold.get_threshold()
        guess = kiss.last_pose @ extrapolate_motion(kiss.last_delta, span_ns, self._delta_span_ns)
        pose = kiss.registration.align_points_to_map(
            points=source,
            voxel_map=kiss.local_map,
            initial_guess=guess,
            max_correspondance_distance=3 * sigma,
            kernel=sigma,
        )
        innovation = np.linalg.inv(guess) @ pose
        innovation_m = float(np.linalg.norm(innovation[:3, 3]))
        xyz_start = transform(pose, np.asarray(source))
        quality, residual_m = self._fit(xyz_start)
        if quality < MIN_FIT_OF_OLD_TREE and self._tree_age:
            self._build_tree()
            quality, residual_m = self._fit(xyz_start)
        if self._tree is not None:
            if quality < (self._config.min_quality_after_loss if self._is_lost else self._config.min_quality):
                reason = f"only {quality:.0%} of the scan lies on the map"
                return self._lost(reason, quality, residual_m, innovation_m)
            if innovation_m > self._config.max_innovation_m:
                return self._lost(f"jumped {innovation_m:.2f} m in one frame", quality, residual_m, innovation_m)
        kiss.adaptive_threshold.update_model_deviation(innovation)
        kiss.local_map.update(downsampled, pose)
        kiss.last_delta = np.linalg.inv(kiss.last_pose) @ pose
        kiss.last_pose = pose
        self._delta_span_ns = span_ns
        self._tree_age += 1
        if self._tree is None or self._tree_age >= TREE_PERIOD:
            self._build_tree()
        self._is_lost = False
        return PoseEstimate(pose, "", quality, residual_m, innovation_m)

    def _build_tree(self) -> None:
        self._tree, self._tree_age = KDTree(self._kiss.local_map.point_cloud()), 0

    def _fit(self, xyz: F64) -> tuple[float, float]:
        """Share of points with a map point within 1.5 voxels, and the median distance of those (metres)."""
        if self._tree is None or len(xyz) == 0:
            return 1.0, float("nan")
        if len(xyz) > MAX_JUDGED_POINTS:
            xyz = xyz[self._random.choice(len(xyz), MAX_JUDGED_POINTS, replace=False)]
        distances, _ = self._tree.query(xyz, distance_upper_bound=1.5 * self._config.voxel_m)
        distances = distances[np.isfinite(distances)]
        return len(distances) / len(xyz), float(np.median(distances)) if len(distances) else float("nan")

    def _lost(self, reason: str, *measured: float) -> PoseEstimate:
        """Stay at the last trusted pose and try again from there with the next frame."""
        self._kiss.last_delta = np.eye(4)
        self._is_lost = True
        return PoseEstimate(self._kiss.last_pose, reason, *measured)


def _kiss_config(config: KissIcpConfig, points_config: DepthPointsConfig, threads: int) -> KISSConfig:
    kiss = KISSConfig()
    kiss.data.max_range, kiss.data.min_range = points_config.max_range_m, points_config.min_range_m
    kiss.data.deskew = False  # a depth image has one time; KISS-ICP aborts the process when it deskews equal times
    kiss.mapping.voxel_size = config.voxel_m
    kiss.mapping.max_points_per_voxel = config.max_points_per_voxel
    kiss.registration.max_num_threads = threads
    kiss.adaptive_threshold.initial_threshold = config.initial_threshold_m
    kiss.adaptive_threshold.min_motion_th = config.min_motion_m
    return kiss
