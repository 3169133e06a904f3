"""Pose graph: keyframes to Corrections; closes loops and moves what odometry has placed wrongly.

Odometry does not need it: its poses matter to the map alone. Only when it is behind by more keyframes than the windows
of the bus hold (runtime/messages/topics.py) does it hold up what comes before it.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence

import numpy as np
from pydantic import Field

from placegraph.nodes.pose_graph.level_surfaces import LevelConfig, find_level
from placegraph.nodes.pose_graph.loop_detector import Loop, LoopConfig, Places
from placegraph.nodes.pose_graph.optimizer import Edge, Level, optimise
from placegraph.runtime.arrays import F64, I64
from placegraph.runtime.messages import Correction, Keyframe, Message
from placegraph.runtime.node import Context, Node, NodeConfig
from placegraph.runtime.vision.geometry import inverse, nearest_rigid, rotation_angle_rad
from placegraph.runtime.vision.registration import logarithm

logger = logging.getLogger(__name__)

PATIENCE = 40  # moving so many keyframes waits for one more keyframe the next time: a long run's steps stay short


class PoseGraphConfig(NodeConfig):
    """Sigmas of what the graph is made of, and when the map is told."""

    # of a step between keyframes, departs: from the house's walks; in a longer step errors add up as a random walk's do
    odometry_m: float = Field(default=0.004, gt=0)
    odometry_rad: float = Field(default=0.003, gt=0)
    step_m: float = Field(default=0.15, gt=0)
    step_rad: float = Field(default=0.15, gt=0)
    loop_m: float = Field(default=0.015, gt=0)  # of a verified loop; its own covariance takes errors as independent
    loop_rad: float = Field(default=0.008, gt=0)
    # a loop that departs from the poses by less waits for others; else those from `slack` keyframes before it on give
    pull_m: float = Field(default=0.01, ge=0)
    pull_rad: float = Field(default=0.004, ge=0)
    slack: int = Field(default=15, ge=0)
    moved_m: float = Field(default=0.02, gt=0)  # a keyframe that moved less than this, and
    moved_rad: float = Field(default=0.005, gt=0)  # turned less, stays where the map has it
    loops: LoopConfig = LoopConfig()
    level: LevelConfig = LevelConfig()


class PoseGraphNode(Node):
    """Gives one Correction for each Keyframe, in order."""

    config_type = PoseGraphConfig
    inputs = (Keyframe,)
    outputs = (Correction,)
    config: PoseGraphConfig

    def __init__(self, config: PoseGraphConfig, context: Context) -> None:
        super().__init__(config, context)
        self._places = Places(config.loops)
        self._frame_ids: list[int] = []
        self._odometry: list[F64] = []
        self._poses = np.zeros((0, 4, 4))  # as optimised
        self._told = np.zeros((0, 4, 4))  # as the map has them
        self._walked_m = np.zeros(0)
        self._pulling: list[int] = []  # first keyframes of loops that the poses have not given way to yet
        self._next = 0  # keyframe number from which on they may
        self._edges: list[Edge] = []
        self._levels: list[Level] = []

    def step(self, message: Message) -> Sequence[Message]:
        """Add a keyframe, look for loops, and say where it is; after a loop also who moved."""
        assert isinstance(message, Keyframe)
        self._append(message)
        c, new = self.config, len(self._poses) - 1
        seen = self._places.add(message, self._poses[new])
        found: list[Loop] = []
        if seen is not None:
            level = find_level(seen.surface(c.loops.features.surface), self._poses[new], c.level)
            if level is not None:
                self._levels.append(Level(new, level, c.level.sigma_rad))
            found = self._places.loops(self._poses, self._walked_m)
        self._edges += [Edge(one.first, one.second, one.first_from_second, c.loop_m, c.loop_rad, True) for one in found]
        moved = np.zeros(0, np.int64)
        self._pulling += [one.first for one in found if self._pulls(one)]
        if self._pulling and new >= self._next:
            still = min(self._pulling) - c.slack
            self._poses = optimise(self._poses, self._edges, self._levels, still)
            moved, self._pulling, self._next = self._moved(), [], new + (new - max(0, still)) // PATIENCE
        self._told[moved] = self._poses[moved]
        self._told[new] = self._poses[new]
        return [
            Correction(
                frame_id=message.frame_id,
                stamp_ns=message.stamp_ns,
                world_from_camera=self._poses[new].copy(),
                moved_frame_ids=np.array(self._frame_ids, np.int64)[moved],
                moved_world_from_camera=self._poses[moved],
            )
        ]

    def _pulls(self, loop: Loop) -> bool:
        """Whether a loop says something else than the poses do."""
        expected = inverse(self._poses[loop.first]) @ self._poses[loop.second]
        off, c = logarithm(inverse(expected) @ loop.first_from_second), self.config
        return bool(np.linalg.norm(off[:3]) > c.pull_m or np.linalg.norm(off[3:]) > c.pull_rad)

    def _append(self, keyframe: Keyframe) -> None:
        """The new pose continues odometry from where the graph has the last keyframe."""
        given, c = keyframe.world_from_camera, self.config
        pose, walked_m = given, 0.0
        if self._odometry:
            last_from_new = inverse(self._odometry[-1]) @ given
            pose = nearest_rigid(self._poses[-1] @ last_from_new)
            moved_m, turned_rad = float(np.linalg.norm(last_from_new[:3, 3])), rotation_angle_rad(last_from_new[:3, :3])
            walked_m = float(self._walked_m[-1]) + moved_m
            steps = max(1.0, moved_m / c.step_m, turned_rad / c.step_rad)
            sigmas = c.odometry_m * np.sqrt(steps), c.odometry_rad * np.sqrt(steps)
            last = len(self._poses) - 1
            self._edges.append(Edge(last, last + 1, last_from_new, *sigmas, False))
        self._frame_ids.append(keyframe.frame_id)
        self._odometry.append(given)
        self._poses, self._told = (np.concatenate((poses, pose[None])) for poses in (self._poses, self._told))
        self._walked_m = np.append(self._walked_m, walked_m)

    def _moved(self) -> I64:
        """Earlier keyframes that are elsewhere than the map has them."""
        old, new, c = self._told[:-1], self._poses[:-1], self.config
        shift = np.linalg.norm(new[:, :3, 3] - old[:, :3, 3], axis=1)
        turn = np.array([rotation_angle_rad(a[:3, :3].T @ b[:3, :3]) for a, b in zip(old, new, strict=True)])
        return np.flatnonzero((shift > c.moved_m) | (turn > c.moved_rad))


NODE = PoseGraphNode
