"""Node `pose_graph`: keyframes to Corrections; closes loops and moves keyframes that odometry has placed wrongly.

Odometry does not need it: corrected poses only matter to the map. It delays odometry only when it is further behind
than the windows of the bus allow (runtime/messages/topics.py).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from pydantic import Field

from placegraph.nodes.pose_graph.level_surfaces import LevelSurfaceConfig, up_from_level_surfaces
from placegraph.nodes.pose_graph.loop_detector import Loop, LoopDetector, LoopDetectorConfig
from placegraph.nodes.pose_graph.optimizer import Edge, UpMeasurement, optimize
from placegraph.runtime.arrays import F64, I64
from placegraph.runtime.messages import Correction, Keyframe, Message
from placegraph.runtime.node import Context, Node, NodeConfig
from placegraph.runtime.vision.geometry import inverse, nearest_rigid, rotation_angle_rad
from placegraph.runtime.vision.registration import is_within

# After an optimisation that may move n keyframes, the next n / 40 keyframes start no other: otherwise a long run would
# spend its time on optimising. Chosen by hand.
MOVED_PER_WAIT = 40


class PoseGraphConfig(NodeConfig):
    """Standard deviations of the measurements, and when poses are optimised and published."""

    # Errors of odometry from keyframe to keyframe, for a step of at most `step_m` and `step_rad`; chosen on the house
    # walks. The error of a longer step grows with the square root of its length, as in a random walk.
    odometry_sigma_m: float = Field(default=0.004, gt=0)
    odometry_sigma_rad: float = Field(default=0.003, gt=0)
    step_m: float = Field(default=0.15, gt=0)
    step_rad: float = Field(default=0.15, gt=0)
    # Errors of a verified loop. They are not those that its registration computes, which are too small because it takes
    # the errors of all points as independent.
    loop_sigma_m: float = Field(default=0.015, gt=0)
    loop_sigma_rad: float = Field(default=0.008, gt=0)
    # Poses are optimised when a loop differs from them by more than this. The keyframes that may move begin
    # `keyframes_before_loop` before the first one of the loop.
    min_loop_error_m: float = Field(default=0.01, ge=0)
    min_loop_error_rad: float = Field(default=0.004, ge=0)
    keyframes_before_loop: int = Field(default=15, ge=0)
    # A keyframe that moved and turned less than this keeps its place in the map.
    min_correction_m: float = Field(default=0.02, gt=0)
    min_correction_rad: float = Field(default=0.005, gt=0)
    loops: LoopDetectorConfig = LoopDetectorConfig()
    level: LevelSurfaceConfig = LevelSurfaceConfig()


class PoseGraphNode(Node):
    """Gives one Correction for each Keyframe, in order."""

    config_type = PoseGraphConfig
    inputs = (Keyframe,)
    outputs = (Correction,)
    config: PoseGraphConfig

    def __init__(self, config: PoseGraphConfig, context: Context) -> None:
        super().__init__(config, context)
        self._loop_detector = LoopDetector(config.loops)
        self._frame_ids: list[int] = []
        self._last_odometry: F64 | None = None
        self._poses = np.zeros((0, 4, 4))  # as optimised
        self._published_poses = np.zeros((0, 4, 4))  # as the map has them
        self._travelled_m = np.zeros(0)
        self._pending_loops: list[int] = []  # first keyframes of loops since the last optimisation
        self._next_optimization = 0  # number of the first keyframe that may start it
        self._edges: list[Edge] = []
        self._ups: list[UpMeasurement] = []

    def step(self, message: Message) -> Sequence[Message]:
        """Add a keyframe, look for loops, and give its pose; after an optimisation also those of moved keyframes."""
        assert isinstance(message, Keyframe)
        self._append(message)
        new = len(self._poses) - 1
        loops = self._measure(message)
        moved = np.zeros(0, np.int64)
        self._pending_loops += [loop.first for loop in loops if self._contradicts_poses(loop)]
        if self._pending_loops and new >= self._next_optimization:
            fixed = min(self._pending_loops) - self.config.keyframes_before_loop
            self._poses = optimize(self._poses, self._edges, self._ups, fixed)
            moved, self._pending_loops = self._moved(), []
            self._next_optimization = new + (new - max(0, fixed)) // MOVED_PER_WAIT
        self._published_poses[moved] = self._poses[moved]
        self._published_poses[new] = self._poses[new]
        return [
            Correction(
                frame_id=message.frame_id,
                stamp_ns=message.stamp_ns,
                world_from_camera=self._poses[new].copy(),
                moved_frame_ids=np.array(self._frame_ids, np.int64)[moved],
                moved_world_from_camera=self._poses[moved],
            )
        ]

    def _append(self, keyframe: Keyframe) -> None:
        """Add the new pose: odometry's last step, from where the graph has the last keyframe."""
        pose, travelled_m, c = keyframe.world_from_camera, 0.0, self.config
        if self._last_odometry is not None:
            last_from_new = inverse(self._last_odometry) @ keyframe.world_from_camera
            pose = nearest_rigid(self._poses[-1] @ last_from_new)
            moved_m, turned_rad = float(np.linalg.norm(last_from_new[:3, 3])), rotation_angle_rad(last_from_new[:3, :3])
            travelled_m = float(self._travelled_m[-1]) + moved_m
            steps = max(1.0, moved_m / c.step_m, turned_rad / c.step_rad)
            sigmas = c.odometry_sigma_m * np.sqrt(steps), c.odometry_sigma_rad * np.sqrt(steps)
            last = len(self._poses) - 1
            self._edges.append(Edge(last, last + 1, last_from_new, *sigmas, robust=False))
        self._frame_ids.append(keyframe.frame_id)
        self._last_odometry = keyframe.world_from_camera
        self._poses = np.concatenate((self._poses, pose[None]))
        self._published_poses = np.concatenate((self._published_poses, pose[None]))
        self._travelled_m = np.append(self._travelled_m, travelled_m)

    def _measure(self, keyframe: Keyframe) -> list[Loop]:
        """Add what the newest keyframe measures, its up direction and its loops, and return the loops."""
        c, pose = self.config, self._poses[-1]
        features = self._loop_detector.add(keyframe, pose)
        if features is None:
            return []
        up = up_from_level_surfaces(features.surface(c.loops.features.surface), pose, c.level)
        if up is not None:
            self._ups.append(UpMeasurement(len(self._poses) - 1, up, c.level.sigma_rad))
        loops = self._loop_detector.find_loops(self._poses, self._travelled_m)
        sigmas = c.loop_sigma_m, c.loop_sigma_rad
        self._edges += [Edge(loop.first, loop.second, loop.first_from_second, *sigmas, robust=True) for loop in loops]
        return loops

    def _contradicts_poses(self, loop: Loop) -> bool:
        expected = inverse(self._poses[loop.first]) @ self._poses[loop.second]
        error, c = inverse(expected) @ loop.first_from_second, self.config
        return not is_within(error, c.min_loop_error_m, c.min_loop_error_rad)

    def _moved(self) -> I64:
        """Numbers of earlier keyframes that are no longer where the map has them."""
        old, new, c = self._published_poses[:-1], self._poses[:-1], self.config
        shift = np.linalg.norm(new[:, :3, 3] - old[:, :3, 3], axis=1)
        turn = np.array([rotation_angle_rad(a[:3, :3].T @ b[:3, :3]) for a, b in zip(old, new, strict=True)])
        return np.flatnonzero((shift > c.min_correction_m) | (turn > c.min_correction_rad))


NODE = PoseGraphNode
