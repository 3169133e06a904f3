"""KISS-ICP, composed so that a scan that does not fit is never put into its map (the only kiss_icp import).

Source: KISS-ICP (Vizzo 2023), its pipeline's order; departs: each scan is judged before the map is updated.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from kiss_icp.config import KISSConfig
from kiss_icp.kiss_icp import KissICP
from pydantic import Field
from scipy.spatial import KDTree

from placegraph.nodes.pose.motion_model import stretched
from placegraph.runtime.arrays import F32, F64
from placegraph.runtime.node import NodeConfig
from placegraph.runtime.vision.geometry import transform


class OdometryConfig(NodeConfig):
    """Values for an indoor depth camera; measured on 7-Scenes (README, "Results")."""

    min_range_m: float = 0.2
    max_range_m: float = 6.0
    voxel_m: float = Field(0.1, gt=0)
    max_points_per_voxel: int = 20
    initial_threshold_m: float = 0.3  # KISS-ICP's 2.0 is for cars
    min_motion_m: float = 0.02
    min_points: int = 200  # fewer: a covered lens, a white wall too near
    min_quality: float = 0.25  # share of the scan that must lie on the map; a step through a doorway leaves a third
    relock_quality: float = 0.7  # share needed to go on after a lost track: a wrong place fits halfway, too
    max_innovation_m: float = 0.3  # a hand-held camera does not depart further from constant motion in one frame
    seed: int = 0


class Odometry:
    """KISS-ICP against its local map; what does not fit is reported and left out of it."""

    TREE_PERIOD = 10  # frames between rebuilds of the search tree that judges the fit
    FRESH_TREE_BELOW = 0.8  # a worse fit is judged again with a tree of the whole map
    JUDGED_POINTS = 1000

    def __init__(self, config: OdometryConfig, threads: int) -> None:
        self._config = config
        self._kiss = KissICP(_kiss_config(config, threads))
        self._tree: KDTree | None = None
        self._tree_age = 0  # frames put into the map since the tree was grown
        self._is_lost = False
        self._stamp_ns: int | None = None
        self._span_ns = 0  # between the two frames that `last_delta` lies between
        self._random = np.random.default_rng(config.seed)

    def register(self, points: F32, stamp_ns: int) -> dict[str, Any]:
        """Fields of the Pose for one scan, (N, 3) metres, camera frame; the start frame is the first camera."""
        span_ns, self._stamp_ns = stamp_ns - (self._stamp_ns or stamp_ns), stamp_ns
        if len(points) < self._config.min_points:
            return self._lost(f"{len(points)} points, {self._config.min_points} needed")
        kiss = self._kiss
        scan = kiss.preprocessor.preprocess(points.astype(np.float64), np.zeros(len(points)), kiss.last_delta)
        source, downsampled = kiss.voxelize(scan)
        sigma = kiss.adaptive_threshold.get_threshold()
        guess = kiss.last_pose @ stretched(kiss.last_delta, span_ns, self._span_ns)
        pose = kiss.registration.align_points_to_map(
            points=source,
            voxel_map=kiss.local_map,
            initial_guess=guess,
            max_correspondance_distance=3 * sigma,
            kernel=sigma,
        )
        innovation = np.linalg.inv(guess) @ pose
        innovation_m = float(np.linalg.norm(innovation[:3, 3]))
        in_start = transform(pose, np.asarray(source))
        quality, residual_m = self._fit(in_start)
        if quality < self.FRESH_TREE_BELOW and self._tree_age:
            self._grow_tree()
            quality, residual_m = self._fit(in_start)
        measured = {"quality": quality, "residual_m": residual_m, "innovation_m": innovation_m}
        if self._tree is not None:
            if quality < (self._config.relock_quality if self._is_lost else self._config.min_quality):
                return self._lost(f"only {quality:.0%} of the scan lies on the map", measured)
            if innovation_m > self._config.max_innovation_m:
                return self._lost(f"jumped {innovation_m:.2f} m in one frame", measured)
        kiss.adaptive_threshold.update_model_deviation(innovation)
        kiss.local_map.update(downsampled, pose)
        kiss.last_delta = np.linalg.inv(kiss.last_pose) @ pose
        kiss.last_pose = pose
        self._span_ns = span_ns
        self._tree_age += 1
        if self._tree is None or self._tree_age >= self.TREE_PERIOD:
            self._grow_tree()
        self._is_lost = False
        return {"world_from_camera": pose, "trusted": True, "reason": "", **measured}

    def _grow_tree(self) -> None:
        self._tree, self._tree_age = KDTree(self._kiss.local_map.point_cloud()), 0

    def _fit(self, xyz: F64) -> tuple[float, float]:
        """Share of points with a map point within 1.5 voxels, and the median distance of those (metres)."""
        if self._tree is None or len(xyz) == 0:
            return 1.0, float("nan")
        if len(xyz) > self.JUDGED_POINTS:
            xyz = xyz[self._random.choice(len(xyz), self.JUDGED_POINTS, replace=False)]
        distances, _ = self._tree.query(xyz, distance_upper_bound=1.5 * self._config.voxel_m)
        near = distances[np.isfinite(distances)]
        return len(near) / len(xyz), float(np.median(near)) if len(near) else float("nan")

    def _lost(self, reason: str, measured: dict[str, float] | None = None) -> dict[str, Any]:
        """Stay at the last trusted pose and try again from there with the next frame."""
        self._kiss.last_delta = np.eye(4)
        self._is_lost = True
        nothing = {"quality": 0.0, "residual_m": float("nan"), "innovation_m": 0.0}
        return {
            "world_from_camera": self._kiss.last_pose,
            "trusted": False,
            "reason": reason,
            **(measured or nothing),
        }


def _kiss_config(config: OdometryConfig, threads: int) -> KISSConfig:
    kiss = KISSConfig()
    kiss.data.max_range, kiss.data.min_range = config.max_range_m, config.min_range_m
    kiss.data.deskew = False  # a depth image has one time; deskewing equal times aborts the process (FACTS 5)
    kiss.mapping.voxel_size = config.voxel_m
    kiss.mapping.max_points_per_voxel = config.max_points_per_voxel
    kiss.registration.max_num_threads = threads
    kiss.adaptive_threshold.initial_threshold = config.initial_threshold_m
    kiss.adaptive_threshold.min_motion_th = config.min_motion_m
    return kiss
